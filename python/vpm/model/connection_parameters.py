"""The parameters of contacts and bushings: names, SI units, physical ranges, and what a value outside would mean."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Literal, NamedTuple

from vpm.catalogue import POSITIVE
from vpm.model.contact import DIRECTIONS, Bushing, Contact, entries, entry_name
from vpm.model.entry import Quantity

Range = tuple[float, float]

_ANY: Range = (-math.inf, math.inf)
_NOT_NEGATIVE: Range = (0.0, math.inf)
_ABOVE_ZERO: Range = (POSITIVE, math.inf)

_PULLING = "a contact with negative stiffness would pull the body in"
_FEEDING = "negative damping would feed energy into the motion"
_PUSHING = "negative friction would push along the motion and feed energy into it"
_FLEEING = "a bushing with negative stiffness would push away from its rest"
_SHAPELESS = "a spring that hardens with no power of the depth is none"


class ConnectionRow(NamedTuple):
    """One parameter: what its dotted name has behind the component's, and the way to it below the component."""

    suffix: str
    keys: tuple[str | int, ...]
    quantity: Quantity
    unit: str
    bounds: Range
    impossible: str
    kind: Literal["linear", "shape"] = "shape"


def stiffness_unit(exponent: float) -> str:
    """SI unit of a contact stiffness: ``N/m^1.1``."""
    return f"N/m^{exponent:.6g}"


def contact_rows(contact: Contact) -> Iterator[ConnectionRow]:
    """Parameters of a contact. The effort of a motion is linear in none of them where the pull is cut off."""
    unit = stiffness_unit(contact.exponent.value)
    yield ConnectionRow("stiffness", ("stiffness",), contact.stiffness, unit, _NOT_NEGATIVE, _PULLING)
    yield ConnectionRow("exponent", ("exponent",), contact.exponent, "1", _ABOVE_ZERO, _SHAPELESS)
    yield ConnectionRow("damping", ("damping",), contact.damping, "N s/m", _NOT_NEGATIVE, _FEEDING)
    yield ConnectionRow("damping_depth", ("damping_depth",), contact.damping_depth, "m", _ABOVE_ZERO, "")
    if contact.friction is None:
        return
    for key in ("static", "static_velocity", "dynamic", "dynamic_velocity"):
        quantity: Quantity = getattr(contact.friction, key)
        rule = ("m/s", _ABOVE_ZERO, "") if key.endswith("velocity") else ("1", _NOT_NEGATIVE, _PUSHING)
        yield ConnectionRow(f"friction.{key}", ("friction", key), quantity, *rule)


def bushing_rows(bushing: Bushing) -> Iterator[ConnectionRow]:
    """Parameters of a bushing: every entry that is written down."""
    for key, time, impossible in (("stiffness", "", _FLEEING), ("damping", " s", _FEEDING)):
        for row, column, way, quantity in entries(getattr(bushing, key)):
            bounds = _NOT_NEGATIVE if row == column else _ANY
            unit = _entry_unit(row, column, time)
            suffix = f"{key}.{entry_name(row, column)}"
            yield ConnectionRow(suffix, (key, *way), quantity, unit, bounds, impossible, "linear")
    for i, quantity in enumerate(bushing.preload or ()):
        unit = "N m" if i < 3 else "N"
        yield ConnectionRow(f"preload.{DIRECTIONS[i]}", ("preload", i), quantity, unit, _ANY, "", "linear")


def _entry_unit(row: int, column: int, time: str) -> str:
    """Moment or force per angle or way, or per the rate of it."""
    moment, angle = ("N m" if row < 3 else "N"), column < 3
    return f"{moment}{time}/{'rad' if angle else 'm'}"
