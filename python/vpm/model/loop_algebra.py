"""Linear algebra of closed loops, whose equations may be redundant."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: A closed loop has no larger gap (m, or the cosine of an angle that has to be a right one).
CLOSED = 1e-12
#: What is below this share is rounding: the square root of that of numbers.
NOTHING = 1e-8


def least(matrix: Array, right: Array) -> Array:
    """Smallest solution of least squares; what rounding alone decides is left out."""
    return np.asarray(np.linalg.lstsq(matrix, right, rcond=NOTHING)[0])


def null_space(jacobian: Array) -> Array:
    """Orthonormal columns of the motions that loops with this derivative allow."""
    _, sizes, rows = np.linalg.svd(jacobian)
    rank = int((sizes > NOTHING * float(sizes.max(initial=0.0))).sum())
    return np.asarray(rows[rank:].T)


def pivots(matrix: Array, rank: int, tiers: Sequence[Sequence[int]]) -> set[int]:
    """Columns on which all others depend, as many as the rank: pivots of an elimination, tier after tier of columns."""
    left, sizes = matrix.copy(), np.linalg.norm(matrix, axis=0)
    found: set[int] = set()
    for tier in tiers:
        open_ones = list(tier)
        while open_ones and len(found) < rank:
            norms = np.linalg.norm(left[:, open_ones], axis=0)
            place = open_ones[int(np.argmax(norms))]
            if norms.max() <= NOTHING * max(sizes[place], 1.0):
                break
            way = left[:, place] / np.linalg.norm(left[:, place])
            left -= np.outer(way, way @ left)
            found.add(place)
            open_ones.remove(place)
    return found
