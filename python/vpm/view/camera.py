"""A camera: where points of the world are in a picture."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

import numpy as np

from vpm.numbers import Array

#: Half the angle of view across the shorter side of a picture (rad): that of a lens of 70 mm before 24 mm of film.
HALF_ANGLE = math.atan(12.0 / 70.0)


@dataclass(frozen=True, eq=False)
class Camera:
    """A camera of a hole: what is twice as far away is half as large."""

    eye: Array  #: Shape (3,); where it stands (m).
    axes: Array  #: Shape (3, 3); rows: to the right of the picture, up in it, and from the picture to the eye.
    slopes: tuple[float, float]  #: Tangents of half the angles of view, across and up.

    @classmethod
    def about(cls, centre: Array, radius: float, front: Array, up: Array, aspect: float, room: float) -> Self:
        """The camera that has a sphere just in its picture, from the direction ``front``."""
        slope = math.tan(HALF_ANGLE)
        slopes = (slope * max(aspect, 1.0), slope * max(1.0 / aspect, 1.0))
        distance = max(radius / math.sin(math.atan(slopes[0])), radius / math.sin(math.atan(slopes[1] * room)))
        right = np.cross(up, front)
        right /= np.linalg.norm(right)
        return cls(centre + distance * front, np.array([right, np.cross(front, right), front]), slopes)

    def project(self, points: Array) -> Array:
        """Places of points in the picture of a camera.

        Parameters
        ----------
        points : ndarray, shape (..., 3)
            m, in the world.

        Returns
        -------
        ndarray, shape (..., 3)
            From -1 at the left and at the bottom to 1, and the distance before the eye (m).
        """
        seen = (points - self.eye) @ self.axes.T
        depth = np.maximum(-seen[..., 2], 1e-9)
        return np.stack([seen[..., 0] / (depth * self.slopes[0]), seen[..., 1] / (depth * self.slopes[1]), depth], -1)
