"""Transmissions of a model file: shafts that turn with a combination of joints."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

from pydantic import Field

from vpm.catalogue import JointKind
from vpm.model.drive_parameters import ANY, NOT_NEGATIVE, Row
from vpm.model.entry import Entry, ParameterValue

#: Kind of joint that a shaft is like: it turns, and its effort is a torque.
TURNING: JointKind = "revolute"


class Transmission(Entry):
    """Shaft whose angle is the sum of ratio times coordinate over joints, with the rotor on it."""

    ratios: Annotated[dict[str, ParameterValue], Field(min_length=1)]
    inertia: ParameterValue | None = None


def transmission_rows(transmission: Transmission, units: dict[str, str]) -> Iterator[Row]:
    """Parameters of a transmission.

    Parameters
    ----------
    transmission : Transmission
    units : dict of str to str
        SI unit of the coordinate of each of its joints.
    """
    for joint, ratio in transmission.ratios.items():
        yield Row(("ratios", joint), ratio, "1" if units[joint] == "rad" else f"rad/{units[joint]}", ANY, "")
    if transmission.inertia is not None:
        impossible = "an inertia cannot be negative"
        yield Row(("inertia",), transmission.inertia, "kg m^2", NOT_NEGATIVE, impossible, "linear")
