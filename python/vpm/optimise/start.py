"""Where the search begins: rest at both ends, a smooth way between, the sizes of all variables."""

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np
from scipy.linalg import expm, matrix_balance

from vpm.errors import VpmError
from vpm.model import Model
from vpm.model.drives.states import rest as settled
from vpm.numbers import Array
from vpm.optimise.channels import Channels
from vpm.optimise.collocation import spread
from vpm.optimise.equations import casadi
from vpm.optimise.motion import MeshMotion
from vpm.optimise.task import End, Fitted, Limit
from vpm.optimise.transcription import LARGE, Scales

#: Steps of the response that tells how far commands move a state.
RESPONSE = 60
#: Samples of a guess that is simulated.
SAMPLES = 2000


def complete(model: Model, task: Fitted) -> Fitted:
    """Start of the task completed: what it does not name is at zero, at rest or as in rest.

    Periodic motions begin where it costs least; a state with a range begins within it.
    """
    if task.periodic:
        return task
    named = {one.channel for one in task.begin.conditions}
    joints, state = len(model.joints), standing(model, task)
    names = model.state_names[: joints if task.begin.rest else None]
    values = zip(names, model.state_units, state, strict=False)
    found = [Limit(name, unit, value, value) for name, unit, value in values if name not in named]
    return replace(task, begin=End(task.begin.rest, (*task.begin.conditions, *found)))


def standing(model: Model, task: Fitted) -> Array:
    """Start state at rest at the joints' named positions; the others are at zero."""
    state = np.zeros(len(model.state_names))
    for one in task.begin.conditions:
        if one.channel in model.state_names[: len(model.coordinates)]:
            state[model.state_names.index(one.channel)] = one.near(0.0)
    joints, coordinates = len(model.joints), len(model.coordinates)
    with suppress(VpmError, ValueError):
        if coordinates > joints:
            state[:coordinates] = model.equilibrium(state[:joints])[0]
        state[2 * coordinates :] = settled(model, model.theta, state[:coordinates])
    return state


def ends(model: Model, task: Fitted, channels: Channels) -> list[tuple[Array, Array]]:
    """Start and end of each phase: states and commands, each as near to the one before as can be."""
    state, command = standing(model, task), np.zeros(len(channels.own.commands))
    found = []
    for end, limits in zip(
        (task.begin, *(phase.end for phase in task.phases)),
        (task.phases[0].limits, *(phase.limits for phase in task.phases)),
        strict=True,
    ):
        state, command = _nearest(channels, end, limits, state, command)
        found.append((state, command))
    return found


def _nearest(
    channels: Channels, end: End, limits: Sequence[Limit], state: Array, command: Array
) -> tuple[Array, Array]:
    """State nearest to a start state that fulfils conditions, or comes nearest to them."""
    ca, own = casadi(), channels.own
    if not end.conditions and not end.rest:
        return state, command
    slack = ca.SX.sym("slack", len(end.conditions))
    rows = [channels[one.channel] - slack[at] for at, one in enumerate(end.conditions)]
    least, most = [one.least for one in end.conditions], [one.most for one in end.conditions]
    half = sum(name.endswith(".velocity") for name in own.states)
    if end.rest:  # velocities are zero by their bounds
        rows.append(own.rates[half:])
        least += [0.0] * (len(own.states) - half)
        most += [0.0] * (len(own.states) - half)
    still = [channels.slope, channels.T], [ca.SX.zeros(command.size), ca.SX(1.0)]
    near = np.concatenate([_towards(own.states, end, state), command, np.zeros(len(end.conditions))])
    low, high = _bounds((*own.states, *own.commands), limits, near.size)
    if end.rest:
        low[half : 2 * half] = high[half : 2 * half] = 0.0
    point = ca.vertcat(own.x, own.u, slack)
    away = (point - near) / np.maximum(1.0, np.abs(near))
    # A condition is missed only where it cannot be met: by a hair it costs more than any way from the start.
    problem = {
        "x": point,
        "f": ca.sumsqr(away) + 1e8 * ca.sumsqr(slack),
        "g": ca.substitute([ca.vertcat(*rows)], *still)[0],
    }
    ipopt = {"print_level": 0, "sb": "yes", "max_iter": 300}
    options = {"print_time": False, "error_on_fail": False, "show_eval_warnings": False, "ipopt": ipopt}
    solver = ca.nlpsol("rest", "ipopt", problem, options)
    found = np.array(solver(x0=np.clip(near, low, high), lbx=low, ubx=high, lbg=least, ubg=most)["x"].full()).ravel()
    found = found if np.all(np.isfinite(found)) else near
    return found[: state.size], found[state.size : state.size + command.size]


def _towards(names: Sequence[str], end: End, state: Array) -> Array:
    """Start state with those that an end names where it wants them."""
    found = state.copy()
    for one in end.conditions:
        if one.channel in names:
            found[names.index(one.channel)] = one.near(found[names.index(one.channel)])
    return found


