"""Noise floor of a residual: instrument noise, and the error of the comparison; structure that noise does not have.

Flexible links ring by noise of the measured motion: that is not white in the residual, and no missing physics. Its size
follows from simulations of the model with noise like that of the records.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np

from vpm.discrepancy.noise.noise_spectrum import NoiseShape, noise_shapes, noise_spectrum, with_noise
from vpm.discrepancy.settings import (
    ABOVE_WHITE,
    DRAWS,
    DRIFTING,
    ENOUGH,
    GROWING,
    NEW,
    QUIET_SHARE,
    SEED,
    THINNED,
)
from vpm.errors import VpmError
from vpm.experiment import Experiment
from vpm.experiment.signal import RETAINED_BAND
from vpm.identify import InverseDynamicsProblem, gaps
from vpm.model import Model
from vpm.numbers import Array
from vpm.simulate import Setup, simulate_arrays


def noise_floor(
    model: Model, validation: InverseDynamicsProblem, residual: Array, mode: str, setup: Setup | None = None
) -> dict[str, float]:
    """Noise floor by channel: root mean square residual that the right model may leave.

    The larger of two. The first is known beforehand. The model predicts the records, in closed loop where that is
    possible, and noise of the measured size is added. The residual of that log is noise and the error of filters and
    steps. Where the model cannot run them so, noise is added to the measured motion once more, and what that changes is
    taken. The largest of several draws counts: a short record in a narrow band holds few numbers, and chance makes
    their mean square large or small. The second comes from the residual: its white part, such as the ripple of a drive
    that no channel shows (see `white_level`). Noise that a drive with states integrated counts too (see
    `noise_shapes`).

    - ``model``: the best model found
    - ``validation``: the records it is judged on
    - ``residual``: its residual there
    - ``mode``: in which the records can be simulated; only "closed_loop" gives whole logs
    """
    generator = np.random.default_rng(SEED)
    logs = validation.experiments
    own = [own_log(model, log, setup) if mode == "closed_loop" else None for log in logs]
    try:
        quiet = validation.on([one or log for one, log in zip(own, logs, strict=True)])
        left = np.array(quiet.evaluate(model, model.theta)[0])
    except VpmError:
        own, quiet, left = [None] * len(logs), validation, np.array(validation.evaluate(model, model.theta)[0])
    for record, one in enumerate(own):
        if one is not None:  # what the model leaves of its own log without noise is the error of filters and steps
            left[_rows(quiet, record)] = 0.0
    found: dict[str, list[float]] = {}
    counted = max(1.0, min(float(block.moving.sum()) for block in quiet.blocks))
    for _ in range(int(np.clip(ENOUGH / counted, 1, DRAWS))):
        pairs = zip(quiet.experiments, logs, strict=True)
        noisy = quiet.on([with_noise(model, one, log, generator) for one, log in pairs])
        for channel, (rms, _, _) in gaps(quiet, noisy.evaluate(model, model.theta)[0] - left).items():
            found.setdefault(channel, []).append(rms)
    white = _white(validation, residual, noise_shapes(model, validation))
    return {channel: max(*several, white.get(channel, 0.0)) for channel, several in found.items()}


def white_level(residual: Array, moving: Array, shape: NoiseShape | None = None) -> float:
    """Root mean square of the white noise in one channel of a residual.

    White noise has the same mean power at every frequency of the retained band, with an exponential distribution. So
    the mean follows from any quantile of the periodogram. A low one is taken, which what follows the motion or stands
    out as a line does not reach.

    - ``residual`` (n,): zero where it does not count
    - ``moving`` (n,): 1 where it counts
    - ``shape``: of noise whose spectrum is not flat, see `noise_shapes`; then the size of that is meant
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


