"""Where on its way, or in its workspace, a controller is: places between points at which gains are known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vpm.control.plan import FlexibleFeedforward
from vpm.errors import SimulationError, check_known
from vpm.model import Model
from vpm.numbers import Array, array_of
from vpm.results import Storable

#: The axis of schedules along a motion.
TIME = "time"


@dataclass(frozen=True, repr=False, eq=False)
class Schedule(Storable):
    """A grid of points with a state and a command each; tables of gains have one row for each point.

    Attributes
    ----------
    axes : tuple of str
        Joints, or ``"time"`` alone.
    grid : tuple of ndarray
        Ascending values along each axis, rad, m or s.
    states, commands : ndarray, shapes (points, nx), (points, nu)
        The last axis runs fastest.
    """

    axes: tuple[str, ...]
    grid: tuple[Array, ...]
    states: Array
    commands: Array

    @classmethod
    def along(cls, motion: FlexibleFeedforward, points: int) -> Schedule:
        """Schedule points at even times along a feed-forward."""
        rows = np.unique(np.linspace(0, len(motion.time) - 1, max(points, 1)).astype(int))
        return cls((TIME,), (motion.time[rows],), motion.state[rows], motion.commands[rows])

    @classmethod
    def over(cls, model: Model, joints: Mapping[str, ArrayLike]) -> Schedule:
        """Schedule points: poses of rest at all combinations of some joints' positions.

        Raises `SimulationError`: a name is unknown, positions do not ascend, or something else than an ideal drive
        holds a joint.
        """
        grid = tuple(
            np.atleast_1d(array_of(values, f"{name}: positions", SimulationError)) for name, values in joints.items()
        )
        check_known(joints, model.joints, SimulationError, "", "is no joint to schedule by")
        for name, values in zip(joints, grid, strict=True):
            if values.ndim != 1 or not values.size or not np.isfinite(values).all() or (np.diff(values) <= 0.0).any():
                raise SimulationError(f"{name}: positions of a schedule have to ascend; sort them, each once")
        places = [model.joints.index(name) for name in joints]
        states, commands = [], []
        for pose in product(*grid):
            q = np.zeros(len(model.joints))
            q[places] = pose
            coordinates, effort = model.equilibrium(q)
            states.append(np.concatenate([coordinates, np.zeros_like(coordinates)]))
            commands.append(_holding(model, states[-1], effort))
        return cls(tuple(joints), grid, np.array(states), np.array(commands))

    def weights(self, values: Array) -> tuple[NDArray[np.intp], Array]:
        """Schedule points around a place, and their shares by linear interpolation."""
        places, shares = np.zeros(1, dtype=np.intp), np.ones(1)
        for axis, value in zip(self.grid, values, strict=True):
            count = len(axis)
            after = min(max(int(axis.searchsorted(value)), 1), max(count - 1, 1))
            share = 0.0
            if count > 1:
                share = min(max((value - axis[after - 1]) / (axis[after] - axis[after - 1]), 0.0), 1.0)
            low, high = after - 1, min(after, count - 1)
            places = np.concatenate([places * count + low, places * count + high])
            shares = np.concatenate([shares * (1.0 - share), shares * share])
        return places, shares


def _holding(model: Model, state: Array, effort: Array) -> Array:
    """Commands that hold a pose of the schedule, by the levers of all inputs about it but for springs along lines."""
    n = len(model.coordinates)
    if len(state) != model.core.n_states:
        raise SimulationError(f"{model.name}: drives with states of their own cannot be scheduled; use ideal drives")
    standing = model.command()
    _, by_inputs, _, _ = model.core.linearize(model.theta, state, standing)
    working = np.array([channel not in model.optional_inputs for channel in model.input_channels])
    levers = model.mass_matrix(state[:n]) @ by_inputs[n:] * working
    # Links rest as gravity and springs bend them: a force of a drive on them would bend them otherwise.
    wanted = np.concatenate([effort, np.zeros(n - len(effort))])
    found = np.linalg.lstsq(levers, wanted, rcond=None)[0]
    missing = float(np.abs(levers @ found - wanted).max(initial=0.0))
    if missing > 1e-6 * float(np.abs(effort).max(initial=0.0)):
        raise SimulationError(
            f"{model.name}: no command holds the joints at {np.round(state[: len(effort)], 4).tolist()}, {missing:.3g} "
            "N or N m are missing; schedule along a feed-forward, or where passive joints rest"
        )
    return np.asarray(standing + found)
