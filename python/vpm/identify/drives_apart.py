"""Drives one by one: along a given motion those that share no supply whose pressure gives way do not feel each other.

A fault that is tried at one cylinder then asks for that cylinder alone, and the others answer from memory.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vpm.catalogue import EFFECTS
from vpm.model import Model, Shape


@dataclass(frozen=True)
class Drives:
    """Drives that belong together, as a machine that has no others.

    Attributes
    ----------
    model : Model
        Without laws of joints, controllers and all that belongs to other drives alone; its values mean nothing.
    places, inputs, states : ndarray of int
        Its parameters, inputs, and states of drives and supplies among those of the whole machine.
    own : ndarray of int
        Those of its own parameters that change what the drives do along a given motion.
    """

    model: Model
    places: NDArray[np.int64]
    inputs: NDArray[np.int64]
    states: NDArray[np.int64]
    own: NDArray[np.int64]


def moves_drives(model: Model, name: str) -> bool:
    """Whether a parameter can change what drives do along a given motion; none of bodies, joints and gravity can."""
    owner = name.partition(".")[0]
    return owner not in model.joints and owner not in model.bodies and owner != "world"


def drives_of(model: Model) -> tuple[Drives, ...]:
    """Split a machine with rigid links, all of whose joints were measured, into drives that do not feel each other."""
    return _drives_of(Shape(model))


@lru_cache(maxsize=128)
def _drives_of(shape: Shape) -> tuple[Drives, ...]:
    model = shape.model
    document = model.to_dict()
    return tuple(_alone(model, document, group) for group in _groups(model))


def _groups(model: Model) -> list[tuple[str, ...]]:
    """Names of drives that belong together: those of one supply with a state, such as a pressure that sags."""
    if model.beams:
        return [tuple(model.actuators)]
    giving_way = {name.partition(".")[0] for name in model.internal_names} & set(model.supplies)
    groups: dict[str, list[str]] = {}
    for name in model.actuators:
        supply = model.supply_of_actuator(name)
        groups.setdefault(f"supply {supply}" if supply in giving_way else name, []).append(name)
    return [tuple(group) for group in groups.values()]


def _alone(model: Model, document: dict[str, Any], group: tuple[str, ...]) -> Drives:
    """A machine with some of the drives only."""
    mine = dict(document)
    mine.pop("controllers", None)
    mine["actuators"] = {name: document["actuators"][name] for name in group}
    joints = {joint for name in group for joint in model.joints_of_actuator(name)}
    felt = {*group, *joints, *model.supplies}
    sensors = document.get("sensors", {})
    kept = {name: entry for name, entry in sensors.items() if entry["measures"].partition(".")[0] in felt}
    sites = {*group, *model.supplies, *kept}
    effects = [entry for entry in document.get("effects", ()) if entry["at"] in sites]
    mine["sensors"] = kept
    mine["effects"] = [entry for entry in effects if EFFECTS[entry["type"]].site != "joint"]
    alone = Model.from_dict(mine)
    alone = alone.at("rigid") if alone.beams else alone
    own = [place for place, name in enumerate(alone.parameter_names) if moves_drives(alone, name)]
    return Drives(
        alone,
        _places(alone.parameter_names, model.parameter_names),
        _places(alone.inputs, model.inputs),
        _places(alone.internal_names, model.internal_names),
        np.array(own, dtype=np.int64),
    )


def _places(names: tuple[str, ...], whole: tuple[str, ...]) -> NDArray[np.int64]:
    places: Iterator[int] = (whole.index(name) for name in names)
    return np.fromiter(places, dtype=np.int64, count=len(names))
