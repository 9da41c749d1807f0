"""Lines: straight connections between two points, and the masses on them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, ClassVar

from pydantic import Field

from vpm.model.component import Component, Described, Index
from vpm.model.entry import ORIGIN, ZERO, Entry, Number, ParameterValue, Text, Vector
from vpm.model.messages import Problem, place
from vpm.model.parameters import ANY, NOT_NEGATIVE, Rule
from vpm.model.pose import Pose

if TYPE_CHECKING:
    from vpm.model.structure import Structure


class End(Entry):
    """End of a line: a point of a body, of a beam, or of the world."""

    parent: Text
    at: Number | None = None
    point: Vector = ORIGIN

    def described(self, structure: Structure) -> Described:
        """What the core reads of an end of a line."""
        frame = structure.mounted(self.parent, self.at, Pose(self.point))
        return {"on": frame.mount.described(), "point": list(frame.pose.translation)}


class Part(Entry):
    """Half of a line with mass; `center` counts from the own end toward the other one."""

    mass: Annotated[ParameterValue, Rule("kg", NOT_NEGATIVE, kind="linear")]
    center: Annotated[ParameterValue, Rule("m", ANY)] = ZERO
    inertia: Annotated[ParameterValue, Rule("kg m^2", NOT_NEGATIVE, kind="linear")] = ZERO


class Line(Component):
    """Straight connection between two points that a drive can push apart: a cylinder, a screw, a rope."""

    EXAMPLES: ClassVar[Mapping[str, str]] = {
        "from": 'from = { parent = "world", point = [0.0, 0.0, 0.0] }',
        "to": 'to = { parent = "link", point = [0.1, 0.0, 0.0] }',
    }
    CHANNELS: ClassVar[Mapping[str, str]] = {"length": "m", "rate": "m/s", "tension": "N"}

    start: End = Field(alias="from")
    end: End = Field(alias="to")
    barrel: Part | None = None
    rod: Part | None = None

    def problems(self, name: str, structure: Structure) -> Iterator[Problem]:
        """Problem of a line whose length cannot change between its ends."""
        start, end = self.start, self.end
        if start.parent == end.parent and (start.at == end.at or start.parent not in structure.document.beams):
            rest = f'has both ends on "{start.parent}", so its length cannot change; give one end another parent'
            yield Problem(place("lines", name), rest)

    def described(self, name: str, structure: Structure, index: Index) -> Described:
        """What the core reads of a line between two points."""
        parts = {
            key: None if part is None else {short: index[f"{name}.{key}.{short}"] for short in Part.model_fields}
            for key, part in (("barrel", self.barrel), ("rod", self.rod))
        }
        return {"name": name, "from": self.start.described(structure), "to": self.end.described(structure), **parts}
