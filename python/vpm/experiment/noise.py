"""How noisy a channel is, and in which steps it was recorded."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
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

#: Differences that take the motion out of a spectrum, and pieces of a record that each have one.
ORDER, PIECES = 4, 5
#: Factor within which powers of noise are equal.
ALIKE = 2.0
#: Shares of half of the rate up to which noise may be white below a filter, and bands above in which it falls.
EDGES, ABOVE = (1 / 2, 5 / 8, 3 / 4), 4


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
    what was filtered has none above the filter. A filter of the logger shows in the noise itself.
    """
    ratio = record.rate / record.read_rate(channel)
    below = (frequency * record.rate <= record.retained.get(channel, np.inf)).astype(float)
    if ratio == 1.0:
        return below if channel in record.retained else _left_by_logger(record[channel], frequency)
    return below * interpolation_gain(frequency * ratio, smooth=is_smooth(channel)) ** 2


def _left_by_logger(values: Array, frequency: Array) -> Array:
    """Power of a channel's noise that the filter of its logger has left (n,), as a share of white noise.

    A logger that decimates filters first, and takes the noise next to half of its rate. Motion falls with frequency
    down to the noise of the sensor, which stays as loud. So it was filtered if it falls where it was white before.

    ``values``: shape (N,); ``frequency``: shape (n,), cycles per sample. Result: ones where no such filter shows.
    """
    if len(values) < FEWEST_SAMPLES * PIECES:
        return np.ones(len(frequency))
    for edge in EDGES:
        ends = np.linspace(edge, 1.0, ABOVE + 1)
        powers, _ = band_powers(values, (0.5 * edge, 0.75 * edge, *ends))
        levels, noise = np.median(powers, axis=0), powers[:, :2]
        white = float(np.mean(levels[:2]))
        if np.all(np.max(noise, axis=0) < ALIKE**2 * np.min(noise, axis=0)) and levels[0] < ALIKE * levels[1]:
            left = np.minimum(levels[2:] / white, 1.0) if levels[-1] * ALIKE < white else np.ones(ABOVE)
            return np.asarray(np.interp(frequency, 0.25 * (ends[:-1] + ends[1:]), left, left=1.0))
    return np.ones(len(frequency))


def band_powers(values: Array, ends: Sequence[float]) -> tuple[Array, float]:
    """Power of a channel's noise by piece and band, and that of white noise of variance one.

    ``values``: shape (N,); ``ends``: shares of half of the rate at which bands end.
    """
    pieces = np.array_split(np.diff(values, n=ORDER), PIECES)
    count = len(pieces[-1])
    window = np.hanning(count) ** 3  # its leakage falls fast enough beside noise
    lines = np.array([np.abs(np.fft.rfft(piece[:count] * window)) ** 2 for piece in pieces])
    most = lines.shape[1]
    # Differences weigh white noise by frequency, which is taken out again.
    turns = np.pi * np.arange(1, most) / (2 * (most - 1))
    lines[:, 1:] /= (2.0 * np.sin(turns)) ** (2 * ORDER)
    bands = [lines[:, int(low * most) : int(high * most)] for low, high in pairwise(ends)]
    return np.stack([np.median(band, axis=1) for band in bands], axis=1), float(np.sum(window**2))


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
