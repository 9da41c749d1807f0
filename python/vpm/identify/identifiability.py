"""Which combinations of parameters the data cannot see, and base parameters, which they can.

With the regressor's columns scaled to equal length, a small singular value is a direction in parameter space along
which the prediction hardly changes (G. Golub and C. Van Loan, *Matrix Computations*, 4th ed., 5.5). A column that is a
sum of others adds nothing to a prediction, so that its parameter is seen only in sums with theirs (M. Gautier,
"Numerical calculation of the base inertial parameters of robots", *J. Robotic Systems* 8, 1991; W. Khalil and E.
Dombre, *Modeling, Identification and Control of Robots*, 2002, appendix 5).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import qr, solve_triangular

from vpm.model import Model
from vpm.numbers import Array
from vpm.results import Storable

#: Relative singular value below which a direction counts as unseen.
RANK_TOLERANCE = 1e-6
#: A column is taken for a copy of others if they explain this share of it and its rest nothing much of the residual...
ALIAS_SHARE = 0.98
ALIAS_REST = 0.1
#: ... or if they explain this share of it.
COPY_SHARE = 0.9999
#: Weight below which a dependent parameter is no part of a combination, on columns of equal length.
SMALLEST_WEIGHT = 1e-6
#: Length of a column, or of what a parameter does, relative to the longest, that is nothing but rounding.
NOTHING = 1e-13
#: Length of what is new in columns of unit length, below which it is rounding.
NEW_DIRECTION = 1e-10
#: Share of a column that those before it must leave, so that it is kept by preference.
LEAST_REST = 1e-4


@dataclass(frozen=True, repr=False, eq=False)
class Combination(Storable):
    """A direction in parameter space that leaves the prediction as it is.

    Attributes
    ----------
    names : tuple of str
        Parameters that take part, the strongest first.
    weights : tuple of float
        Change of each, in units of its own parameter, for a change of the first by one.
    singular_value : float
        Relative to the largest one of the scaled regressor.
    """

    names: tuple[str, ...]
    weights: tuple[float, ...]
    singular_value: float

    def __str__(self) -> str:
        """Sentence on an unidentifiable combination."""
        if len(self.names) == 1:
            return f"{self.names[0]} has no effect on these data"
        terms = ", ".join(f"{name} {weight:+.3g}" for name, weight in zip(self.names, self.weights, strict=True))
        return f"changing {terms} together leaves the prediction as it is"


def column_lengths(jacobian: Array) -> Array:
    """Euclidean length of each column, for identifiability; 1 for a column of zeros."""
    lengths: Array = np.linalg.norm(jacobian, axis=0)
    return np.where(lengths > 0.0, lengths, 1.0)


def above_rounding(jacobian: Array, model: Model, columns: Sequence[int]) -> Array:
    """Jacobian (n, p) with zeros where a parameter does nothing but for what rounding leaves of it.

    Columns are judged by what changes as large as the parameters, or as their uncertainties, do. A moment of inertia
    about an axis that no drive turns shows to the last digit of the other forces, and would be taken for seen. Of a
    parameter of which nothing is known the value tells the size: a leakage of 1 m^3/(s Pa) would dwarf all others.
    """
    known = [model.parameters[model.parameter_names[column]] for column in columns]
    stated = [one.uncertainty if one.uncertainty and np.isfinite(one.uncertainty) else 0.0 for one in known]
    sizes = np.array([max(abs(one.value), std) for one, std in zip(known, stated, strict=True)])
    done = np.linalg.norm(jacobian, axis=0) * sizes
    nothing = (sizes > 0.0) & (done < NOTHING * np.max(done, initial=0.0, where=np.isfinite(done)))
    return np.where(nothing, 0.0, jacobian)


def least_step(jacobian: Array, residual: Array, tolerance: float = 1e-10) -> Array:
    """Step of least squares (p,) along what is identifiable: relative singular values above ``tolerance``.

    ``jacobian``: shape (n, p); ``residual``: shape (n,).
    """
    if not jacobian.shape[1]:
        return np.zeros(0)
    lengths = column_lengths(jacobian)
    return np.asarray(np.linalg.lstsq(jacobian / lengths, -residual, rcond=tolerance)[0] / lengths)


def unseen_combinations(
    jacobian: Array, names: Sequence[str], tolerance: float = RANK_TOLERANCE
) -> tuple[Combination, ...]:
    """Unidentifiable directions of the parameters: relative singular values below ``tolerance``.

    ``jacobian``: shape (n, p); ``names``: one for each column.
    """
    if jacobian.shape[1] == 0:
        return ()
    lengths = column_lengths(jacobian)
    _, values, directions = np.linalg.svd(np.linalg.qr(jacobian / lengths, mode="r"))
    largest = values[0] if values[0] > 0.0 else 1.0
    # A column of zeros has no length to be scaled by, so its singular value is exactly zero: caught like the rest.
    return tuple(
        _combination(direction, lengths, names, float(value / largest))
        for value, direction in zip(values, directions, strict=True)
        if value / largest < tolerance
    )


@dataclass(frozen=True, eq=False)
class Span:
    """Span of some columns, for identifiability: others are split into what lies in it and what is left.

    Known columns are taken out of new ones once, and steps in these alone give the same estimates as steps in all
    (R. Frisch and F. Waugh, *Econometrica* 1, 1933; M. Lovell, *J. American Statistical Association* 58, 1963).
    """

    basis: Array  #: Orthonormal; shape (n, r).

    @classmethod
    def of(cls, columns: Array) -> Span:
        """Span of columns (n, k), those of zeros and copies among them."""
        return cls(np.zeros((len(columns), 0))).beside(columns)

    def beside(self, columns: Array) -> Span:
        """Span of more columns (n, k) together with these."""
        rest = self.rest(self.rest(columns / column_lengths(columns)))  # twice, for what rounding leaves
        vectors, values, _ = np.linalg.svd(rest, full_matrices=False)
        return Span(np.column_stack([self.basis, vectors[:, values > NEW_DIRECTION]]))

    def rest(self, columns: Array) -> Array:
        """Part of columns (n,) or (n, k) outside of a span, for identifiability."""
        return np.asarray(columns - self.basis @ (self.basis.T @ columns))

    def share(self, column: Array) -> float:
        """Share of a column's squared length within a span, 0 to 1, for identifiability."""
        power, rest = float(column @ column), self.rest(column)
        return 1.0 - float(rest @ rest) / power if power > 0.0 else 1.0


