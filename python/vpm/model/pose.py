"""Places of frames: what they are fixed to, and constant transforms, composed before the core sees them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

_IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Pose:
    """Place of one frame in another one, ``X_AB``."""

    translation: tuple[float, ...] = (0.0, 0.0, 0.0)  #: Origin of B in A (m).
    #: Matrix that turns components in B into those in A, nine numbers row by row.
    rotation: tuple[float, ...] = _IDENTITY

    def __matmul__(self, other: Pose) -> Pose:
        """Composition of poses ``X_AC = X_AB X_BC``; exact where one of the two is the identity."""
        if self == Pose():
            return other
        if other == Pose():
            return self
        turn = np.reshape(self.rotation, (3, 3))
        moved = np.asarray(self.translation) + turn @ np.asarray(other.translation)
        turned = turn @ np.reshape(other.rotation, (3, 3))
        return Pose(tuple(moved.tolist()), tuple(turned.ravel().tolist()))

    def described(self) -> dict[str, Any]:
        """What the core reads of a pose."""
        return {"translation": list(self.translation), "rotation": list(self.rotation)}


@dataclass(frozen=True)
class Mount:
    """What of the core something is fixed to: the world, a body, or a section of a beam."""

    kind: Literal["world", "body", "section"] = "world"
    index: int = 0  #: Of the body or the beam, in the order of the core.
    at: float = 0.0  #: Arc length of the section (m).

    def described(self) -> str | dict[str, Any]:
        """Mount of a pose as the core reads it."""
        if self.kind == "world":
            return "world"
        return {"body": self.index} if self.kind == "body" else {"section": {"beam": self.index, "at": self.at}}


@dataclass(frozen=True)
class Frame:
    """A frame that is fixed to a mount, at a constant place."""

    mount: Mount
    pose: Pose

    def described(self) -> dict[str, Any]:
        """Frame with its pose on a mount, as the core reads it."""
        return {"on": self.mount.described(), **self.pose.described()}


def pose(translation: tuple[float, ...], angles: tuple[float, ...]) -> Pose:
    """Pose from a translation (m) and roll, pitch, yaw (rad)."""
    return Pose(translation, rotation_matrix(*angles))


def rotation_matrix(roll: float, pitch: float, yaw: float) -> tuple[float, ...]:
    """Rotation matrix of a pose, R = Rz(yaw) Ry(pitch) Rx(roll), nine numbers row by row.

    Turns about the fixed axes x, y, z in this order (J. Craig, "Introduction to Robotics", 3rd edition, equation 2.64).

    ``roll``, ``pitch``, ``yaw``: rad.
    """
    cr, sr, cp, sp, cy, sy = (f(angle) for angle in (roll, pitch, yaw) for f in (math.cos, math.sin))
    return (
        *(cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        *(sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        *(-sp, cp * sr, cp * cr),
    )
