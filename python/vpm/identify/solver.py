"""Bounded nonlinear least squares: Levenberg-Marquardt on the coordinates that no bound holds.

K. Levenberg, *Quarterly of Applied Mathematics* 2, 1944; D. Marquardt, *SIAM Journal* 11, 1963; the damped step is
clipped to the box, and a coordinate on a bound takes no part while the descent points outwards (D. Bertsekas, *SIAM J.
Control and Optimization* 20, 1982).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from vpm.numbers import Array

#: Damping at the start, and beyond which no step is left to try.
DAMPING, MOST_DAMPING = 1e-3, 1e12
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


def descend(
    evaluate: Callable[[Array], Point],
    start: Point,
    box: Box,
    *,
    tolerance: float,
    most_evaluations: int,
) -> Descent:
    """Solver: least sum of losses inside a box.

    Parameters
    ----------
    evaluate : callable
        The point at coordinates (n,); its cost is infinite where there is none.
    start : Point
        Inside the box.
    box : Box
    tolerance : float
        Relative change of the coordinates or of the cost at which to stop.
    most_evaluations : int
    """
    at, count, damping, ended = start, 0, DAMPING, "evaluations"
    try:
        while count < most_evaluations:
            found = _step(at, box, damping)
            if found is None:
                ended = "converged"
                break
            step, predicted = found
            trial = evaluate(at.x + step)
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


def _step(at: Point, box: Box, damping: float) -> tuple[Array, float] | None:
    """Damped step of the solver inside the box and its predicted fall of cost; None at a minimum."""
    low, high, reach = box.low, box.high, np.broadcast_to(box.reach, at.x.shape)
    gradient = at.jacobian.T @ at.residual
    held = ((at.x <= low) & (gradient > 0.0)) | ((at.x >= high) & (gradient < 0.0))
    lengths = np.linalg.norm(at.jacobian, axis=0)
    free = np.flatnonzero(~held & (lengths > 0.0))
    if free.size == 0:
        return None
    square, image = _root(at.jacobian[:, free] / lengths[free], at.residual)
    damped = np.vstack([square, np.sqrt(damping) * np.eye(free.size)])
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
    """Least-squares solution of the solver in a box: coordinates beyond it go to its edge."""
    solution = np.zeros(matrix.shape[1])
    inside = np.ones(solution.size, dtype=np.bool_)
    while np.any(inside):
        rest = target - matrix[:, ~inside] @ solution[~inside]
        solution[inside] = np.linalg.lstsq(matrix[:, inside], rest, rcond=None)[0]
        outside = inside & ((solution < low) | (solution > high))
        if not np.any(outside):
            break
        solution[outside] = np.clip(solution, low, high)[outside]
        inside &= ~outside
    return solution


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
