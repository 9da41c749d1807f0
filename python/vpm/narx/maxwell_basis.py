"""Monomials of an element's maps, in variables that rounding does not spoil."""

from __future__ import annotations

from dataclasses import dataclass
from math import comb

import numpy as np

from vpm.narx.maxwell_recursion import POWERS, surface_columns
from vpm.numbers import Array

#: Coefficients of a polynomial of total degree d in two variables: the first so many of the ten.
COUNTS = (1, 3, 6, 10)
#: What remains of a term beside the terms before it, as a share, that counts as nothing.
COLLINEAR = 1e-7
#: Relative accuracy beyond which no estimate is trusted, so that exact data weigh alike.
EXACT = 1e-9


@dataclass(frozen=True)
class Basis:
    """Monomials of centred and scaled u and s, which rounding can tell apart where those of u and s cannot."""

    #: Of u and s.
    centre: tuple[float, float]
    scale: tuple[float, float]
    terms: tuple[int, ...]  #: Which of the ten are used.

    @classmethod
    def around(cls, drive: Array, length: Array) -> Basis:
        """Basis of all ten over the range of the samples."""
        ranges = [(float(x.min()), float(x.max())) for x in (drive, length)]
        (u0, u1), (s0, s1) = ranges
        centre = (0.5 * (u0 + u1), 0.5 * (s0 + s1))
        return cls(centre, (0.5 * (u1 - u0) or 1.0, 0.5 * (s1 - s0) or 1.0), tuple(range(10)))

    def columns(self, drive: Array, length: Array) -> Array:
        """Monomials of a coefficient map in drive and length, shape (N, terms)."""
        u, s = (drive - self.centre[0]) / self.scale[0], (length - self.centre[1]) / self.scale[1]
        return surface_columns(u, s)[:, list(self.terms)]

    def to_plain(self) -> Array:
        """Matrix that makes the ten coefficients over plain u and s of those over this basis, shape (10, terms)."""
        (cu, cs), (du, ds) = self.centre, self.scale
        matrix = np.zeros((10, 10))
        for column, (i, j) in enumerate(POWERS):
            for a in range(i + 1):
                for b in range(j + 1):
                    value = comb(i, a) * (-cu) ** (i - a) * comb(j, b) * (-cs) ** (j - b) / (du**i * ds**j)
                    matrix[POWERS.index((a, b)), column] += value
        return np.asarray(matrix[:, list(self.terms)])

    def from_plain(self, coefficients: Array) -> Array:
        """Coefficients over this basis of a polynomial that lies in it, shape (terms,)."""
        full = Basis(self.centre, self.scale, tuple(range(10))).to_plain()
        return np.asarray(np.linalg.solve(full, coefficients)[list(self.terms)])

    def independent(self, drive: Array, length: Array, weights: Array) -> tuple[Basis, tuple[int, ...]]:
        """The terms that samples can tell from those before them, and the others."""
        columns = weights[:, None] * self.columns(drive, length)
        kept: list[int] = []
        dropped: list[int] = []
        directions = np.zeros((drive.size, 0))
        for at, term in enumerate(self.terms):
            column = columns[:, at]
            rest = column - directions @ (directions.T @ column)
            rest -= directions @ (directions.T @ rest)
            if np.linalg.norm(rest) <= COLLINEAR * max(float(np.linalg.norm(column)), EXACT * float(weights.max())):
                dropped.append(term)
                continue
            kept.append(term)
            directions = np.column_stack([directions, rest / np.linalg.norm(rest)])
        return Basis(self.centre, self.scale, tuple(kept)), tuple(dropped)
