"""Noise spectrum of residuals: instrument noise, and noise of a command filtered by its drive.

The command that a valve or a winding receives differs a little from the logged one. Pressures and currents integrate
that difference to a slow disturbance that no effect explains. Its spectrum follows from the model of the drive.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from threading import Lock
from weakref import WeakKeyDictionary

import numpy as np
from scipy.ndimage import uniform_filter1d

from vpm.discrepancy.settings import COMMAND_NOISE, DRAWS, GRID, NEAR, PLACES, SEED, SMOOTHED
from vpm.errors import VpmError
from vpm.experiment import Experiment, Motion, drawn_noise
from vpm.experiment.signal import RETAINED_BAND as _BAND
from vpm.identify import InverseDynamicsProblem
from vpm.identify.following import Following
from vpm.identify.parts import moves_drives
from vpm.identify.response_along_motion import has_own_drives, respond
from vpm.initial import measured_states
from vpm.linear import LinearModel
from vpm.model import Model
from vpm.numbers import Array

#: Colours worked out last for each problem, with their model: stages of a diagnosis ask for them again.
_KNOWN: WeakKeyDictionary[InverseDynamicsProblem, tuple[Model, tuple[NoiseShape | None, ...]]] = WeakKeyDictionary()
_LOCK = Lock()


@dataclass(frozen=True, eq=False)
class NoiseShape:
    """Noise spectra of one block of residuals, in units of the weighted residual squared per frequency."""

    instruments: Array  #: (n // 2 + 1,)
    drives: Array  #: (n // 2 + 1,); its scale is unknown.
    most: float  #: Largest scale of ``drives`` that the readings allow, see `_most_allowed`.


def noise_shapes(model: Model, problem: InverseDynamicsProblem) -> tuple[NoiseShape | None, ...]:
    """Noise spectra of each block, in their order; None where no drive colours the noise.

    - ``model``: near enough to the machine for the colour of the noise
    """
    if not problem.shown or not has_own_drives(model):
        return (None,) * len(problem.blocks)
    with _LOCK:
        known, shapes = _KNOWN.get(problem, (None, ()))
    if known is None or not _alike(model, known):
        generator = np.random.default_rng(SEED)
        shapes = tuple(s for r in range(len(problem.motions)) for s in _of_record(model, problem, r, generator))
        with _LOCK:
            _KNOWN[problem] = model, shapes
    return shapes


def _alike(model: Model, known: Model) -> bool:
    """Whether drives of two models give the same noise spectrum: their parameters are nearly equal."""
    own, others = (
        {name: entry.value for name, entry in one.parameters.items() if moves_drives(one, name)}
        for one in (model, known)
    )
    return own.keys() == others.keys() and all(abs(own[n] - others[n]) <= NEAR * abs(others[n]) for n in own)


def noise_spectrum(residual: Array, shape: NoiseShape, quiet: float) -> Array:
    """Noise spectrum of a residual: instruments, and the share of drives that its quiet part shows.

    - ``residual`` (n,)
    - ``quiet``: share of the frequencies that hold no more than noise
    """
    power, own, drive = periodogram(residual), shape.instruments, shape.drives
    inside = slice(1, max(2, int(_BAND * power.size)))
    wanted = -np.log(1.0 - quiet)

    def excess(size: float) -> float:
        ratio = power[inside] / np.maximum(own[inside] + size * drive[inside], 1e-300)
        return float(np.quantile(ratio, quiet))

    if excess(0.0) <= wanted or not drive[inside].any():
        return np.asarray(own)
    low, high = 0.0, float(power[inside].sum() / drive[inside].sum()) + 1e-300
    while excess(high) > wanted:
        high *= 4.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if excess(middle) > wanted else (low, middle)
    return np.asarray(own + min(high, shape.most) * drive)


def periodogram(residual: Array) -> Array:
    """Noise spectrum under a Hann window: power by frequency, equal to the variance for white noise."""
    window = np.hanning(residual.size)
    return np.asarray(np.abs(np.fft.rfft(residual * window)) ** 2 / float(window @ window))


def _of_record(
    model: Model, problem: InverseDynamicsProblem, record: int, generator: np.random.Generator
) -> list[NoiseShape | None]:
    m = problem.motions[record]
    whole = replace(m, edge=0, decimation=1)
    clean = _shown(model, problem, record, whole)
    sizes = COMMAND_NOISE * np.sqrt(np.mean(m.inputs**2, axis=0))
    drives, read = (np.zeros_like(_powers(values)) for values in (m.parallel(clean), clean))
    first = record * (len(problem.joints) + len(problem.shown)) + len(problem.joints)
    blocks = problem.blocks[first : first + len(problem.shown)]
    counted = np.column_stack([block.moving for block in blocks])
    for _ in range(DRAWS):
        noisy = whole.inputs + sizes * generator.standard_normal(whole.inputs.shape)
        change = _shown(model, problem, record, replace(whole, inputs=noisy)) - clean
        drives += _powers(m.parallel(change) * counted) / DRAWS
        read += _powers(change) / DRAWS
    own = _of_instruments(model, problem, record, generator)
    most = _most_allowed(model, problem.experiments[record], m, [block.channel for block in blocks], read)
    shapes: list[NoiseShape | None] = [None] * len(problem.joints)
    for column, block in enumerate(blocks):
        coloured = _smooth(drives[:, column]) * block.weight**2
        known = block.channel.rpartition(".")[0] in model.actuators and coloured.any()
        shapes.append(NoiseShape(_smooth(own[column]), coloured, float(most[column])) if known else None)
    return shapes


def _most_allowed(model: Model, record: Experiment, m: Motion, channels: Sequence[str], drives: Array) -> Array:
    """Factor for each of C channels by which its readings allow more of noise spectra ``drives`` (n // 2 + 1, C).

    Noise of a command is white, so that what it makes of a reading shows above the band that is compared, too, where
    no controller acts against it. At no frequency is it more than all that was read. ``drives`` are those of all
    samples along a prescribed motion; a mass that gives way lets less be read, see `_given_way`.
    """
    frequency = np.arange(len(drives)) / (2.0 * len(drives) * record.dt)
    yielding = _given_way(model, record, m.inputs, channels, frequency)
    most = np.full(len(channels), np.inf)
    for column, channel in enumerate(channels):
        highest = min(record.retained.get(channel, np.inf), 0.5 * record.read_rate(channel))
        heard = (frequency > m.cutoff) & (frequency <= highest)
        made = _smooth(drives[:, column]) * yielding[:, column]
        ratio = _smooth(periodogram(record[channel])) / np.maximum(made, 1e-300)
        most[column] = np.min(ratio[heard], initial=np.inf)
    return most


def _given_way(model: Model, record: Experiment, commands: Array, channels: Sequence[str], frequency: Array) -> Array:
    """Power of commands in channels of the free machine, over that along a prescribed motion; at most 1.

    Law: frequency responses of the linear model at some places of the record, and of that without its joints. At a
    resonance the free machine shows more, but how much depends on its damping. All zero, so that nothing is known,
    where a machine has no linear model. Shape (F, C).
    """
    rows = np.linspace(0, len(record) - 1, PLACES).astype(np.int64)
    grid = np.linspace(frequency[1], frequency[-1], GRID)
    sizes = np.sqrt(np.mean(commands**2, axis=0))
    powers = np.zeros((2, GRID, len(channels)))
    try:
        for state, command in zip(measured_states(model, record, model.theta, rows, None), commands[rows], strict=True):
            linear = model.linearize(state, command).part(outputs=channels)
            answers = [one.response(grid) * sizes for one in (linear, _held(linear, model.joints))]
            powers += np.sum(np.abs(answers) ** 2, axis=3)
    except (VpmError, np.linalg.LinAlgError):
        return np.zeros((frequency.size, len(channels)))
    free, held = powers
    share = np.minimum(free / np.maximum(held, 1e-300), 1.0)
    return np.column_stack([np.interp(frequency, grid, column) for column in share.T])


def _held(linear: LinearModel, joints: Sequence[str]) -> LinearModel:
    """Linear model whose joints move as prescribed, so that they answer nothing."""
    free = [place for place, name in enumerate(linear.states) if name.rpartition(".")[0] not in joints]
    return replace(linear, A=linear.A[np.ix_(free, free)], B=linear.B[free], C=linear.C[:, free])


def _of_instruments(
    model: Model, problem: InverseDynamicsProblem, record: int, generator: np.random.Generator
) -> list[Array]:
    """Noise spectrum that all instruments cause in each channel, found by adding their noise again."""
    one = problem.experiments[record]
    m, steps = problem.motions[record], problem.integrators[record]
    clean, noisy = (
        InverseDynamicsProblem(model, [log], cutoff=m.cutoff, band=m.band, integrator=steps)
        for log in (one, with_noise(model, one, one, generator))
    )
    change = noisy.evaluate(model, model.theta)[0] / _weights(noisy) - clean.evaluate(model, model.theta)[0] / (
        _weights(clean)
    )
    count = len(problem.joints) + len(problem.shown)
    mine = problem.blocks[record * count :][len(problem.joints) : count]
    places = clean.blocks[len(problem.joints) :]
    return [periodogram(change[place.samples]) * block.weight**2 for place, block in zip(places, mine, strict=True)]


def _weights(problem: InverseDynamicsProblem) -> Array:
    """Weight of each number of a residual in its noise spectrum."""
    return np.concatenate([np.full(block.time.size, block.weight) for block in problem.blocks])


def with_noise(model: Model, log: Experiment, read: Experiment, generator: np.random.Generator) -> Experiment:
    """Log with noise on every output as in the record ``read``, for its spectrum; a controller's commands are exact."""
    noisy = log
    for channel in model.output_channels:
        if channel in read and not channel.endswith(".command"):
            values = log[channel] + drawn_noise(read, channel, generator)
            noisy = noisy.with_channel(channel, values, read.unit(channel))
    return noisy


def _shown(model: Model, problem: InverseDynamicsProblem, record: int, whole: Motion) -> Array:
    known = Following(whole.parallel, problem.integrators[record])
    return respond(model, model.theta, whole, problem.experiments[record], (), problem.shown, known).seen


def _powers(values: Array) -> Array:
    return np.column_stack([periodogram(column) for column in values.T])


def _smooth(power: Array) -> Array:
    return np.asarray(uniform_filter1d(power, max(3, int(SMOOTHED * power.size)), mode="nearest"))
