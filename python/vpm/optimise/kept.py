"""Which limits hold a motion back, and which it passes between the points where they are asked for."""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from vpm.numbers import Array
from vpm.optimise.channels import Channels
from vpm.optimise.equations import casadi
from vpm.optimise.motion import MeshMotion
from vpm.optimise.task import Fitted, Limit

#: Instants of each phase where limits are looked at, and the share of a limit's width that is no difference.
LOOKS, HAIR = 1001, 1e-3


def passed(channels: Channels, task: Fitted, motion: MeshMotion) -> tuple[str, ...]:
    """Limits that the motion has not kept between points, with by how much."""
    found = []
    for phase, limit, course in _courses(channels, task, motion):
        for word, end, over in (
            ("least", limit.least, limit.least - course),
            ("most", limit.most, course - limit.most),
        ):
            if math.isfinite(end) and over.max() > HAIR * _width(limit):
                found.append(
                    f"Between points {limit.channel} passes its {word} of {end:.4g}{_unit(limit)} by {over.max():.2g}"
                    f"{_unit(limit)} in the {phase}; make the mesh finer, or the limit tighter."
                )
    return tuple(found)


def binding(channels: Channels, task: Fitted, motion: MeshMotion) -> Iterator[str]:
    """Kept limits that hold the motion back, with the share of their phase; durations at an end of their range."""
    for part, duration in zip(task.phases, motion.durations.tolist(), strict=True):
        for word, end in (("least", part.shortest), ("most", part.longest)):
            if part.shortest < part.longest and abs(duration - end) <= HAIR * end:
                yield f"the {part.name} lasts its {word} of {end:.4g} s"
    for phase, limit, course in _courses(channels, task, motion):
        for word, end in (("least", limit.least), ("most", limit.most)):
            if not math.isfinite(end) or limit.least == limit.most:
                continue
            share = float(np.mean(np.abs(course - end) <= HAIR * _width(limit)))
            if share >= 0.005:
                time = f"{100.0 * share:.0f} % of the {phase}"
                yield f"{limit.channel} is at its {word} of {end:.4g}{_unit(limit)} for {time}"
    commands = channels.own.commands
    for limit in dict.fromkeys(one for part in task.phases for one in part.limits if one.channel in commands):
        if limit.least == limit.most:
            continue
        held = [rest[commands.index(limit.channel)] for rest in motion.rests if rest is not None]
        for word, end in (("least", limit.least), ("most", limit.most)):
            if any(abs(command - end) <= HAIR * _width(limit) for command in held):
                yield f"{limit.channel} is at its {word} of {end:.4g}{_unit(limit)} while it holds the machine at rest"


def _courses(channels: Channels, task: Fitted, motion: MeshMotion) -> Iterator[tuple[str, Limit, Array]]:
    """Every channel whose limit has to be kept, over its phase."""
    for number, phase in enumerate(task.phases):
        if phase.limits:
            values = _values(channels, [one.channel for one in phase.limits], motion, number)
            yield from ((phase.name, limit, course) for limit, course in zip(phase.limits, values, strict=True))


def _values(channels: Channels, names: Sequence[str], motion: MeshMotion, phase: int) -> Array:
    """Channels at many instants of a phase where limits are kept, shape (channels, LOOKS)."""
    ca, mesh, commands = casadi(), motion.meshes[phase], motion.commands[phase]
    share = (np.arange(LOOKS) + 0.5) / LOOKS
    states, _, held = motion.at(motion.starts[phase] + motion.durations[phase] * share)
    interval = np.clip(np.searchsorted(mesh, share, side="right") - 1, 0, mesh.size - 2)
    slope = (np.diff(commands, axis=0) / np.diff(mesh)[:, None])[interval]
    function = ca.Function("limited", [channels.variables], [ca.vertcat(*(channels[name] for name in names))])
    point = np.column_stack([states, held, slope, np.full(LOOKS, motion.durations[phase])])
    return np.array(function.map(LOOKS)(point.T).full())


def _width(limit: Limit) -> float:
    width = limit.most - limit.least
    return max(width if math.isfinite(width) else limit.size, 1e-12)


def _unit(limit: Limit) -> str:
    return "" if limit.unit == "1" else f" {limit.unit}"
