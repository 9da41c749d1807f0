"""Poses in which a machine's outputs are where they should be, with the loads that a motion makes."""

from typing import Any

import numpy as np

from vpm.control.task import Task
from vpm.errors import SimulationError
from vpm.numbers import Array

#: Newton's method ends where steps are this small, rad or m, and gives up after so many.
CLOSE, STEPS = 1e-11, 60
#: Longest step, rad or m: farther away no linear model of an arm holds.
LONGEST = 0.3
#: Share of a motion that no further term of a series is worth: each one makes more of rounding.
ENOUGH = 1e-6


def poses(
    task: Task,
    wanted: Array,
    guess: Array,
    loads: tuple[Array, Array] | None = None,
    *,
    stiff: bool = False,
) -> tuple[Array, Array]:
    """Poses of rest: coordinates and inputs with wanted outputs, and efforts in balance.

    Law: ``M(q) a + h(q, v) = B(q) u`` and ``y(q) = y_d`` for given ``v`` and ``a``.

    - ``wanted``: shape (N, m)
    - ``guess``: shape (N, n)
    - ``loads``: each of shape (N, n), velocities and accelerations; by default the machine is at rest
    - ``stiff``: keep flexible links straight; their own balance is then left out

    - result ``q``, ``u``: shape (N, n), (N, m)
    """
    model, count, m = task.model, guess.shape[1], wanted.shape[1]
    free = np.arange(len(model.joints) if stiff else count)
    q, zero = guess.copy(), np.zeros_like(guess)
    if stiff:
        q[:, len(free) :] = 0.0
    v, a = (zero, zero) if loads is None else loads
    u, size = np.zeros_like(wanted), np.inf
    for _ in range(STEPS):
        near, levers, J = model.inverse_dynamics_derivatives(q, v, a), task.levers(q), task.jacobian(q)
        both = np.zeros((len(q), len(free) + m, len(free) + m))
        both[:, : len(free), : len(free)] = near.by_position[:, free][:, :, free]
        both[:, : len(free), len(free) :], both[:, len(free) :, : len(free)] = -levers[:, free], J[:, :, free]
        missing = np.concatenate([near.effort[:, free], task.values(q) - wanted], axis=1)
        step = _solved(both, -missing)
        if not np.isfinite(step).all():
            break
        moved, u = step[:, : len(free)], step[:, len(free) :]
        longest = np.abs(moved).max(axis=1, keepdims=True)
        q[:, free] += moved * np.minimum(1.0, LONGEST / np.maximum(longest, 1e-300))
        size = float(longest.max())
        if size < CLOSE * max(1.0, float(np.abs(q).max())):
            return q, u
    _refuse_still(task, guess)
    row = int(np.argmax(np.abs(task.values(q) - wanted).max(axis=1))) if np.isfinite(q).all() else 0
    told = ", ".join(f"{name} = {value:.4g}" for name, value in zip(task.outputs, wanted[row], strict=True))
    raise SimulationError(
        f"{model.name}: there is no pose at rest near the given one with {told}; keep the target within reach, or give "
        "a start nearer to it"
    )


def along(task: Task, wanted: Array, start: Array, *, stiff: bool = False, between: int = 60) -> Array:
    """Poses of rest along a way (N, n), each sought from the one before, so that no branch is left."""
    coarse = np.unique(np.linspace(0, len(wanted) - 1, min(between, len(wanted))).astype(int))
    found, near = [], start[None, :]
    for place in coarse:
        near, _ = poses(task, wanted[place : place + 1], near, stiff=stiff)
        found.append(near[0])
    columns = np.array(found).T
    guess = np.column_stack([np.interp(np.arange(len(wanted)), coarse, column) for column in columns])
    return poses(task, wanted, guess, stiff=stiff)[0]


def loaded(task: Task, times: Array, wanted: Array, q: Array) -> Array:
    """Poses (N, n) under gravity and inertial forces of their own motion, from those of rest.

    Each round takes the loads of the motion before, which adds two derivatives of the target. Such a series converges
    at first where the target is slow beside the internal motions, and diverges in the end: it ends where its terms
    have been smallest, or are small.
    """
    size, small = np.inf, ENOUGH * float(np.ptp(q, axis=0).max())
    while True:
        _, v, a = course(times, q, times)
        try:
            better, _ = poses(task, wanted, q, (v, a))
        except SimulationError:
            return q
        change = float(np.abs(better - q).max())
        if not small < change < 0.5 * size:
            return q
        q, size = better, change


def course(times: Array, q: Array, at: Array) -> tuple[Array, Array, Array]:
    """Positions, velocities and accelerations at other times of coordinates (N, n) that go from rest to rest.

    They are those of splines of degree 5, which are at rest at both ends.
    """
    from scipy.interpolate import make_interp_spline

    still = np.zeros(q.shape[1])
    ends: Any = ([(1, still), (2, still)],) * 2  # the stubs of SciPy know single conditions only
    spline = make_interp_spline(times, q, k=5, bc_type=ends)
    return np.asarray(spline(at)), np.asarray(spline(at, 1)), np.asarray(spline(at, 2))


def _solved(both: Array, right: Array) -> Array:
    try:
        return np.asarray(np.linalg.solve(both, right[:, :, None])[:, :, 0])
    except np.linalg.LinAlgError:
        return np.full(right.shape, np.nan)


def _refuse_still(task: Task, q: Array) -> None:
    """Refuse outputs at rest that no coordinate moves, as across the plane of a planar arm."""
    slopes = np.abs(task.jacobian(q))
    still = slopes.max(axis=(0, 2)) <= 1e-12 * slopes.max(initial=0.0)
    if still.any():
        names = " and ".join(name for name, none in zip(task.outputs, still, strict=True) if none)
        raise SimulationError(
            f"{task.model.name}: nothing moves {names} near the given pose; leave this out of the outputs, or give "
            "another start"
        )
