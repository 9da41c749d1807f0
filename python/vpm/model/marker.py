"""Markers: frames to watch."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

from vpm.model.component import Component, Described, Index
from vpm.model.entry import ORIGIN, Number, Text, Vector
from vpm.model.pose import pose

if TYPE_CHECKING:
    from vpm.model.structure import Structure


class Marker(Component):
    """Frame of a model whose motion is watched."""

    CHANNELS: ClassVar[Mapping[str, str]] = {
        **dict.fromkeys(("x", "y", "z"), "m"),
        **dict.fromkeys(("rx", "ry", "rz"), "rad"),
    }

    parent: Text
    at: Number | None = None
    translation: Vector = ORIGIN
    rotation: Vector = ORIGIN

    def described(self, name: str, structure: Structure, index: Index) -> Described:  # noqa: ARG002
        """What the core reads of a marker."""
        frame = structure.mounted(self.parent, self.at, pose(self.translation, self.rotation))
        return {"name": name, **frame.described()}
