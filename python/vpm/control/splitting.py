"""Boundary value problems whose solutions die out forward or backward in time: stable inversion."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vpm.errors import SimulationError
from vpm.numbers import Array

Places = NDArray[np.intp]

#: Rates ``x' = f(times, x)`` of many rows (N, nx), with their derivatives (N, nx, nx).
Rates = Callable[[Array, Array], tuple[Array, Array]]

#: Newton's method ends where steps are this small beside the motion, and gives up after so many.
CLOSE, STEPS = 1e-9, 40
#: Steps below this share of the motion that no longer shrink are rounding of stiff internal motions.
ROUNDED = 1e-4
#: Places at which a motion is looked at that could not be inverted.
LOOKS = 21


class Split(NamedTuple):
    """Directions (rows) in which a linear system dies out backward and forward, and its eigenvalues."""

    forward: Array
    backward: Array
    poles: NDArray[np.complex128]


def split(matrix: Array) -> Split:
    """Splitting of a matrix into left invariant subspaces, by the real Schur form of its transpose.

    Poles on the imaginary axis count as forward in time: what neither dies out nor grows follows from the past.
    """
    from scipy.linalg import schur

    poles = np.linalg.eigvals(matrix).astype(np.complex128)
    edge = 1e-9 * float(np.abs(poles).max(initial=1.0))
    _, stable, count = schur(matrix.T, sort=lambda real, _: real <= edge)
    _, unstable, rest = schur(matrix.T, sort=lambda real, _: real > edge)
    return Split(stable[:, :count].T, unstable[:, :rest].T, poles)


def solve(rates: Rates, times: Array, guess: Array, ends: tuple[Array, Array]) -> Array:
    """States (N, nx) of ``x' = f(t, x)`` by splitting: stable part from rest, unstable part to rest.

    Collocation by cubic splines (three-stage Lobatto IIIA, order 4: U. Ascher, R. Mattheij, R. Russell, "Numerical
    Solution of Boundary Value Problems for Ordinary Differential Equations", 1995, section 5.4). It treats growing and
    decaying solutions alike, which is what makes the inversion stable (S. Devasia, D. Chen, B. Paden, IEEE Trans.
    Automatic Control 41(7), 1996; in the iterated form each of Newton's steps is a linear time-varying inversion).

    - ``times``: shape (N,), evenly spaced, s
    - ``guess``: shape (N, nx), from rest to rest; its ends are the states of rest
    - ``ends``: derivatives of the rates at both states of rest

    Raises `SimulationError`: Newton's method does not end, or the machine has another number of unstable directions at
    its end.
    """
    first, last = split(ends[0]).forward, split(ends[1]).backward
    nx = guess.shape[1]
    if len(first) + len(last) != nx:
        raise SimulationError(
            f"internal motions that grow by themselves: {nx - len(first)} where the motion begins, {len(last)} where "
            "it ends; choose an output, or a way, along which their number stays the same"
        )
    states, rest = guess.copy(), (guess[0].copy(), guess[-1].copy())
    size = np.abs(guess).max(axis=0) + 1e-3 * np.abs(guess).max()
    error = np.inf
    for _ in range(STEPS):
        residual, before, after = _collocation(rates, times, states)
        right = np.concatenate([first @ (states[0] - rest[0]), residual.ravel(), last @ (states[-1] - rest[1])])
        step = -_banded((first, before, after, last), right).reshape(states.shape)
        relative = float(np.abs(step / size).max())
        if not np.isfinite(relative):
            break
        # A step that is as large as the motion is shortened, so that the linear model holds.
        states += min(1.0, 1.0 / relative) * step
        if relative < CLOSE or 0.5 * error < relative < ROUNDED:
            return states
        error = relative
    reason = _turning(rates, times, guess) or f"the last step was {error:.2g} of the motion"
    raise SimulationError(
        f"the inversion does not converge ({reason}); take a slower motion, keep it off singular poses, "
        'take a coarser level of the links, or method = "inertial"'
    )


def _turning(rates: Rates, times: Array, guess: Array) -> str:
    """Place where the splitting changes: another number of growing motions than at the start, in words.

    Then what grows in one part may die out in another, and nothing bounded need be left (the dichotomy of W. Coppel,
    "Dichotomies in Stability Theory", 1978).
    """
    some = np.unique(np.linspace(0, len(times) - 1, LOOKS).astype(int))
    counts = [len(split(matrix).backward) for matrix in rates(times[some], guess[some])[1]]
    other = next((place for place, count in enumerate(counts) if count != counts[0]), None)
    if other is None:
        return ""
    return f"internal motions that grow: {counts[0]} where it begins, {counts[other]} at {times[some][other]:.3g} s"


def between(times: Array, states: Array, slopes: Array) -> tuple[Array, Array]:
    """Times and states for splitting in the middle of all intervals, by cubic splines."""
    step = times[1] - times[0]
    middle = 0.5 * (states[:-1] + states[1:]) + step / 8.0 * (slopes[:-1] - slopes[1:])
    return 0.5 * (times[:-1] + times[1:]), middle


def _collocation(rates: Rates, times: Array, states: Array) -> tuple[Array, Array, Array]:
    """Collocation errors of a split problem (N - 1, nx), with derivatives (N - 1, nx, nx)."""
    step, unit = times[1] - times[0], np.eye(states.shape[1])
    slopes, by_state = rates(times, states)
    middle_slopes, by_middle = rates(*between(times, states, slopes))
    residual = states[1:] - states[:-1] - step / 6.0 * (slopes[:-1] + 4.0 * middle_slopes + slopes[1:])
    left, right = by_state[:-1], by_state[1:]
    before = -unit - step / 6.0 * (left + by_middle @ (2.0 * unit + step / 2.0 * left))
    after = unit - step / 6.0 * (right + by_middle @ (2.0 * unit - step / 2.0 * right))
    return residual, before, after


def _banded(parts: tuple[Array, Array, Array, Array], right: Array) -> Array:
    """Solution of the split problem's almost block diagonal system."""
    from scipy.linalg import solve_banded

    first, before, after, last = parts
    count, nx, shift = len(before), before.shape[1], len(first)
    below, above = nx + shift - 1, max(2 * nx - 1 - shift, nx - 1)
    band = np.zeros((below + above + 1, right.size))

    def put(rows: Places, columns: Places, values: Array) -> None:
        band[above + rows - columns, np.broadcast_to(columns, values.shape)] = values

    inside, k = np.arange(nx), nx * np.arange(count)[:, None, None]
    put(np.arange(shift)[:, None], inside, first)
    put(shift + k + inside[:, None], k + inside, before)
    put(shift + k + inside[:, None], k + nx + inside, after)
    put(shift + nx * count + np.arange(len(last))[:, None], nx * count + inside, last)
    return np.asarray(solve_banded((below, above), band, right, check_finite=False))
