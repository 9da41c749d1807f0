"""Noise floor of a residual: instrument noise, and the error of the comparison itself."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import partial

import numpy as np

from vpm.discrepancy.noise.noise_spectrum import noise_shapes, noise_spectrum, with_noise
from vpm.errors import VpmError
from vpm.experiment import Experiment, instrument_noise
from vpm.experiment.signal import RETAINED_BAND
from vpm.identify import InverseDynamicsProblem, gaps
from vpm.model import Model
from vpm.numbers import Array
from vpm.simulate import Setup, simulate_arrays

#: Seed of the noise that is carried through; any would do.
SEED = 20160331
#: Share of the frequencies of a residual that hold no more than noise, for the estimate of what is white in it.
QUIET_SHARE = 0.4


def noise_floor(
    model: Model, validation: InverseDynamicsProblem, residual: Array, mode: str, setup: Setup | None = None
) -> dict[str, float]:
    """Noise floor by channel: root mean square residual that the right model would leave.

    The larger of two. The first is known beforehand. The model predicts the records, in closed loop where that is
    possible, and noise of the measured size is added. The residual of that log is noise and the error of filters and
    steps. Where the model cannot run them so, noise is added to the measured motion once more, and what that changes is
    taken. The second comes from the residual: its white part, such as the ripple of a drive that no channel shows (see
    `white_level`). Noise that a drive with states integrated counts too (see `noise_shapes`).

    Parameters
    ----------
    model : Model
        The best model found.
    validation : InverseDynamicsProblem
        The records it is judged on.
    residual : ndarray
        Its residual there.
    mode : str
        In which the records can be simulated; only "closed_loop" gives whole logs.
    setup : Setup, optional
    """
    generator = np.random.default_rng(SEED)
    expected: dict[str, list[tuple[float, int]]] = {}
    for experiment, m, steps in zip(validation.experiments, validation.motions, validation.integrators, strict=True):
        balance = partial(InverseDynamicsProblem, model, cutoff=m.cutoff, band=m.band, integrator=steps)
        own = own_log(model, experiment, setup, generator) if mode == "closed_loop" else None
        change = _balance(model, balance, own) if own is not None else None
        if change is None:
            clean, noisy = balance([experiment]), balance([with_noise(model, experiment, generator)])
            change = clean, noisy.evaluate(model, model.theta)[0] - clean.evaluate(model, model.theta)[0]
        for channel, (rms, _, _) in gaps(*change).items():
            expected.setdefault(channel, []).append((rms**2, change[1].size))
    white = _white(validation, residual, noise_shapes(model, validation))
    return {
        channel: max(float(np.sqrt(np.average([p for p, _ in v], weights=[n for _, n in v]))), white.get(channel, 0.0))
        for channel, v in expected.items()
    }


def white_level(residual: Array, moving: Array, shape: Array | None = None) -> float:
    """Root mean square of the white noise in one channel of a residual.

    White noise has the same mean power at every frequency of the retained band, with an exponential distribution. So
    the mean follows from any quantile of the periodogram. A low one is taken, which what follows the motion or stands
    out as a line does not reach.

    Parameters
    ----------
    residual : ndarray, shape (n,)
        Zero where it does not count.
    moving : ndarray, shape (n,)
        1 where it counts.
    shape : ndarray, optional
        Of noise whose spectrum is not flat, see `noise_shapes`; then the size of that is meant.
    """
    n = residual.size
    count = float(np.count_nonzero(moving))
    if n < 16 or count == 0.0:
        return 0.0
    if shape is not None:
        return float(np.sqrt(2.0 * noise_spectrum(residual, shape, QUIET_SHARE).sum() / count))
    window = np.hanning(n)
    power = np.abs(np.fft.rfft(residual * window)) ** 2 / float(window @ window)
    band = power[1 : max(2, int(RETAINED_BAND * power.size))]
    level = float(np.quantile(band, QUIET_SHARE)) / -np.log(1.0 - QUIET_SHARE)
    return float(np.sqrt(RETAINED_BAND * level * n / count))


def _white(problem: InverseDynamicsProblem, residual: Array, shapes: tuple[Array | None, ...]) -> dict[str, float]:
    powers: dict[str, list[tuple[float, float]]] = {}
    for block, shape in zip(problem.blocks, shapes, strict=True):
        size = white_level(residual[block.samples], block.moving, shape) / block.weight
        powers.setdefault(block.channel, []).append((size**2, float(block.moving.sum())))
    return {
        channel: float(np.sqrt(np.average([p for p, _ in v], weights=[max(n, 1e-9) for _, n in v])))
        for channel, v in powers.items()
    }


def own_log(
    model: Model, experiment: Experiment, setup: Setup | None, generator: np.random.Generator | None = None
) -> Experiment | None:
    """Simulated log of the model itself with generated noise, for its noise floor; None where it cannot follow."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            run = simulate_arrays(model, experiment, "closed_loop", setup=setup)
    except (VpmError, Warning):
        return None
    if len(run.rows) != len(experiment):
        return None
    own = experiment
    for column, channel in enumerate(model.output_channels):
        if channel in experiment:
            values = run.outputs[:, column]
            if generator is not None and not channel.endswith(".command"):  # the controller wrote it: exact
                values = values + instrument_noise(experiment, channel) * generator.standard_normal(values.size)
            own = own.with_channel(channel, values, _unit(experiment, channel))
    return own


def _balance(
    model: Model, balance: Callable[[list[Experiment]], InverseDynamicsProblem], own: Experiment
) -> tuple[InverseDynamicsProblem, Array] | None:
    try:
        problem = balance([own])
        return problem, problem.evaluate(model, model.theta)[0]
    except VpmError:
        return None


def _unit(experiment: Experiment, channel: str) -> str:
    return experiment.units[experiment.channels.index(channel)]
