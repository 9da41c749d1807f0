"""The inverse-dynamics residual of simulations of the model itself: the bias and the noise of the comparison.

Positions are filtered and differentiated, commands are held, encoders are noisy. The filter blurs the reversal of dry
friction, so that the residual is not zero at the true parameters, and a fit is biased by several of its deviations. So
the fitted model is simulated on the commands of the log, with noise like that of its encoders. The residual of that
simulation is taken off the residual of the log (C. Gouriéroux, A. Monfort, E. Renault, "Indirect inference", *J.
Applied Econometrics* 8, 1993; B. Efron and R. Tibshirani, *An Introduction to the Bootstrap*, 1993, chapter 10).

A log shows the noise of its instruments. The noise of drives, what they deliver beside their commands, nobody measures.
It is what the residual holds beyond the noise of the instruments: components of variance by the method of
moments (S. Searle, G. Casella, C. McCulloch, *Variance Components*, 1992, chapter 5). Differences between neighbours
are compared, from which what a model lacks beside a slow motion all but vanishes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import nnls

from vpm.errors import VpmError
from vpm.experiment import Experiment, Motion, as_read, instrument_noise
from vpm.identify.first_states import begun_again
from vpm.identify.inverse_dynamics import InverseDynamicsProblem
from vpm.identify.response_along_motion import bends, has_hidden, has_own_drives
from vpm.identify.settings import OwnSimulation
from vpm.initial import initial_state, measured_states
from vpm.model import Model
from vpm.numbers import Array
from vpm.simulate import HOLDS, Setup
from vpm.stepping import Simulation

#: Order of the differences, and draws that tell what noise leaves of them.
ORDER, TRIALS = 2, 3
#: Share of a command's size by which it is moved to see what is left.
MOVED = 1e-3


class Own(NamedTuple):
    """The residual of simulations of its own model, shape (n,), and their noise.

    Where these are not alike, it leaves too much more of the records: something is missing, or far from where it is.
    """

    expected: Array
    noise: Noise
    alike: bool


def own_residual(
    model: Model, data: InverseDynamicsProblem, settings: OwnSimulation | None = None, seed: int = 0
) -> Own | None:
    """Closed-loop predictions' residual: what ``data`` leaves of simulations of ``model`` itself.

    Result: None where the model does not stay by its records, where cylinders stand beside other drives, or drives with
    states of their own beside joints that nobody measured.
    """
    how = settings or OwnSimulation()
    hidden = any(tuple(model.joints) != tuple(m.joints) for m in data.motions)
    if data.hold != HOLDS[0] or _pushes(model) is None or (hidden and has_own_drives(model)):
        return None
    try:
        return _own(model, data, how, np.random.default_rng(seed))
    except (VpmError, ArithmeticError, np.linalg.LinAlgError):
        return None


def _own(model: Model, data: InverseDynamicsProblem, how: OwnSimulation, random: np.random.Generator) -> Own | None:
    channels = tuple(name for name in compared(data) if name in model.output_channels)
    logs = list(zip(data.experiments, data.motions, strict=True))
    starts = [_start(model, data, record) for record in range(len(logs))]
    found = [_beside(model, log, m, channels, how, start) for (log, m), start in zip(logs, starts, strict=True)]
    guided = [one for one in found if one is not None]
    if len(guided) < len(logs):
        return None
    noise = noise_of(model, data, [quiet for _, quiet in guided], random)
    draws = [one for _ in range(how.pairs) for one in mirrored(noise.drawn(data.experiments, random))]
    columns = []
    for record, ((log, m), (band, quiet)) in enumerate(zip(logs, guided, strict=True)):
        start = starts[record]
        seen, told = (np.array([draw[record][side] for draw in draws]) for side in (0, 1))
        made = _drawn(model, log, m, channels, how, band, told, start) if np.any(told) else [quiet] * len(draws)
        columns.append([replace(one, data=one.data + read) for one, read in zip(made, seen, strict=True)])
    written = list(zip(*columns, strict=True))
    left = [begun_again(model, data.on(made)).evaluate(model, model.theta)[0] for made in written]
    of_log = data.evaluate(model, model.theta)[0]
    alike = bool(np.linalg.norm(of_log) <= how.alike * np.linalg.norm(left) / np.sqrt(len(left)))
    return Own(np.asarray(np.mean(left, axis=0)), noise, alike)


def _pushes(model: Model) -> bool | None:
    """Whether commands act as efforts in a closed-loop prediction, or as valve openings; None for both kinds."""
    kinds = {model.actuator_type(name) != "hydraulic" for name in model.actuators}
    return kinds.pop() if len(kinds) == 1 else None


def _beside(
    model: Model, log: Experiment, m: Motion, channels: Sequence[str], how: OwnSimulation, start: Array
) -> tuple[float, Experiment] | None:
    """Bandwidth of a closed-loop prediction beside a log, and the log without noise; None without any."""
    joints = [f"{joint}.position" for joint in m.joints]
    for band in how.bands:
        (made,) = _drawn(model, log, m, channels, how, band, np.zeros((1, *log.data.shape)), start)
        if all(np.std(made[channel] - log[channel]) <= how.away * np.std(log[channel]) for channel in joints):
            return band, made
    return None


def _drawn(
    model: Model,
    log: Experiment,
    m: Motion,
    channels: Sequence[str],
    how: OwnSimulation,
    band: float,
    told: Array,
    start: Array,
) -> list[Experiment]:
    """Closed-loop predictions: simulations with a slow controller that keeps them by the log's motion.

    Drives deliver beside their commands what is ``told`` (runs, N, channels) in the columns of these, and no log tells.
    All runs go side by side: most of the time of one would be that of asking and telling, sample by sample.
    """
    by_position, by_velocity = commands_to_draw(model, m, 2.0 * np.pi * band, how.damping)
    runs = [Simulation(model, m.dt, integrator=how.method, state=start, compiled=True) for _ in told]
    columns, moved = runs[0].channels, [[f"{joint}.{of}" for joint in m.joints] for of in ("position", "velocity")]
    read, places, speeds = ([columns.index(name) for name in names] for names in (channels, *moved))
    outputs, commands = np.empty((len(told), len(m.time), len(read))), np.empty((len(told), *m.inputs.shape))
    untold = np.zeros_like(commands)
    for column, channel in enumerate(m.drivers):
        if channel in log:
            untold[:, :, column] = told[:, :, log.channels.index(channel)]
    wanted = m.inputs + m.position @ by_position.T + m.velocity @ by_velocity.T
    for k, ahead in enumerate(wanted):
        now = np.array([run.outputs for run in runs])
        outputs[:, k] = now[:, read]
        commands[:, k] = ahead - now[:, places] @ by_position.T - now[:, speeds] @ by_velocity.T
        for run, command in zip(runs, commands[:, k] + untold[:, k], strict=True):
            run.step(command)
    return [_written(log, m, channels, one, held) for one, held in zip(outputs, commands, strict=True)]


def _start(model: Model, data: InverseDynamicsProblem, record: int) -> Array:
    """First state of a closed-loop prediction; the inverse dynamics gives what nobody measured."""
    log, m = data.experiments[record], data.motions[record]
    if tuple(m.joints) == tuple(model.joints):
        start = np.array(measured_states(model, log, model.theta, np.zeros(1, dtype=np.int64), m.cutoff, m)[0])
    else:
        start = initial_state(model, log, model.theta)
    if has_hidden(model, m.joints):
        start[: 2 * len(model.coordinates)] = data.hidden_states(model, record)[0]
    return start


def _written(log: Experiment, m: Motion, channels: Sequence[str], outputs: Array, commands: Array) -> Experiment:
    """Log with predicted readings (N, channels) and other commands (N, nu)."""
    data = np.array(log.data)
    for values, names in ((outputs, channels), (commands, m.drivers)):
        for column, channel in enumerate(names):
            if channel in log:
                data[:, log.channels.index(channel)] = values[:, column]
    return replace(log, data=data)


def commands_to_draw(model: Model, m: Motion, omega: float, damping: float) -> tuple[Array, Array]:
    """Commands of a closed-loop prediction per missing position and velocity (nu, n), by bandwidth, rad/s."""
    if _pushes(model):
        pushing = _commands_per_effort(model, m, 1.0 / omega) @ _mass_matrix(model, m)
        return omega**2 * pushing, 2.0 * damping * omega * pushing
    slow = omega * _commands_per_velocity(model, m)
    return slow, np.zeros_like(slow)


def _mass_matrix(model: Model, m: Motion) -> Array:
    """Inertia of the measured joints (n, n) for the prediction's controller, in the middle of the motion."""
    places, position = _middle(model, m)
    coordinates = model.core.equilibrium(model.theta, position)[0] if bends(model) else position
    return np.asarray(model.core.mass_matrix(model.theta, coordinates))[np.ix_(places, places)]


