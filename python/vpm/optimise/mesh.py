"""How far a motion is from the equations between its points, and where its mesh has to be finer.

Source: J. T. Betts, "Practical Methods for Optimal Control and Estimation Using Nonlinear Programming", 2nd edition
2010, section 4.7: the error of an interval is the integral of what the polynomials' rates miss of the equations.
"""

from collections.abc import Sequence

import numpy as np
from numpy.polynomial import legendre

from vpm.numbers import Array
from vpm.optimise.channels import Channels
from vpm.optimise.collocation import STAGES
from vpm.optimise.motion import MeshMotion
from vpm.optimise.task import RATE, Fitted
from vpm.optimise.transcription import Scales

#: Intervals that a phase may have.
MOST = 400
#: Shares of an interval where the equations are looked at, and their weights (Gauss, exact up to degree 9).
_AT, _WEIGHTS = (part * 0.5 for part in legendre.leggauss(STAGES + 2))
CHECKED = _AT + 0.5


def errors(channels: Channels, motion: MeshMotion, scales: Scales) -> tuple[Array, ...]:
    """Mesh error of each interval of each phase, in sizes of the states."""
    found, sizes = [], np.maximum(scales.states, np.abs(motion.states).max(axis=0))
    for phase in range(len(motion.meshes)):
        nodes, _ = motion.of_phase(phase)
        width = np.diff(nodes)
        times = (nodes[:-1, None] + width[:, None] * CHECKED).ravel()
        states, rates, commands = motion.at(times)
        missed = np.abs(rates - channels.rates(states, commands)) / sizes
        sums = np.einsum("i,kix->kx", _WEIGHTS, missed.reshape(width.size, CHECKED.size, -1))
        found.append(width * np.nan_to_num(sums, nan=np.inf).max(axis=1))
    return tuple(found)


def bends(task: Fitted, names: Sequence[str], motion: MeshMotion, scales: Scales) -> tuple[Array, ...]:
    """Cost of straight commands in each interval of a mesh, as a share of the optimum.

    A jump of a command by its size that is drawn out over a share h of the motion costs h^2/6 of the least time of a
    mass, and less than a jump costs its share. Where the rate of a command is limited, it is the rate that jumps.
    """
    found = []
    total = float(motion.durations.sum())
    for phase, mesh in enumerate(motion.meshes):
        width, duration = np.diff(mesh), motion.durations[phase]
        cost = np.zeros(width.size)
        if width.size > 1:
            slope = np.diff(motion.commands[phase], axis=0) / (width[:, None] * duration)
            turn = np.abs(np.diff(slope, axis=0))
            rates = np.array([_rate(task, phase, name) for name in names])
            share = width * duration / total
            for at, side in ((slice(0, -1), width[:-1]), (slice(1, None), width[1:])):
                free = turn * side[:, None] * duration / scales.commands
                jump = np.where(rates > 0.0, turn / np.where(rates > 0.0, rates, 1.0), free).max(axis=1)
                cost[at] = np.maximum(cost[at], np.minimum(jump, 2.0) * share[at] ** 2 / 6.0)
        found.append(cost)
    return tuple(found)


def _rate(task: Fitted, phase: int, name: str) -> float:
    """Limit of a command's rate on the mesh, or zero."""
    return max((one.size for one in task.phases[phase].limits if one.channel == f"{name}{RATE}"), default=0.0)


def finer(mesh: Array, error: Array, bend: Array, tolerance: float) -> Array:
    """A mesh whose intervals are divided where they are too coarse: into as many as the order five asks for."""
    with np.errstate(over="ignore"):
        parts = np.ceil((np.minimum(error, 1e6) / (0.5 * tolerance)) ** 0.2)
    parts = np.clip(np.where(error > tolerance, np.maximum(parts, 2), 1), 1, 4)
    parts = np.where(bend > tolerance, np.maximum(parts, 2), parts).astype(int)
    worst = np.argsort(-np.maximum(error, bend))
    parts[worst[np.cumsum(parts[worst] - 1) > MOST - parts.size]] = 1
    nodes = [mesh[k] + (mesh[k + 1] - mesh[k]) * np.arange(count) / count for k, count in enumerate(parts)]
    return np.concatenate([*nodes, mesh[-1:]])
