"""The frame of a knee as an arch of uniform thickness: two legs, round corners, and a top that is loaded."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vpm.errors import VpmError
from vpm.numbers import Array
from vpm.studies.solid import Solid, brick, moved

if TYPE_CHECKING:
    from skfem import MeshHex2


@dataclass(frozen=True)
class Yoke:
    """Sizes of the frame, m: x to the side, y to the front, z up."""

    spacing: float = 0.060  #: Between the middles of the legs.
    height: float = 0.090  #: From the held ends to the middle of the top.
    corner: float = 0.010  #: Inner radius of the corners.
    #: Of the section: across the arch, and along y.
    thickness: float = 0.010
    width: float = 0.030
    pad: float = 0.020  #: Part of the top's length on which the adapter sits.

    def __post_init__(self) -> None:
        if min(self.corner, self.thickness, self.width, self.pad) <= 0.0 or self.top <= self.pad or self.leg <= 0.0:
            raise VpmError(
                f"a frame {1e3 * self.spacing:.3g} mm wide and {1e3 * self.height:.3g} mm high has no room for corners "
                f"of {1e3 * self.turn:.3g} mm and a pad of {1e3 * self.pad:.3g} mm; make it larger or the corners "
                "smaller"
            )

    @property
    def turn(self) -> float:
        """Radius of the yoke's middle line in the corners, m."""
        return self.corner + 0.5 * self.thickness

    @property
    def top(self) -> float:
        """Length of the yoke's straight top, m."""
        return self.spacing - 2.0 * self.turn

    @property
    def leg(self) -> float:
        """Length of a straight leg of the yoke, m."""
        return self.height - self.turn

    def with_(self, **changes: float) -> Yoke:
        """Copy of the yoke with other sizes."""
        return replace(self, **changes)

    def lengths(self) -> Array:
        """Ends of the yoke's pieces along half of the middle line: leg, corner, top to the pad, pad."""
        arc = 0.5 * np.pi * self.turn
        return np.cumsum([0.0, self.leg, arc, 0.5 * (self.top - self.pad), 0.5 * self.pad])

    def clear(self, places: Array) -> NDArray[np.bool_]:
        """Places of the yoke, shape (3, ...), one and a half thicknesses away from its ends and the pad."""
        ends, inner = self.lengths(), 0.5 * self.spacing - self.turn
        side, z = np.abs(places[0]), places[2]
        angle = np.clip(np.arctan2(z - self.leg, np.maximum(side - inner, 0.0)), 0.0, 0.5 * np.pi)
        way = np.minimum(z, self.leg) + self.turn * angle + np.maximum(0.0, inner - side)
        far = 1.5 * self.thickness
        return np.asarray((way > far) & (way < ends[3] - far))

    def bend(self, along: Array, across: Array, depth: Array) -> Array:
        """Places of yoke points by the way along the middle line, the way outwards from it, and y."""
        ends = self.lengths()
        half = ends[-1]
        side = np.where(along <= half, -1.0, 1.0)
        way = np.minimum(along, 2.0 * half - along)
        angle = np.clip((way - ends[1]) / self.turn, 0.0, 0.5 * np.pi)
        inner = 0.5 * self.spacing - self.turn
        x = inner + (self.turn + across) * np.cos(angle) - np.maximum(0.0, way - ends[2])
        z = np.minimum(way, self.leg) + (self.turn + across) * np.sin(angle)
        return np.stack([side * x, depth, z])

    def mesh(self, fineness: int) -> tuple[MeshHex2, Any, Any]:
        """Mesh of the yoke: bricks, held faces, and those under the pad.

        ``fineness``: bricks through the thickness.
        """
        ends, counts = self.lengths(), np.array([4, 4, 1, 2]) * fineness
        half = np.concatenate([np.linspace(a, b, n + 1)[:-1] for a, b, n in zip(ends, ends[1:], counts, strict=False)])
        along = np.concatenate([half, [ends[-1]], 2.0 * ends[-1] - half[::-1]])
        across = np.linspace(-0.5, 0.5, fineness + 1) * self.thickness
        depth = np.linspace(-0.5, 0.5, 2 * fineness + 1) * self.width
        flat = brick(along, across, depth)
        held = flat.facets_satisfying(
            lambda x: (np.abs(x[0]) < 1e-9) | (np.abs(x[0] - 2.0 * ends[-1]) < 1e-9), boundaries_only=True
        )
        pad = flat.facets_satisfying(
            lambda x: (np.abs(x[1] - 0.5 * self.thickness) < 1e-9) & (np.abs(x[0] - ends[-1]) < 0.5 * self.pad),
            boundaries_only=True,
        )
        return moved(flat, self.bend(*flat.doflocs)), held, pad

    def pressed(self, place: Array, side: float, front: float) -> Array:
        """Traction of 1 N on the yoke's pad whose line passes the point (side, front), Pa."""
        area = self.pad * self.width
        share = 1.0 / area + 12.0 * (side * place[0] / self.pad**2 + front * place[1] / self.width**2) / area
        return np.stack([0.0 * share, 0.0 * share, -share])


def frame(yoke: Yoke, fineness: int, young: float, poisson: float) -> tuple[Solid, Any, Any]:
    """A yoke as a solid, the displacements that are held, and the faces under the pad."""
    mesh, held, pad = yoke.mesh(fineness)
    solid = Solid(mesh, young, poisson)
    return solid, solid.basis.get_dofs(held).all(), pad