def _middle(model: Model, m: Motion) -> tuple[list[int], Array]:
    """Middle of the motion of all joints for the prediction's controller; others stand at zero."""
    places, position = [model.joints.index(joint) for joint in m.joints], np.zeros(len(model.joints))
    position[places] = np.mean(m.position, axis=0)
    return places, position


def _commands_per_velocity(model: Model, m: Motion) -> Array:
    """Change of commands per joint velocity (nu, n) along the log, for a closed-loop prediction."""
    commands, velocities = (values - np.mean(values, axis=0) for values in (m.inputs, m.velocity))
    moved = np.zeros((len(model.joints), m.inputs.shape[1]))
    for column, name in enumerate(model.actuators):
        for joint in model.joints_of_actuator(name):
            row, power = model.joints.index(joint), float(np.sum(commands[:, column] ** 2))
            moved[row, column] = float(velocities[:, row] @ commands[:, column]) / max(power, 1e-300)
    return np.asarray(np.linalg.pinv(moved))


def _commands_per_effort(model: Model, m: Motion, after: float) -> Array:
    """Change of commands per joint effort (nu, n) at their sizes, for a closed-loop prediction.

    What drives deliver is that ``after`` a while, s: by then windings and delays have passed on what they were told.
    """
    samples, sizes = max(3, round(after / m.dt)), np.max(np.abs(m.inputs), axis=0, initial=0.0)
    still, (places, middle) = np.zeros((samples, len(model.joints))), _middle(model, m)

    def delivered(inputs: Array) -> Array:
        held = np.tile(inputs, (samples, 1))
        if bends(model):
            return np.asarray(model.core.delivered(model.theta, held, m.dt)[0][-1])[places]
        if not has_own_drives(model):
            effort = model.core.inverse_dynamics(model.theta, still, still, still, held, m.dt, [])[1]
            return np.asarray(effort[-1])[places]
        motion, first = (still + middle, still, still), model.core.internal_state(model.theta, middle)
        run = model.core.simulate_drives(
            model.theta, *motion, held, first, [], np.zeros((samples, 0)), m.dt, 1, Setup().method(model), []
        )
        return np.asarray(run[0][-1, -len(model.joints) :])[places]

    columns = [(delivered(step) - delivered(-step)) / (2.0 * max(np.sum(step), 1e-300)) for step in np.diag(sizes)]
    return np.asarray(np.linalg.pinv(np.column_stack(columns)))