def _white(problem: InverseDynamicsProblem, residual: Array, shapes: tuple[NoiseShape | None, ...]) -> dict[str, float]:
    powers: dict[str, list[tuple[float, float]]] = {}
    for block, shape in zip(problem.blocks, shapes, strict=True):
        size = white_level(residual[block.samples], block.moving, shape) / block.weight
        powers.setdefault(block.channel, []).append((size**2, float(block.moving.sum())))
    return {
        channel: float(np.sqrt(np.average([p for p, _ in v], weights=[max(n, 1e-9) for _, n in v])))
        for channel, v in powers.items()
    }


def own_log(model: Model, experiment: Experiment, setup: Setup | None) -> Experiment | None:
    """Simulated log of the model itself, for its noise floor; None where it cannot follow."""
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
            own = own.with_channel(channel, run.outputs[:, column], experiment.unit(channel))
    return own


def _rows(problem: InverseDynamicsProblem, record: int) -> slice:
    """Rows of one record in a residual."""
    count = len(problem.blocks) // len(problem.motions)
    mine = problem.blocks[record * count :][:count]
    return slice(mine[0].samples.start, mine[-1].samples.stop)


@dataclass(frozen=True)
class Structure:
    """Structure of a residual: tests against white noise, the effort and validation records."""

    above_white: float  #: Ratio of the residual to its white part, on the records where that is smaller.
    #: Rank correlation of its size with that of the effort, in standard deviations: noise of sensors and drives does
    #: not depend on the effort.
    growing: float
    new: float  #: Relative gap on validation records over that on training records.

    @property
    def present(self) -> bool:
        """Whether the residual has more structure than noise."""
        return self.growing > GROWING or self.above_white > ABOVE_WHITE or self.new > NEW


def structure(
    model: Model,
    training: InverseDynamicsProblem,
    validation: InverseDynamicsProblem,
    fitted: Array,
    residual: Array,
) -> Structure:
    """Examine the structure of residuals of a fitted model on training and validation data."""
    training_shapes, validation_shapes = noise_shapes(model, training), noise_shapes(model, validation)
    above_white = min(
        _above_white(training, fitted, training_shapes), _above_white(validation, residual, validation_shapes)
    )
    growing = min(_growing(model, training, fitted), _growing(model, validation, residual))
    known, fresh = gaps(training, fitted), gaps(validation, residual)
    new = max(fresh[c][1] / known[c][1] if known[c][1] > 0.0 else 0.0 for c in fresh)
    return Structure(above_white, growing, new)


def _above_white(problem: InverseDynamicsProblem, residual: Array, shapes: tuple[NoiseShape | None, ...]) -> float:
    """Largest ratio of any channel between its residual and the white noise in it."""
    ratios = []
    for channel in dict.fromkeys(block.channel for block in problem.blocks):
        mine = [(b, s) for b, s in zip(problem.blocks, shapes, strict=True) if b.channel == channel]
        white = sum(white_level(residual[b.samples], b.moving, s) ** 2 * float(b.moving.sum()) for b, s in mine)
        power = sum(float(residual[b.samples] @ residual[b.samples]) for b, _ in mine)
        allowed = 1.0 if channel.endswith(".effort") or mine[0][1] is not None else DRIFTING
        ratios.append(np.sqrt(power / white) / allowed if white > 0.0 else 0.0)
    return float(max(ratios))


def _growing(model: Model, problem: InverseDynamicsProblem, residual: Array) -> float:
    """Rank correlation of the residual's size with the effort, in standard deviations; the largest of all joints."""
    from scipy.stats import spearmanr

    scores = []
    for joint in range(len(problem.joints)):
        sizes, efforts = [], []
        for record in range(len(problem.motions)):
            block = problem.efforts(record)[joint]
            _, applied, _ = problem.effort(model, model.theta, record)
            counted = block.moving > 0.0
            sizes.append(np.abs(residual[block.samples][counted]))
            efforts.append(np.abs(applied[counted, joint]))
        size, effort = np.concatenate(sizes), np.concatenate(efforts)
        if size.size > 2 * THINNED and np.ptp(effort) > 0.0 and np.ptp(size) > 0.0:
            scores.append(float(spearmanr(size, effort).statistic) * np.sqrt(size.size / THINNED))
    return max(scores, default=0.0)