def is_alias(column: Array, others: Span, residual: Array) -> bool:
    """Whether ``column`` is identifiable only together with ``others``.

    A constant load and a weight that hardly turns are nearly the same column; what differs may still be just what the
    residual asks for, and then they are two effects.

    ``column``: shape (n,); ``residual``: shape (n,), what is left to explain.
    """
    share = others.share(column)
    if share <= ALIAS_SHARE or others.basis.shape[1] == 0:
        return False
    if share > COPY_SHARE:
        return True
    return Span.of(others.rest(column)[:, None]).share(others.rest(residual)) < ALIAS_REST


def closest_column(column: Array, others: Array) -> int:
    """Index of the column of ``others`` most nearly parallel to ``column``, for identifiability."""
    cosine = np.abs(column @ (others / column_lengths(others)))
    return int(np.argmax(cosine))


def _combination(direction: Array, lengths: Array, names: Sequence[str], value: float) -> Combination:
    """Unidentifiable combination of parameters along a direction (n,), in the parameters' units."""
    share = np.abs(direction) / np.max(np.abs(direction))
    order = [int(i) for i in np.argsort(-share) if share[i] > 1e-3]
    weights = direction / lengths
    first = weights[order[0]]
    return Combination(tuple(names[i] for i in order), tuple(float(weights[i] / first) for i in order), value)