def _bounds(names: Sequence[str], limits: Sequence[Limit], size: int) -> tuple[Array, Array]:
    low, high = np.full(size, -LARGE), np.full(size, LARGE)
    for one in limits:
        if one.channel in names:
            low[names.index(one.channel)], high[names.index(one.channel)] = one.least, one.most
    return low, high


def scales(task: Fitted, channels: Channels, points: Sequence[tuple[Array, Array]]) -> Scales:
    """Sizes of the variables at the start: limits, else what the ends and the commands make of them."""
    # The middle of a range of durations, as a factor of both ends.
    durations = np.array([math.sqrt(phase.shortest * phase.longest) for phase in task.phases])
    own = channels.own
    limits = [one for phase in task.phases for one in phase.limits]

    def limit_of(name: str) -> float:
        return max((one.size for one in limits if one.channel == name), default=0.0)

    commands = np.array([limit_of(name) for name in own.commands])
    held = np.max([np.abs(command) for _, command in points], axis=0)
    commands = np.where(commands > 0.0, commands, np.where(held > 0.0, held, 1.0))
    reach = np.max([np.abs(state) for state, _ in points], axis=0)
    response = _response(channels, points[0], commands, float(durations.sum()))
    states = np.array([limit_of(name) for name in own.states])
    states = np.where(states > 0.0, states, np.where(reach > 1e-9, reach, response))
    half = sum(name.endswith(".velocity") for name in own.states)
    rates = np.arange(half, 2 * half)
    free = np.array([limit_of(own.states[at]) == 0.0 for at in rates], dtype=bool)
    states[rates[free]] = np.maximum(reach[rates], states[rates - half] / durations.sum())[free]
    return Scales(np.where(states > 0.0, states, 1.0), commands, durations)


def _response(channels: Channels, point: tuple[Array, Array], commands: Array, duration: float) -> Array:
    """How far bounded commands move each state from the start, shape (nx,): integral of ``|exp(A t) B|``."""
    ca, own = casadi(), channels.own
    jacobians = ca.Function("AB", [own.x, own.u], [ca.jacobian(own.rates, own.x), ca.jacobian(own.rates, own.u)])
    A, B = (np.array(one.full()) for one in jacobians(*point))
    step = duration / RESPONSE
    if not np.all(np.isfinite(A)):
        return np.ones(len(own.states))
    with np.errstate(over="ignore", invalid="ignore"):
        balanced, T = matrix_balance(A)  # pressures are a million times larger than positions
        phi = T @ expm(balanced * step) @ np.linalg.inv(T)
        moved, total = B * commands, np.zeros(len(own.states))
        for _ in range(RESPONSE):
            total += np.abs(moved).sum(axis=1) * step
            moved = phi @ moved
    return np.where(np.isfinite(total), np.minimum(total, 1e6), 1.0)


def way(
    task: Fitted, channels: Channels, points: Sequence[tuple[Array, Array]], durations: Array, meshes: tuple[Array, ...]
) -> MeshMotion:
    """Start motion from end to end: a polynomial of degree five between positions, at rest at each end."""
    states, commands, half = [points[0][0][None]], [], sum(name.endswith(".velocity") for name in channels.own.states)
    for phase, mesh in enumerate(meshes):
        (begin, held), (end, then) = points[phase], points[phase + 1]
        s = spread(mesh)[1:, None]
        own = begin + (end - begin) * (s**3 * (10.0 - 15.0 * s + 6.0 * s**2))
        own[:, half : 2 * half] = (end - begin)[:half] * 30.0 * (s * (1.0 - s)) ** 2 / durations[phase]
        states.append(own)
        commands.append(held + (then - held) * mesh[:, None])
    rests = [one.rest for one in (task.begin, *(phase.end for phase in task.phases))]
    held_at = tuple(command if there else None for there, (_, command) in zip(rests, points, strict=True))
    return MeshMotion(meshes, durations, np.concatenate(states), tuple(commands), held_at)


def simulated(model: Model, task: Fitted, channels: Channels, motion: MeshMotion) -> MeshMotion:
    """Start motion that the guess's commands make, simulated by vpm."""
    held = np.zeros((len(motion.meshes), len(channels.own.commands)))
    for row, phase in zip(held, task.phases, strict=True):
        for one in phase.guess:
            row[channels.own.commands.index(one.channel)] = one.near(0.0)
    time = np.linspace(0.0, motion.starts[-1], SAMPLES + 1)
    phases = np.clip(np.searchsorted(motion.starts, time, side="right") - 1, 0, len(held) - 1)
    step = float(time[1])
    _, states, _ = model.core.simulate(model.theta, motion.states[0], held[phases], step, 1, "adaptive")
    found = np.stack([np.interp(motion.times, time, column) for column in np.array(states).T], axis=1)
    commands = tuple(np.tile(row, (mesh.size, 1)) for row, mesh in zip(held, motion.meshes, strict=True))
    return replace(motion, states=found, commands=commands)
