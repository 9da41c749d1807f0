"""Joints that close loops: their tables in a model file. What machines with closed loops do: `vpm.model.loops`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, ClassVar, Literal

from pydantic import Field

from vpm.errors import near_match
from vpm.model.bushing import WRENCH, BushingEnd
from vpm.model.component import Component, Described, Index
from vpm.model.controller import ComputedTorque
from vpm.model.entry import Number, Vector
from vpm.model.joint import plane, unit
from vpm.model.messages import Problem, place

if TYPE_CHECKING:
    from vpm.model.structure import Structure


class Loop(Component):
    """Joint between frames A and B that closes a loop; `axis` is in the axes of both.

    `start` holds positions of joints (m, rad) from which the loops are closed: it chooses among assemblies.
    """

    EXAMPLES: ClassVar[Mapping[str, str]] = {
        "type": 'type = "revolute"',
        "a": 'a = { parent = "crank", point = [0.1, 0.0, 0.0] }',
        "b": 'b = { parent = "rod", point = [0.3, 0.0, 0.0] }',
    }
    CHANNELS: ClassVar[Mapping[str, str]] = WRENCH

    type: Literal["revolute", "spherical", "rigid"]
    a: BushingEnd
    b: BushingEnd
    axis: Vector | None = None
    start: dict[str, Number] = Field(default_factory=dict)

    @property
    def equations(self) -> int:
        """Number of equations by which a joint closes its loop."""
        return {"spherical": 3, "revolute": 5, "rigid": 6}[self.type]

    def problems(self, name: str, structure: Structure) -> Iterator[Problem]:
        """Ends that close nothing, an axis that is missing or of no use, what does not go with closed loops."""
        document, where = structure.document, place("loops", name)
        if self.a.frame(structure).mount == self.b.frame(structure).mount:
            rest = f"has both ends on {self.a.told}, so it closes nothing; put one end on another body or beam"
            yield Problem(where, rest)
        if self.type == "revolute" and not any(self.axis or ()):
            rest = "is missing or [0, 0, 0]; give the direction about which the ends turn, such as [0, 1, 0]"
            yield Problem(place("loops", name, "axis"), rest)
        if self.type != "revolute" and self.axis is not None:
            rest = f'belongs to type = "revolute", but this is {self.type}; remove it'
            yield Problem(place("loops", name, "axis"), rest)
        for joint in self.start:
            if joint not in structure.joints:
                repair = near_match(joint, structure.joints, what="it has")
                yield Problem(place("loops", name, "start", joint), f"is no joint of one coordinate; {repair}")
        for controller, law in document.controllers.items():
            if isinstance(law, ComputedTorque):
                rest = f"closes a loop, but controller {controller} inverts the open tree; use another type, such as pd"
                yield Problem(where, rest)
        if not document.velocity_terms:
            yield Problem(where, "cannot stay closed without velocity_terms; put them back, or remove it")

    def described(self, name: str, structure: Structure, index: Index) -> Described:  # noqa: ARG002
        """What the core reads of a joint that closes a loop; a revolute one turns about the z axes of its frames."""
        axis = unit(self.axis or (0.0, 0.0, 1.0))
        columns = (*plane(axis), axis)
        axes = [column[row] for row in range(3) for column in columns]
        ends = {key: end.frame(structure).described() for key, end in (("a", self.a), ("b", self.b))}
        return {"name": name, "joint": self.type, **ends, "axes": axes}