@dataclass(frozen=True, eq=False)
class Base:
    """Independent columns of a regressor."""

    #: Columns that are independent, that hang on those, and that are zero.
    kept: tuple[int, ...]
    dropped: tuple[int, ...]
    unseen: tuple[int, ...]
    #: Shape (kept, dropped); in parameter units: what is seen in place of parameter i is ``p_i + sum_j weights_ij
    #: p_j``.
    weights: Array
    #: Shape (columns - unseen,); of the columns scaled to equal length, relative to the largest.
    singular_values: Array

    @property
    def rank(self) -> int:
        """Number of identifiable base parameters."""
        return len(self.kept)

    @property
    def condition(self) -> float:
        """Condition number of the identifiable directions, columns of equal length."""
        return float(1.0 / self.singular_values[self.rank - 1])

    @property
    def map(self) -> Array:
        """Matrix (rank, parameters) from parameters to identifiable base parameters."""
        matrix = np.zeros((self.rank, self.rank + len(self.dropped) + len(self.unseen)))
        matrix[np.arange(self.rank), list(self.kept)] = 1.0
        matrix[:, list(self.dropped)] = self.weights
        return matrix

    def words(self, names: Sequence[str]) -> tuple[str, ...]:
        """Text of each identifiable base parameter: ``m1 +0.31 m2``."""
        sentences = []
        for row, place in enumerate(self.kept):
            terms = [
                f"{weight:+.4g} {names[other]}"
                for weight, other in zip(self.weights[row], self.dropped, strict=True)
                if weight != 0.0
            ]
            sentences.append(" ".join([names[place], *terms]))
        return tuple(sentences)


def find_base(columns: Array, *, tolerance: float = RANK_TOLERANCE, prefer: Sequence[int] = ()) -> Base:
    """Identifiable base of a regressor: rank by singular values, independent columns by QR factorisation.

    - ``columns``: shape (n, p)
    - ``tolerance``: relative singular value, with columns of equal length, below which a direction counts as none
    - ``prefer``: columns to be kept where there is a choice, the first of them first; without it those that are least
      like each other (QR with column pivoting: G. Golub and C. Van Loan, *Matrix Computations*, 4th ed., 5.4).
    """
    lengths = column_lengths(columns)
    norms = np.linalg.norm(columns, axis=0)
    seen = np.flatnonzero(norms > NOTHING * norms.max(initial=0.0))
    unseen = tuple(sorted(set(range(columns.shape[1])) - set(seen.tolist())))
    if not seen.size:
        return Base((), (), unseen, np.zeros((0, 0)), np.zeros(0))
    triangle = np.asarray(np.linalg.qr(columns[:, seen] / lengths[seen], mode="r"))
    singular = np.linalg.svd(triangle, compute_uv=False)
    rank = int(np.sum(singular > tolerance * singular[0]))
    order = _preferred(triangle, [int(np.flatnonzero(seen == k)[0]) for k in prefer if k in seen], rank)
    upper = np.asarray(np.linalg.qr(triangle[:, order], mode="r"))
    weights = solve_triangular(upper[:rank, :rank], upper[:rank, rank:])
    weights[np.abs(weights) <= SMALLEST_WEIGHT] = 0.0
    places = seen[order]
    weights *= lengths[places[rank:]] / lengths[places[:rank], None]
    kept, dropped = np.argsort(places[:rank]), np.argsort(places[rank:])
    return Base(
        tuple(places[:rank][kept].tolist()),
        tuple(places[rank:][dropped].tolist()),
        unseen,
        weights[np.ix_(kept, dropped)],
        singular / singular[0],
    )


def _preferred(triangle: Array, prefer: Sequence[int], rank: int) -> list[int]:
    """Order of columns for the identifiable base: preferred ones first, then by pivoting."""
    chosen: list[int] = []
    span = np.zeros((len(triangle), 0))
    for column in prefer:
        rest = triangle[:, column] - span @ (span.T @ triangle[:, column])
        rest -= span @ (span.T @ rest)
        if np.linalg.norm(rest) > LEAST_REST and len(chosen) < rank:
            span = np.column_stack([span, rest / np.linalg.norm(rest)])
            chosen.append(column)
    others = [k for k in range(triangle.shape[1]) if k not in chosen]
    rest = triangle[:, others] - span @ (span.T @ triangle[:, others])
    pivots: Sequence[int] = qr(rest, mode="r", pivoting=True)[1].tolist() if others else []
    return [*chosen, *(others[k] for k in pivots)]