@dataclass(frozen=True)
class Noise:
    """Standard deviations of white noise on the channels of some records, in the units of their data."""

    #: Of readings, and of what commands do not tell; shape (records, channels).
    instruments: Array
    drives: Array

    def drawn(self, records: Sequence[Experiment], random: np.random.Generator) -> list[tuple[Array, Array]]:
        """Noise draw of a closed-loop prediction for each record: of readings and drives, in the data's shape."""
        return [
            (seen * _as_read(e, random.standard_normal(e.data.shape)), told * random.standard_normal(e.data.shape))
            for e, seen, told in zip(records, self.instruments, self.drives, strict=True)
        ]


def _as_read(record: Experiment, white: Array) -> Array:
    """White noise (N, channels) of a closed-loop prediction as each channel of its record holds it."""
    return np.column_stack([as_read(record, name, one) for name, one in zip(record.channels, white.T, strict=True)])


def mirrored(draw: Sequence[tuple[Array, Array]]) -> tuple[Sequence[tuple[Array, Array]], ...]:
    """Noise draw of a closed-loop prediction and its mirror image: linear effects cancel in their mean."""
    return draw, [(-seen, -told) for seen, told in draw]


def noise_of(
    model: Model, data: InverseDynamicsProblem, quiet: Sequence[Experiment], random: np.random.Generator
) -> Noise:
    """Noise of the records for closed-loop predictions, as a fitted model understands them.

    ``quiet``: the records as the model would have written them without noise: what these leave no drive is to blame
    for.
    """
    same, names = data.on(data.experiments), compared(data)
    instruments = np.array(
        [[instrument_noise(e, c) if c in names else 0.0 for c in e.channels] for e in data.experiments]
    )
    silent = np.zeros_like(instruments)
    told = [Noise(silent, moved) for moved in _commands_moved(data)]
    if not told:
        return Noise(instruments, silent)

    def powers(residuals: Array) -> Array:
        return np.asarray(np.mean([_powers(data, one) for one in residuals], axis=0))

    residual = same.evaluate(model, model.theta)[0]
    of_log = _powers(data, residual)
    of_quiet = powers(noisy(model, begun_again(model, data.on(quiet)), Noise(instruments, silent), random, TRIALS))
    by_drive = [powers(noisy(model, same, each, random, TRIALS) - residual) for each in told]
    scale = 1.0 / np.where(of_log > 0.0, of_log, 1.0)
    shares, _ = nnls((np.array(by_drive) * scale).T, np.maximum(of_log - of_quiet, 0.0) * scale)
    drives = np.sum([np.sqrt(share) * each.drives for share, each in zip(shares, told, strict=True)], axis=0)
    return Noise(instruments, drives)


