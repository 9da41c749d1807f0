"""Bounded nonlinear least squares: Levenberg-Marquardt on the coordinates that no bound holds.

K. Levenberg, *Quarterly of Applied Mathematics* 2, 1944; D. Marquardt, *SIAM Journal* 11, 1963; the damped step is
clipped to the box, and a coordinate on a bound takes no part while the descent points outwards (D. Bertsekas, *SIAM J.
Control and Optimization* 20, 1982).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import lsq_linear

from vpm.numbers import Array

#: Damping at the start, and beyond which no step is left to try.
DAMPING, MOST_DAMPING = 1e-3, 1e12
#: Least size of a coordinate, as a share of the move that would explain the whole residual.
LEAST_SIZE = 1e-3
#: Columns from which on normal equations take the place of orthogonal triangles.
MANY = 24


@dataclass(frozen=True)
class Point:
    """Coordinates of a fit with cost, residual and derivatives there."""

    x: Array  #: Shape (n,).
    cost: float  #: Sum of losses.
    #: With the weights of noise and loss in them, so that ``jacobian' residual`` is half the gradient of the cost.
    residual: Array
    jacobian: Array
    raw: tuple[Array, Array]  #: Residual and derivative by the coordinates before weighting.


@dataclass(frozen=True)
class Descent:
    """Outcome of a least-squares descent: its last point, the first one's cost, and why it ended."""

    point: Point
    first_cost: float
    evaluations: int
    ended: str

    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C ended the solver's descent."""
        return self.ended == "interrupted"


@dataclass(frozen=True)
class Box:
    """Bounds, scales and largest steps of the coordinates of a descent."""

    #: Shape (n,).
    low: Array
    high: Array
    scale: Array  #: Shape (n,); size of each coordinate, that a change is compared with.
    reach: Array | float = np.inf  #: Shape (n,), or float; largest change of each in one step.
    damping: Array | float = 1.0  #: Shape (n,), or float; damping of each beside others, of columns of length one.


def descend(
    evaluate: Callable[[Array], Point],
    start: Point,
    box: Box,
    *,
    tolerance: float,
    most_evaluations: int,
    cost: Callable[[Array], float] | None = None,
) -> Descent:
    """Solver: least sum of losses inside a box.

    - ``evaluate``: the point at coordinates (n,); its cost is infinite where there is none
    - ``tolerance``: relative change of the coordinates or of the cost at which to stop
    - ``cost``: the cost alone, where that takes less time than a point: points are then evaluated where it falls
    """
    at, count, damping, ended = start, 0, DAMPING, "evaluations"
    try:
        while count < most_evaluations:
            found = _step(at, box, damping)
            if found is None:
                ended = "converged"
                break
            step, predicted = found
            trial = _tried(evaluate, at, at.x + step, cost)
            count += 1
            actual = at.cost - trial.cost
            small = bool(np.all(np.abs(step) <= tolerance * box.scale)) or predicted <= tolerance**1.5 * at.cost
            if actual > 0.0:
                flat = actual <= tolerance * at.cost and predicted <= 10.0 * tolerance * at.cost
                at = trial
                quality = actual / predicted
                damping = max(1e-14, damping * (0.1 if quality > 0.75 else 0.5 if quality > 0.25 else 2.0))
                small = small or flat
            else:
                damping *= 8.0
            if small or damping > MOST_DAMPING:
                ended = "converged"
                break
    except KeyboardInterrupt:
        ended = "interrupted"
    return Descent(at, start.cost, count, ended)


def sizes(x: Array, cost: float, lengths: Array) -> Array:
    """Sizes of a descent's coordinates (n,), that changes are compared with, from values and lengths of columns."""
    return np.asarray(np.maximum(np.abs(x), LEAST_SIZE * np.sqrt(cost) / lengths))


def _tried(evaluate: Callable[[Array], Point], at: Point, x: Array, cost: Callable[[Array], float] | None) -> Point:
    """Point of the solver at a step from ``at``; without derivatives where the cost does not fall."""
    if cost is None or (reached := cost(x)) < at.cost:
        return evaluate(x)
    return replace(at, x=x, cost=reached)


def _step(at: Point, box: Box, damping: float) -> tuple[Array, float] | None:
    """Damped step of the solver inside the box and its predicted fall of cost; None at a minimum."""
    low, high, reach = box.low, box.high, np.broadcast_to(box.reach, at.x.shape)
    gradient = at.jacobian.T @ at.residual
    held = (low >= high) | ((at.x <= low) & (gradient > 0.0)) | ((at.x >= high) & (gradient < 0.0))
    lengths = np.linalg.norm(at.jacobian, axis=0)
    free = np.flatnonzero(~held & (lengths > 0.0))
    if free.size == 0:
        return None
    square, image = _root(at.jacobian[:, free] / lengths[free], at.residual)
    own = np.broadcast_to(box.damping, at.x.shape)[free]
    damped = np.vstack([square, np.diag(np.sqrt(damping * own))])
    target = np.concatenate([-image, np.zeros(free.size)])
    below, above = ((edge - at.x)[free] * lengths[free] for edge in (low, high))
    change = _boxed(damped, target, below, above)
    change /= max(1.0, float(np.max(np.abs(change) / (lengths[free] * reach[free]))))
    step = np.zeros_like(at.x)
    step[free] = change / lengths[free]
    step = np.clip(at.x + step, low, high) - at.x
    change = square @ (step[free] * lengths[free])
    predicted = -float(2.0 * gradient @ step + change @ change)
    return (step, predicted) if predicted > 1e-15 * at.cost and np.any(step) else None


def _boxed(matrix: Array, target: Array, low: Array, high: Array) -> Array:
    """Least-squares solution of the solver in a box (P. Stark and R. Parker, *Computational Statistics* 10, 1995)."""
    solution = np.linalg.lstsq(matrix, target, rcond=None)[0]
    if np.all((low <= solution) & (solution <= high)):
        return np.asarray(solution)
    return np.asarray(lsq_linear(matrix, target, (low, high), method="bvls").x)


def _root(jacobian: Array, residual: Array) -> tuple[Array, Array]:
    """Square root ``R`` for the solver with ``R'R = J'J``, and ``q`` with ``R'q = J'r``.

    By orthogonal triangles, which keep all digits; of many columns, whose triangles cost too much, by eigenvectors.
    """
    if jacobian.shape[1] <= MANY:
        orthogonal, square = np.linalg.qr(jacobian)
        return square, orthogonal.T @ residual
    values, vectors = np.linalg.eigh(jacobian.T @ jacobian)
    seen = values > 1e-13 * values[-1]
    roots = np.sqrt(values[seen])
    square = np.zeros((jacobian.shape[1], jacobian.shape[1]))
    image = np.zeros(jacobian.shape[1])
    square[: roots.size] = roots[:, None] * vectors[:, seen].T
    image[: roots.size] = (vectors[:, seen].T @ (jacobian.T @ residual)) / roots
    return square, image
