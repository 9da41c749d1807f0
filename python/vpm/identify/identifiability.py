"""Which combinations of parameters the data cannot see.

With the regressor's columns scaled to equal length, a small singular value is a direction in parameter space along
which the prediction hardly changes (G. Golub and C. Van Loan, *Matrix Computations*, 4th ed., 5.5; M. Gautier,
*J. Robotic Systems* 8, 1991 for its use on robots).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vpm.results import Storable

Array = NDArray[np.float64]

#: Relative singular value below which a direction counts as unseen.
RANK_TOLERANCE = 1e-6
#: A column is taken for a copy of others if they explain this share of it and its rest nothing much of the residual...
ALIAS_SHARE = 0.98
ALIAS_REST = 0.1
#: ... or if they explain this share of it.
COPY_SHARE = 0.9999


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
        """One sentence."""
        if len(self.names) == 1:
            return f"{self.names[0]} has no effect on these data"
        terms = ", ".join(f"{name} {weight:+.3g}" for name, weight in zip(self.names, self.weights, strict=True))
        return f"changing {terms} together leaves the prediction as it is"


def column_lengths(jacobian: Array) -> Array:
    """Euclidean length of each column; 1 for a column of zeros."""
    lengths: Array = np.linalg.norm(jacobian, axis=0)
    return np.where(lengths > 0.0, lengths, 1.0)


def unseen_combinations(
    jacobian: Array, names: Sequence[str], tolerance: float = RANK_TOLERANCE
) -> tuple[Combination, ...]:
    """Directions of the parameter space whose relative singular value is below ``tolerance``.

    Parameters
    ----------
    jacobian : ndarray, shape (n, p)
    names : sequence of str
        One for each column.
    tolerance : float
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


def explained_share(column: Array, others: Array) -> float:
    """Share of the squared length of ``column`` that lies in the span of ``others``, 0 to 1."""
    power = float(column @ column)
    if power == 0.0:
        return 1.0
    if others.shape[1] == 0:
        return 0.0
    scaled = others / column_lengths(others)
    rest = column - scaled @ np.linalg.lstsq(scaled, column, rcond=1e-10)[0]
    return 1.0 - float(rest @ rest) / power


def is_alias(column: Array, others: Array, residual: Array) -> bool:
    """Whether the data show ``column`` only together with ``others``.

    A constant load and a weight that hardly turns are nearly the same column; what differs may still be just what the
    residual asks for, and then they are two effects.

    Parameters
    ----------
    column : ndarray, shape (n,)
    others : ndarray, shape (n, k)
    residual : ndarray, shape (n,)
        What is left to explain.
    """
    share = explained_share(column, others)
    if share <= ALIAS_SHARE or others.shape[1] == 0:
        return False
    if share > COPY_SHARE:
        return True
    scaled = others / column_lengths(others)
    left = residual - scaled @ np.linalg.lstsq(scaled, residual, rcond=1e-10)[0]
    rest = column - scaled @ np.linalg.lstsq(scaled, column, rcond=1e-10)[0]
    return explained_share(left, rest[:, None]) < ALIAS_REST


def closest_column(column: Array, others: Array) -> int:
    """Index of the column of ``others`` that is most nearly parallel to ``column``."""
    cosine = np.abs(column @ (others / column_lengths(others)))
    return int(np.argmax(cosine))


def _combination(direction: Array, lengths: Array, names: Sequence[str], value: float) -> Combination:
    """Who takes part is judged on the scaled columns, which know no units; the weights are in the parameters' units."""
    share = np.abs(direction) / np.max(np.abs(direction))
    order = [int(i) for i in np.argsort(-share) if share[i] > 1e-3]
    weights = direction / lengths
    first = weights[order[0]]
    return Combination(tuple(names[i] for i in order), tuple(float(weights[i] / first) for i in order), value)