def compared(data: InverseDynamicsProblem) -> tuple[str, ...]:
    """Readings that the residual of a closed-loop prediction compares."""
    return (*(f"{joint}.position" for joint in data.motions[0].joints), *data.shown)


def noisy(model: Model, data: InverseDynamicsProblem, noise: Noise, random: np.random.Generator, draws: int) -> Array:
    """Residuals of closed-loop predictions with noise draws added to the records, shape (draws, n)."""
    found = []
    for _ in range(draws):
        both = noise.drawn(data.experiments, random)
        added = [replace(e, data=e.data + seen - told) for e, (seen, told) in zip(data.experiments, both, strict=True)]
        found.append(data.on(added).evaluate(model, model.theta)[0])
    return np.array(found)


def _commands_moved(data: InverseDynamicsProblem) -> list[Array]:
    """Small part of each command's size in the records (records, channels), for closed-loop predictions."""
    commands = [name for name in data.motions[0].drivers if name.endswith(".command")]
    sizes = [
        np.array([[MOVED * float(np.std(e[c])) if c == command else 0.0 for c in e.channels] for e in data.experiments])
        for command in commands
    ]
    return [size for size in sizes if np.any(size)]


def _powers(data: InverseDynamicsProblem, residual: Array) -> Array:
    """Mean square of each block's differences of predicted residuals, where all that they reach counts."""
    found = []
    for block in data.blocks:
        counts = np.convolve(block.moving > 0.0, np.ones(ORDER + 1), "valid") > ORDER + 0.5
        steps = np.diff(residual[block.samples], ORDER)[counts]
        found.append(float(np.mean(steps**2)) if steps.size else 0.0)
    return np.array(found)
