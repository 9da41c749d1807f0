"""Places of frames: rotation matrices and constant transforms, composed before the core sees them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from vpm.model.schema import DenavitHartenberg

_IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Pose:
    """Place of one frame in another one, ``X_AB``.

    Attributes
    ----------
    translation : tuple of float
        Origin of B in A (m).
    rotation : tuple of float
        Matrix that turns components in B into those in A, nine numbers row by row.
    """

    translation: tuple[float, ...] = (0.0, 0.0, 0.0)
    rotation: tuple[float, ...] = _IDENTITY

    def __matmul__(self, other: Pose) -> Pose:
        """Composition ``X_AC = X_AB X_BC``; exact where one of the two is the identity."""
        if self == Pose():
            return other
        if other == Pose():
            return self
        turn = np.reshape(self.rotation, (3, 3))
        moved = np.asarray(self.translation) + turn @ np.asarray(other.translation)
        turned = turn @ np.reshape(other.rotation, (3, 3))
        return Pose(tuple(moved.tolist()), tuple(turned.ravel().tolist()))


def pose(translation: tuple[float, ...], angles: tuple[float, ...]) -> Pose:
    """Place from a translation (m) and roll, pitch, yaw (rad)."""
    return Pose(translation, rotation_matrix(*angles))


def rotation_matrix(roll: float, pitch: float, yaw: float) -> tuple[float, ...]:
    """Rotation matrix R = Rz(yaw) Ry(pitch) Rx(roll), nine numbers row by row.

    Turns about the fixed axes x, y, z in this order (J. Craig, "Introduction to Robotics", 3rd edition, equation 2.64).

    Parameters
    ----------
    roll, pitch, yaw : float
        rad.
    """
    cr, sr, cp, sp, cy, sy = (f(angle) for angle in (roll, pitch, yaw) for f in (math.cos, math.sin))
    return (
        *(cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        *(sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        *(-sp, cp * sr, cp * cr),
    )


def denavit_hartenberg(link: DenavitHartenberg) -> tuple[Pose, Pose]:
    """Constant transforms before and after the joint, whose axis is z of the frame between them.

    Standard: ``Rot_z(theta + q) Trans_z(d) Rot_x(alpha) Trans_x(a)``, the joint comes first
    (J. Denavit and R. Hartenberg, *Journal of Applied Mechanics* 22, 1955; B. Siciliano et al., "Robotics", 2009,
    equation 2.52). Modified: ``Rot_x(alpha) Trans_x(a) Rot_z(theta + q) Trans_z(d)``, the joint comes last (J. Craig,
    "Introduction to Robotics", 3rd edition, equation 3.6).

    Returns
    -------
    before, after : Pose
    """
    along_x = Pose((link.a, 0.0, 0.0), rotation_matrix(link.alpha, 0.0, 0.0))
    along_z = Pose((0.0, 0.0, link.d), rotation_matrix(0.0, 0.0, link.theta))
    if link.convention == "standard":
        return Pose(), along_z @ along_x
    return along_x @ along_z, Pose()
