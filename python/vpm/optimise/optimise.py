"""Motions that make a goal least: `vpm.optimise`."""

import math
from collections.abc import Mapping
from dataclasses import replace
from os import PathLike

import numpy as np

from vpm.errors import OptimisationError, VpmError
from vpm.model import Model
from vpm.numbers import Array
from vpm.optimise.channels import Channels
from vpm.optimise.kept import binding, passed
from vpm.optimise.motion import MeshMotion
from vpm.optimise.optimum import Optimum
from vpm.optimise.solve import Progress, Search, SearchInterruptedError, search
from vpm.optimise.task import Fitted, Task, as_task


class OptimisationInterruptedError(KeyboardInterrupt):
    """Ctrl-C during a search for an optimal motion.

    Attributes
    ----------
    result : Optimum
        The last iterate, ``interrupted``.
    """

    def __init__(self, result: Optimum) -> None:
        super().__init__("interrupted")
        self.result = result


def optimise(
    model: Model,
    task: Task | Mapping[str, object] | str | PathLike[str],
    *,
    start: Optimum | None = None,
    progress: Progress | None = None,
) -> Optimum:
    """Optimise a machine's motion: a goal becomes least within limits, elasticity included.

    Direct collocation on Radau's points with IPOPT, first and second derivatives exact and sparse. The mesh is made
    finer where the motion misses the equations of motion between points, and the log is played by vpm in the end.

    Parameters
    ----------
    task : Task, mapping or path-like
        See docs/optimisation.md.
    start : Optimum, optional
        Where the search begins: the optimum of a task with the same phases on a machine with the same states.
    progress : callable, optional
        Called with a sentence after every iteration.

    Raises
    ------
    OptimisationError
        The task is wrong or does not fit the model, or no motion fulfils it.
    MissingExtraError
        CasADi is not installed.
    OptimisationInterruptedError
        Ctrl-C, a `KeyboardInterrupt` with the last iterate.
    """
    own = as_task(task)
    machine = own.machine(model)
    fitted = own.fitted(machine)
    try:
        return _optimum(
            (machine, model), own.name, search(machine, fitted, progress or (lambda _: None), _begun(fitted, start))
        )
    except SearchInterruptedError as stopped:
        raise OptimisationInterruptedError(_optimum((machine, model), own.name, stopped.search)) from stopped


def _begun(task: Fitted, start: Optimum | None) -> MeshMotion | None:
    """The motion of an optimum."""
    if start is None:
        return None
    durations = np.array([start.durations.get(phase.name, math.nan) for phase in task.phases])
    if not np.all(np.isfinite(durations)) or len(start.durations) != len(task.phases):
        raise OptimisationError(f"the start has the phases {', '.join(start.durations)}; give the task the same")
    jumps = np.flatnonzero(np.diff(start.node_time) <= 0.0) + 1
    nodes, commands = np.split(start.node_time, jumps), np.split(start.node_commands, jumps)
    meshes = tuple((one - one[0]) / (one[-1] - one[0]) for one in nodes)
    rests = [one.rest for one in (task.begin, *(phase.end for phase in task.phases))]
    held = [commands[0][0], *(one[-1] for one in commands)]
    known = tuple(command if there else None for there, command in zip(rests, held, strict=True))
    return MeshMotion(meshes, durations, np.array(start.mesh_states), tuple(commands), known)


