"""Strain gauges on flexible links."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, ClassVar

from vpm.errors import near_match
from vpm.model.component import Component, Described, Index
from vpm.model.entry import Number, Text
from vpm.model.messages import Problem, place

if TYPE_CHECKING:
    from vpm.model.beams.section import Section
    from vpm.model.schema import Document
    from vpm.model.structure import Structure

#: A gauge may be this many half sizes of its section away from the axis: enough for layers on the surface, and too
#: little for millimetres that were taken for metres.
REACH = 2.0


class Gauge(Component):
    """Axial strain of a beam at the point (x, y) of its section at the arc length `at`."""

    CHANNELS: ClassVar[Mapping[str, str]] = {"strain": "1"}

    beam: Text
    at: Number
    x: Number = 0.0
    y: Number = 0.0

    def beam_problems(self, name: str, document: Document) -> Iterator[Problem]:
        """No beam, a place outside of it, or one where nothing that it can do strains the gauge."""
        where = place("gauges", name, "beam")
        if self.beam not in document.beams:
            repair = near_match(self.beam, document.beams, what="it has")
            yield Problem(where, f'is "{self.beam}", which is no beam of the model; {repair}')
            return
        beam = document.beams[self.beam]
        if beam.solid is not None:
            yield Problem(where, f'is "{self.beam}", a reduced solid, whose strains nobody knows; remove the gauge')
            return
        yield from beam.outside_problems(("gauges", name), self.at, self.beam)
        arms = {"bending_x": self.y, "bending_y": self.x, "extension": 1.0}
        if not any(component in beam.deforms and arm != 0.0 for component, arm in arms.items()):
            rest = (
                f'can only read zero: beam "{self.beam}" deforms in {", ".join(beam.deforms)}, and the strain at '
                f"x = {self.x:g} m, y = {self.y:g} m is extension + y bending_x - x bending_y; move the gauge"
            )
            yield Problem(place("gauges", name), rest)

    def reach_problems(self, name: str, section: Section, sizes: Mapping[str, float]) -> Iterator[Problem]:
        """Problem of a gauge far outside of its section."""
        for key, value, size in zip("xy", (self.x, self.y), section.across, strict=False):
            reach = 0.5 * sizes[size]
            if abs(value) > REACH * reach:
                rest = f"is {value:g} m, but the section ends {reach:.4g} m from the axis; correct the place (in m)"
                yield Problem(place("gauges", name, key), rest)

    def described(self, name: str, structure: Structure, index: Index) -> Described:  # noqa: ARG002
        """What the core reads of a strain gauge."""
        at = min(self.at, structure.document.beams[self.beam].reach)
        return {"name": name, "beam": structure.beams.index(self.beam), "at": at, "x": self.x, "y": self.y}
