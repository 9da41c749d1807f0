"""Load cells: readings of the reaction wrench at a joint."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, ClassVar

from vpm.errors import near_match
from vpm.model.bushing import WRENCH
from vpm.model.component import Component, Described, Index
from vpm.model.entry import Text
from vpm.model.messages import Problem, place

if TYPE_CHECKING:
    from vpm.model.structure import Structure


class LoadCell(Component):
    """Reading of the reaction wrench at a joint."""

    CHANNELS: ClassVar[Mapping[str, str]] = WRENCH

    joint: Text

    def problems(self, name: str, structure: Structure) -> Iterator[Problem]:
        """Problem of a load cell whose joint is not there, or makes one piece of its bodies."""
        where, joints = place("load_cells", name, "joint"), structure.document.joints
        if self.joint in joints and joints[self.joint].type == "fixed":
            rest = (
                f'is "{self.joint}", a fixed joint, which makes one piece of its bodies; take a bushing that is stiff, '
            )
            yield Problem(where, f"{rest}or the load cell of the joint before it")
        elif self.joint not in (*joints, *structure.joints):
            repair = near_match(self.joint, joints, what="it has")
            yield Problem(where, f'is "{self.joint}", which is no joint of the model; {repair}')

    def described(self, name: str, structure: Structure, index: Index) -> Described:  # noqa: ARG002
        """What the core reads of a load cell; at a joint of several coordinates the last one carries the child."""
        if self.joint in structure.joints:
            return {"name": name, "joint": structure.joints.index(self.joint)}
        return {"name": name, "joint": max(k for k, axis in enumerate(structure.axes) if axis.joint == self.joint)}
