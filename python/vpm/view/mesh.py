"""Shapes as triangles, for drawers that know nothing else."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from vpm.numbers import Array
from vpm.view.scene import Arrow, Box, Shape, Sphere, Tube

Whole = NDArray[np.int64]

#: Corners around a tube, and rows of a sphere.
SIDES, ROWS = 14, 9


def mesh_of(shapes: Sequence[Shape], sample: int) -> tuple[Array, Whole]:
    """Mesh of some shapes at a sample, in triangles.

    - result ``corners``: shape (C, 3), m, in the world
    - result ``faces``: shape (F, 3), numbers of the corners of each triangle, counter-clockwise seen from outside
    """
    corners: list[Array] = [np.zeros((0, 3))]
    faces: list[Whole] = [np.zeros((0, 3), dtype=np.int64)]
    count = 0
    for shape in shapes:
        for points, triangles in _parts(shape, shape.at(sample)):
            corners.append(points)
            faces.append(triangles + count)
            count += len(points)
    return np.concatenate(corners), np.concatenate(faces)


def _parts(shape: Shape, points: Array) -> Iterator[tuple[Array, Whole]]:
    match shape:
        case Tube():
            yield tube(points, shape.radius, 4 if shape.role in {"floor", "plane"} else SIDES)
        case Sphere():
            yield sphere(points[0], shape.radius)
        case Box():
            yield box(points)
        case Arrow():
            yield from arrow(points[0], points[1], shape.radius)


def tube(path: Array, radius: Array, sides: int = SIDES) -> tuple[Array, Whole]:
    """Mesh of a tube about a path (K, 3), closed at both ends, without twist."""
    tangents = np.gradient(path, axis=0)
    tangents /= np.maximum(np.linalg.norm(tangents, axis=1, keepdims=True), 1e-12)
    angles = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False)[:, None]
    first = np.cross(tangents[0], np.eye(3)[int(np.argmin(np.abs(tangents[0])))])
    rings = []
    for place, tangent, reach in zip(path, tangents, radius, strict=True):
        first = first - (first @ tangent) * tangent
        first /= max(float(np.linalg.norm(first)), 1e-12)
        rings.append(place + reach * (np.cos(angles) * first + np.sin(angles) * np.cross(tangent, first)))
    k = np.arange(sides)
    after = (k + 1) % sides
    faces = [
        np.column_stack(way) + sides * i
        for i in range(len(path) - 1)
        for way in ((k, after, k + sides), (after, after + sides, k + sides))
    ]
    last, ends = sides * (len(path) - 1), sides * len(path)
    faces += [np.column_stack([np.full(sides, ends), after, k])]
    faces += [np.column_stack([np.full(sides, ends + 1), last + k, last + after])]
    return np.concatenate([*rings, path[[0, -1]]]), np.concatenate(faces)


def sphere(centre: Array, radius: float) -> tuple[Array, Whole]:
    """Mesh of a sphere in rows and columns."""
    down, around = np.meshgrid(np.linspace(0, np.pi, ROWS + 1), np.linspace(0, 2 * np.pi, 2 * ROWS + 1), indexing="ij")
    unit = np.stack([np.sin(down) * np.cos(around), np.sin(down) * np.sin(around), np.cos(down)], axis=-1)
    number = np.arange(unit[..., 0].size).reshape(down.shape)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[:-1, 1:], number[1:, 1:]
    faces = np.concatenate([np.stack(way, -1).reshape(-1, 3) for way in ((a, b, c), (b, d, c))])
    return centre + radius * unit.reshape(-1, 3), faces


def box(points: Array) -> tuple[Array, Whole]:
    """Mesh of a box by its centre and the middle of a face of each side (4, 3)."""
    sides = points[1:] - points[0]
    if np.linalg.det(sides) < 0.0:
        sides = -sides
    corners: list[Array] = []
    faces: list[tuple[int, int, int]] = []
    for i in range(3):
        for sign in (1.0, -1.0):
            middle, u, v = points[0] + sign * sides[i], sides[(i + 1) % 3], sign * sides[(i + 2) % 3]
            start = 4 * len(corners)
            corners.append(np.array([middle - u - v, middle + u - v, middle + u + v, middle - u + v]))
            faces += [(start, start + 1, start + 2), (start, start + 2, start + 3)]
    return np.concatenate(corners), np.array(faces)


def arrow(start: Array, end: Array, radius: float) -> Iterator[tuple[Array, Whole]]:
    """Mesh of an arrow, shaft and head; nothing of one that is shorter than thin."""
    length = float(np.linalg.norm(end - start))
    if length < 1e-3 * radius:
        return
    thick = min(radius, 0.25 * length)
    neck = end - min(6.0 * radius, 0.6 * length) * (end - start) / length
    yield tube(np.array([start, neck]), np.full(2, thick))
    yield tube(np.array([neck, end]), np.array([2.6 * thick, 0.0]))
