"""A machine in motion as plain shapes in the world, for whoever draws them: numbers alone, no drawing library.

Every shape has its places at every sample: of N samples, or of one where it never moves. All lengths are in m.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
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

        ``points``: shape (..., 3), m, in the world.
        Result: shape (..., 3), from -1 at the left and at the bottom to 1, and the distance before the eye (m).
        """
        seen = (points - self.eye) @ self.axes.T
        depth = np.maximum(-seen[..., 2], 1e-9)
        return np.stack([seen[..., 0] / (depth * self.slopes[0]), seen[..., 1] / (depth * self.slopes[1]), depth], -1)


@dataclass(frozen=True, eq=False)
class Shape:
    """Drawn shape of one component."""

    name: str  #: Of the component of the model.
    role: str  #: What it is, by which its colour and its word in the legend go; see `vpm.view.looks`.

    @property
    def points(self) -> Array:
        """Points of a scene's shape, (N or 1, K, 3)."""
        raise NotImplementedError

    def at(self, sample: int) -> Array:
        """Points of a scene's shape at a sample, (K, 3)."""
        points = self.points
        return np.asarray(points[min(sample, len(points) - 1)])


@dataclass(frozen=True, eq=False)
class Tube(Shape):
    """A round bar along a curve."""

    path: Array  #: Shape (N or 1, K, 3); its centreline.
    radius: Array  #: Shape (K,); at each point of it.

    @property
    def points(self) -> Array:
        """Centreline of a tube in the scene."""
        return self.path


@dataclass(frozen=True, eq=False)
class Sphere(Shape):
    """A sphere."""

    centre: Array  #: Shape (N or 1, 3).
    radius: float

    @property
    def points(self) -> Array:
        """Centre of a sphere in the scene."""
        return self.centre[:, None, :]


@dataclass(frozen=True, eq=False)
class Box(Shape):
    """A box."""

    centre: Array  #: Shape (N or 1, 3).
    axes: Array  #: Shape (N or 1, 3, 3); row i is the direction of side i in the world.
    size: Array  #: Shape (3,); lengths of its sides.

    @property
    def points(self) -> Array:
        """Centre of a box in the scene, and the middle of a face of each side."""
        faces = self.centre[:, None, :] + 0.5 * self.size[:, None] * self.axes
        return np.concatenate([self.centre[:, None, :], faces], axis=1)


@dataclass(frozen=True, eq=False)
class Arrow(Shape):
    """An arrow, such as a force in the scale of the scene."""

    #: Shape (N or 1, 3); where it begins, and where its head ends.
    start: Array
    end: Array
    radius: float  #: Of its shaft.

    @property
    def points(self) -> Array:
        """Start and end of an arrow in the scene."""
        return np.stack([self.start, self.end], axis=1)


@dataclass(frozen=True, eq=False)
class Scene:
    """Shapes of a machine in motion."""

    #: What is shown: the machine, and the run or log.
    title: str
    subtitle: str
    time: Array  #: Shape (N,); s.
    shapes: tuple[Shape, ...]
    up: Array  #: Shape (3,); unit vector against gravity.
    front: Array  #: Shape (3,); unit vector from the machine to who looks at it.
    scales: Mapping[str, str]  #: What lengths mean, by role: ``{"contact force": "0.1 m is 200 N"}``.
    grid: float  #: Width of a square of the floor (m); zero without a floor.
    notes: tuple[str, ...] = ()  #: What to know before the picture is trusted, one sentence each.

    def __getitem__(self, name: str) -> tuple[Shape, ...]:
        """Shapes of a component of the model in the scene."""
        return tuple(shape for shape in self.shapes if shape.name == name)

    @property
    def roles(self) -> tuple[str, ...]:
        """Roles of a scene's shapes, each once."""
        return tuple(dict.fromkeys(shape.role for shape in self.shapes))

    @cached_property
    def bounds(self) -> tuple[Array, float]:
        """Bounds of a scene: centre (3,) and radius (m) of a sphere about all but the floor."""
        clouds = [shape.points.reshape(-1, 3) for shape in self.shapes if shape.role not in {"floor", "plane"}]
        points = np.concatenate(clouds) if clouds else np.zeros((1, 3))
        centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
        return centre, max(float(np.max(np.linalg.norm(points - centre, axis=1))), 1e-3)

    def camera(self, aspect: float, *, room: float = 1.0) -> Camera:
        """First camera of a scene.

        - ``aspect``: width of the picture over its height
        - ``room``: share of the picture's height that the machine may fill, the rest being for words
        """
        centre, radius = self.bounds
        return Camera.about(centre, radius, self.front, self.up, aspect, room)

    def frames(self, most: int) -> Iterator[int]:
        """At most so many samples of a scene, evenly apart, the first one among them."""
        yield from range(0, self.time.size, max(1, -(-self.time.size // most)))
