"""How noisy a channel is, and in which steps it was recorded."""

from __future__ import annotations

from math import sqrt
from typing import TYPE_CHECKING

import numpy as np

from vpm.errors import ExperimentError
from vpm.experiment.grid import is_smooth
from vpm.experiment.signal import RETAINED_BAND, anti_alias, interpolate, interpolation_gain
from vpm.numbers import Array

if TYPE_CHECKING:
    from vpm.experiment.record import Experiment


#: Ratio of the standard deviation of a normal distribution to its median absolute deviation.
NORMAL_MAD = 1.4826

#: Fewest samples from which noise can be told from motion.
FEWEST_SAMPLES = 20


#: Frequencies at which the gain of differences is averaged.
LINES = 1000


def noise_std(values: Array, retained: float = 1.0) -> float:
    """Standard deviation of the white measurement noise of a channel.

    The k-th difference multiplies the power of noise by ``(2 sin(w/2))^2k`` at each frequency, which is ``comb(2k, k)``
    in the mean over all of them, while smooth motion vanishes from it. The median absolute deviation forgives the few
    samples at which the motion is not smooth. The least estimate over the orders 3 to 6 is taken, and it is never below
    that of the quantisation, ``q / sqrt(12)`` (B. Widrow and I. Kollar, *Quantization Noise*, 2008).

    Noise that was filtered before it was recorded is underestimated, unless the filter is known.

    ``values``: shape (N,); ``retained``: share of half of the rate up to which a filter has left the noise.
    Result: unit of the channel; zero for a constant channel.
    """
    if values.size < FEWEST_SAMPLES:
        raise ExperimentError(
            f"a noise level needs at least {FEWEST_SAMPLES} samples, and there are {values.size}; record longer"
        )
    turns = 0.5 * np.pi * retained * (np.arange(LINES) + 0.5) / LINES
    estimates = []
    for order in range(3, 7):
        difference = np.diff(values, order)
        spread = float(np.median(np.abs(difference - np.median(difference))))
        estimates.append(NORMAL_MAD * spread / sqrt(float(np.mean((2.0 * np.sin(turns)) ** (2 * order)))))
    step = quantisation_step(values)
    return max(min(estimates), 0.0 if step is None else step / sqrt(12.0))


def instrument_noise(record: Experiment, channel: str) -> float:
    """Standard deviation of a channel's noise in its readings, of which a record may hold fewer than samples.

    A record that was cut does not say which of its samples these were. Between them there is less noise: interpolation
    takes means of them.

    Result: unit of the channel.
    """
    every, retained = _samples_a_reading(record, channel), _retained(record, channel)
    return max(noise_std(record[channel][first::every], retained) for first in range(every))


def drawn_noise(record: Experiment, channel: str, random: np.random.Generator) -> Array:
    """Noise of a channel (N,), drawn once more: that of its instrument, interpolated and filtered as its values."""
    white = random.standard_normal(len(record.time))
    return instrument_noise(record, channel) * as_read(record, channel, white)


def as_read(record: Experiment, channel: str, values: Array) -> Array:
    """Noise (N,) of a channel from one number a sample: only those of its readings count, interpolated in between.

    Of a channel that was filtered it is filtered, too, and as loud as before.
    """
    every, last, retained = _samples_a_reading(record, channel), len(values) - 1, _retained(record, channel)
    read = np.append(np.arange(0, last, every), last)
    drawn: Array = values[read]
    if retained < 1.0:
        drawn = np.asarray(anti_alias(drawn, RETAINED_BAND / retained) / sqrt(retained))
    if every == 1:
        return drawn
    return interpolate(read.astype(float), drawn, np.arange(last + 1.0), smooth=is_smooth(channel))


def _samples_a_reading(record: Experiment, channel: str) -> int:
    return max(1, round(record.rate / record.read_rate(channel)))


def _retained(record: Experiment, channel: str) -> float:
    """Share of half of the rate of a channel's readings up to which they hold noise."""
    half = 0.5 * record.read_rate(channel)
    return min(1.0, record.retained.get(channel, half) / half)


def read_noise(record: Experiment, channel: str, frequency: Array) -> Array:
    """Power of a channel's noise by frequency (n,), in cycles per sample of the record, as a share of white noise.

    Noise of the readings is white. What is interpolated between two of them has none above half of their rate, and
    what was filtered has none above the filter.
    """
    ratio = record.rate / record.read_rate(channel)
    below = (frequency * record.rate <= record.retained.get(channel, np.inf)).astype(float)
    if ratio == 1.0:
        return below
    return below * interpolation_gain(frequency * ratio, smooth=is_smooth(channel)) ** 2


def quantisation_step(values: Array) -> float | None:
    """Quantisation noise: step of the grid on which all values of a channel lie.

    The greatest common measure of the differences between neighbours (Euclid's algorithm with a tolerance).

    ``values``: shape (N,).
    Result: None where the values lie on no grid coarser than a billionth of their range, or take fewer than five
    levels.
    """
    if np.unique(values).size < 5:
        return None
    differences = np.unique(np.abs(np.diff(values)))
    resolution = 16.0 * np.finfo(np.float64).eps * float(np.max(np.abs(values)))
    smallest = max(1e-9 * float(np.ptp(values)), 4.0 * resolution)
    differences = differences[differences > resolution]
    step = float(differences[0]) if differences.size else 0.0
    for _ in range(64):
        if step < smallest:
            return None
        step, remainder = _measure(step, differences, 2.0 * resolution)
        if remainder is None:
            return step
        step = remainder
    return None


def _measure(step: float, differences: Array, rounding: float) -> tuple[float, float | None]:
    """Quantisation step fitted to noisy multiples, and the first remainder that is none of them.

    Each round takes in multiples ten times larger, which it can count because the last one has sharpened the step.
    """
    reach = 10.0
    while True:
        near = differences[differences < reach * step]
        counts = np.round(near / step)
        remainder = np.abs(near - counts * step)
        off_grid = remainder > 0.02 * step + rounding
        if off_grid.any():
            return step, float(remainder[off_grid].min())
        if near.size:
            step = float(near @ counts / (counts @ counts))
        if near.size == differences.size:
            return step, None
        reach *= 10.0
