"""Transmissions: shafts that turn with a combination of joints."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, ClassVar

from pydantic import Field

from vpm.model.component import Component, Described, Index
from vpm.model.entry import ParameterValue
from vpm.model.joint import COORDINATE_UNIT, coordinate_problems
from vpm.model.messages import Problem, place
from vpm.model.parameters import ANY, INERTIA, NOT_NEGATIVE, Keys, Slot

if TYPE_CHECKING:
    from vpm.model.structure import Structure


class Transmission(Component):
    """Shaft whose angle is the sum of ratio times coordinate over joints, with the rotor on it."""

    EXAMPLES: ClassVar[Mapping[str, str]] = {"ratios": "ratios = { pitch = 50.0, roll = 50.0 }"}
    #: The core calls them length, rate and tension: a transmission is a line whose levers do not change.
    CHANNELS: ClassVar[Mapping[str, str]] = {"position": "rad", "velocity": "rad/s", "effort": "N m"}

    ratios: Annotated[dict[str, ParameterValue], Field(min_length=1)]
    inertia: ParameterValue | None = None

    def problems(self, name: str, structure: Structure) -> Iterator[Problem]:
        """Problems of a transmission: joints that are not there or do not turn it."""
        for joint, ratio in self.ratios.items():
            where = place("transmissions", name, "ratios", joint)
            yield from coordinate_problems(where, joint, structure)
            if ratio.value == 0.0:
                rest = f'is 0, but a shaft that does not turn with "{joint}" needs no ratio; leave the joint out'
                yield Problem(where, rest)

    def slots(self, keys: Keys, structure: Structure) -> Iterator[Slot]:
        """Parameters of a transmission."""
        for joint, ratio in self.ratios.items():
            unit = COORDINATE_UNIT[structure.joint_kind(joint)]
            yield Slot((*keys, "ratios", joint), ratio, "1" if unit == "rad" else f"rad/{unit}", ANY)
        if self.inertia is not None:
            yield Slot((*keys, "inertia"), self.inertia, "kg m^2", NOT_NEGATIVE, INERTIA, "linear")

    def levers(self, name: str, structure: Structure, index: Index) -> list[dict[str, int]]:
        """Ratios of a transmission, with the numbers of their joints."""
        places = structure.joints
        return [{"joint": places.index(joint), "ratio": index[f"{name}.ratios.{joint}"]} for joint in self.ratios]

    def described(self, name: str, structure: Structure, index: Index) -> Described:
        """What the core reads of a transmission."""
        return {"name": name, "ratios": self.levers(name, structure, index), "inertia": index.get(f"{name}.inertia")}
