"""Noise spectrum of residuals: instrument noise, and noise of a command filtered by its drive.

The command that a valve or a winding receives differs a little from the logged one. Pressures and currents integrate
that difference to a slow disturbance that no effect explains. Its spectrum follows from the model of the drive.
"""

from __future__ import annotations

from dataclasses import replace
from threading import Lock
from weakref import WeakKeyDictionary

import numpy as np
from scipy.ndimage import uniform_filter1d

from vpm.discrepancy.settings import COMMAND_NOISE, DRAWS, NEAR, SEED, SMOOTHED
from vpm.experiment import Experiment, Motion, drawn_noise
from vpm.experiment.signal import RETAINED_BAND as _BAND
from vpm.identify import InverseDynamicsProblem
from vpm.identify.following import Following
from vpm.identify.parts import moves_drives
from vpm.identify.response_along_motion import has_own_drives, respond
from vpm.model import Model
from vpm.numbers import Array

#: Colours worked out last for each problem, with their model: stages of a diagnosis ask for them again.
_KNOWN: WeakKeyDictionary[InverseDynamicsProblem, tuple[Model, tuple[Array | None, ...]]] = WeakKeyDictionary()
_LOCK = Lock()


def noise_shapes(model: Model, problem: InverseDynamicsProblem) -> tuple[Array | None, ...]:
    """Noise spectrum of each block: power by frequency, of instruments and of drives.

    - ``model``: near enough to the machine for the colour of the noise

    For each block in its order. The first row is the noise of the instruments, in units of the weighted residual
    squared per frequency; the second row has an unknown scale. None where no drive colours the noise.
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


def noise_spectrum(residual: Array, shape: Array, quiet: float) -> Array:
    """Noise spectrum of a residual: instruments, and the share of drives that its quiet part shows.

    - ``residual`` (n,)
    - ``shape`` (2, n // 2 + 1): see `noise_shapes`
    - ``quiet``: share of the frequencies that hold no more than noise
    """
    power, (own, drive) = periodogram(residual), shape
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
    return np.asarray(own + high * drive)


def periodogram(residual: Array) -> Array:
    """Noise spectrum under a Hann window: power by frequency, equal to the variance for white noise."""
    window = np.hanning(residual.size)
    return np.asarray(np.abs(np.fft.rfft(residual * window)) ** 2 / float(window @ window))


def _of_record(
    model: Model, problem: InverseDynamicsProblem, record: int, generator: np.random.Generator
) -> list[Array | None]:
    m = problem.motions[record]
    whole = replace(m, edge=0)
    clean = _shown(model, problem, record, whole)
    sizes = COMMAND_NOISE * np.sqrt(np.mean(m.inputs**2, axis=0))
    drives = np.zeros_like(_powers(clean))
    first = record * (len(problem.joints) + len(problem.shown)) + len(problem.joints)
    blocks = problem.blocks[first : first + len(problem.shown)]
    counted = np.column_stack([block.moving for block in blocks])
    for _ in range(DRAWS):
        noisy = whole.inputs + sizes * generator.standard_normal(whole.inputs.shape)
        change = _shown(model, problem, record, replace(whole, inputs=noisy)) - clean
        drives += _powers(change * counted) / DRAWS
    own = _of_instruments(model, problem, record, generator)
    shapes: list[Array | None] = [None] * len(problem.joints)
    for column, block in enumerate(blocks):
        pair = np.array([_smooth(own[column]), _smooth(drives[:, column]) * block.weight**2])
        owner = block.channel.rpartition(".")[0]
        shapes.append(pair if owner in model.actuators and pair[1].any() else None)
    return shapes


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
    known = Following(problem.motions[record].parallel, problem.integrators[record])
    return respond(model, model.theta, whole, problem.experiments[record], (), problem.shown, known).seen


def _powers(values: Array) -> Array:
    return np.column_stack([periodogram(column) for column in values.T])


def _smooth(power: Array) -> Array:
    return np.asarray(uniform_filter1d(power, max(3, int(SMOOTHED * power.size)), mode="nearest"))