def _optimum(models: tuple[Model, Model], name: str, found: Search) -> Optimum:
    """Result of the optimisation; ``models`` are that of the search and the file's, maybe more detailed."""
    motion, channels = found.motion, found.channels
    time, data = samples(channels, motion, found.task)
    node_times = [motion.of_phase(phase)[0] for phase in range(len(motion.meshes))]
    optimum = Optimum(
        name=name,
        model_name=models[0].name,
        status=found.status,
        objective=found.objective,
        durations={phase.name: float(value) for phase, value in zip(found.task.phases, motion.durations, strict=True)},
        time=time,
        data=data,
        channels=channels.own.channels,
        units=channels.own.channel_units,
        initial_state=motion.states[0].copy(),
        mesh_time=motion.times,
        mesh_states=motion.states,
        node_time=np.concatenate(node_times),
        node_commands=np.concatenate(motion.commands),
        states=channels.own.states,
        commands=channels.own.commands,
        error=found.error,
        intervals=sum(mesh.size - 1 for mesh in motion.meshes),
        rounds=found.rounds,
        iterations=found.iterations,
        binding=tuple(binding(channels, found.task, motion)),
        played={},
        played_in_full={},
        notes=(*found.notes, *passed(channels, found.task, motion)),
    )
    played, notes = _played(models[0], optimum)
    in_full, more = _played(models[1], optimum) if models[1] is not models[0] else ({}, ())
    return replace(optimum, played=played, played_in_full=in_full, notes=(*optimum.notes, *notes, *more))


def samples(channels: Channels, motion: MeshMotion, task: Fitted) -> tuple[Array, Array]:
    """Times and outputs of an optimised log; a command is held at its mean until the next sample.

    Held means give the machine the impulse that the commands between nodes give it, so that a jump between two samples
    is not lost. Before time zero the machine stands, behind the end the command of its rest goes on, or the last one.
    """
    own, end, step = channels.own, float(motion.starts[-1]), task.time_step
    standing = round(task.before / step) if motion.rests[0] is not None else 0
    count = int(np.ceil((end + task.after) / step - 1e-9)) + 1
    time = step * np.arange(-standing, max(count, 10), dtype=np.float64)
    inside = np.clip(time, 0.0, end)
    last = motion.rests[-1] if motion.rests[-1] is not None else motion.commands[-1][-1]
    total = _impulse(motion, np.append(time, time[-1] + step), last)
    held: Array = np.diff(total, axis=0) / step
    data = channels.outputs(motion.at(inside)[0], held)
    for column, name in enumerate(own.commands):
        data[:, own.channels.index(name)] = held[:, column]
    return time, data


def _impulse(motion: MeshMotion, times: Array, last: Array) -> Array:
    """Integral of the optimised commands from zero to each time, shape (N, nu)."""
    total, before = np.zeros((times.size, last.size)), np.zeros(last.size)
    if motion.rests[0] is not None:
        total[times < 0.0] = times[times < 0.0, None] * motion.rests[0]
    for phase in range(len(motion.meshes)):
        nodes, _ = motion.of_phase(phase)
        commands = motion.commands[phase]
        known = np.concatenate(
            [[0.0 * last], np.cumsum(0.5 * np.diff(nodes)[:, None] * (commands[1:] + commands[:-1]), 0)]
        )
        inside = (times >= nodes[0]) & (times < nodes[-1])
        at = np.searchsorted(nodes, times[inside], side="right") - 1
        far = (times[inside] - nodes[at])[:, None]
        slope = (np.diff(commands, axis=0) / np.diff(nodes)[:, None])[at]
        total[inside] = before + known[at] + far * (commands[at] + 0.5 * far * slope)
        before = before + known[-1]
    over = times >= motion.starts[-1]
    total[over] = before + (times[over] - motion.starts[-1])[:, None] * last
    return total


def _played(model: Model, optimum: Optimum) -> tuple[dict[str, float], tuple[str, ...]]:
    """Largest departure of a simulation from the optimal motion, by channel as a share of its range, and notes."""
    try:
        run = optimum.play(model)
    except VpmError as error:
        return {}, (f"vpm cannot play the log: {error}",)
    found = {}
    rows = optimum.time <= optimum.duration
    seen = (".position", ".strain", ".x", ".y", ".z", ".length")
    for channel in optimum.channels:
        if channel.endswith(seen) and channel in run.channels:
            course = optimum[channel][rows]
            size = float(np.ptp(course))
            if size > 1e-9 * max(1.0, float(np.abs(course).max())):
                gap = np.abs(run[channel][: optimum.time.size][rows[: run[channel].size]] - course[: run[channel].size])
                found[channel] = float(gap.max()) / size
    return found, ()
