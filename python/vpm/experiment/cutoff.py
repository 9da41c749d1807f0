"""The cut-off frequency of the motion filter, chosen from the data.

Low cut-off frequencies lose acceleration, high ones let through noise that two derivatives have multiplied by the
square of the frequency. Where the position spectrum stands clearly above its noise floor it is taken for motion,
elsewhere for noise, and the cut-off frequency is the highest one whose expected error of the acceleration is near the
least of all: what follows averages over noise, but nothing brings back motion that was cut off.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vpm.errors import ExperimentError
from vpm.experiment.noise import quantisation_step
from vpm.experiment.signal import MOTION_FILTER_ORDER, differentiator_gain, interpolation_gain
from vpm.numbers import Array

#: A spectrum stands clearly above its floor at this ratio of power (10 dB).
CLEARLY_ABOVE = 10.0

#: Cut-off frequencies that are offered, as shares of the rate.
LOWEST, HIGHEST = 1.0 / 200.0, 0.2

#: The settling of the filter at both ends may take at most half of the record: 4 * 3 rate/cutoff <= N.
SAMPLES_PER_PERIOD = 12

#: Fewest samples from which a cut-off frequency can be chosen: SAMPLES_PER_PERIOD / HIGHEST.
FEWEST_SAMPLES = 60

#: An error of the acceleration that matters to nobody, as a share of its root mean square.
NEGLIGIBLE = 1e-3

#: How far the expected squared error may exceed the least one for the sake of a higher cut-off frequency.
NEAR_BEST = 1.1


@dataclass(frozen=True)
class CutoffChoice:
    """A cut-off frequency and what it rests on."""

    cutoff: float  #: Hz.
    #: Standard deviation of the white noise that the floor of each position spectrum stands for.
    noise: tuple[float, ...]
    #: Highest frequency, up to the highest that is offered, at which each position spectrum stands clearly above its
    #: floor, Hz; zero where it nowhere does.
    band: tuple[float, ...]
    limited: bool  #: The choice is the lowest or the highest frequency that is offered.


def choose_cutoff(
    position: Array, rate: float, read: Sequence[float] | None = None, retained: Sequence[float] | None = None
) -> CutoffChoice:
    """Cut-off frequency for deriving velocity and acceleration from measured positions.

    - ``position``: shape (N, n), one column per joint
    - ``rate``: Hz
    - ``read``: rate at which each joint's position was read, Hz, where its samples in between are interpolated
    - ``retained``: frequency above which a filter took noise from each joint's position, Hz
    - result: one frequency for all joints: the highest whose expected errors, each relative to the best for that joint,
      have a sum near the least
    """
    n = len(position)
    if n < FEWEST_SAMPLES:
        raise ExperimentError(
            f"choosing a cut-off frequency needs at least {FEWEST_SAMPLES} samples, and there are {n}; "
            "record longer, or give the cut-off frequency"
        )
    lowest = min(max(LOWEST, SAMPLES_PER_PERIOD / n), HIGHEST) * rate
    offered = np.geomspace(lowest, HIGHEST * rate, 80)
    total = np.zeros(offered.size)
    noise, band = [], []
    every = (position.T, read or [rate] * position.shape[1], retained or [np.inf] * position.shape[1])
    for column, own, most in zip(*every, strict=True):
        frequency, spectrum, floor = position_spectrum(column, rate, own, most)
        moving = spectrum > CLEARLY_ABOVE * floor
        within = moving & (frequency <= HIGHEST * rate)
        error = _expected_error(frequency, np.where(moving, spectrum - floor, 0.0), spectrum, rate, offered)
        total += error / error.min() if error.min() > 0.0 else np.ones(offered.size)
        noise.append(float(np.sqrt(floor[-1] * 0.5 * rate)))
        band.append(float(frequency[within].max()) if within.any() else 0.0)
    pick = int(np.flatnonzero(total <= NEAR_BEST * total.min())[-1])
    return CutoffChoice(float(offered[pick]), tuple(noise), tuple(band), pick in {0, offered.size - 1})


def position_spectrum(
    position: Array, rate: float, read: float | None = None, retained: float = np.inf
) -> tuple[Array, Array, Array]:
    """Power spectrum of a position for its cut-off, smoothed and one-sided, and the noise floor.

    Welch's method on second differences, divided by their gain ``(2 - 2 cos w)^2``: positions fall so steeply with
    frequency that without this the leakage of the slow motion would drown all the rest.

    - ``position``: shape (N,)
    - ``rate``: Hz
    - ``read``: rate at which the position was read, Hz. What is interpolated says nothing of noise above half of it.
    - ``retained``: frequency above which a filter took the noise, Hz

    - result ``frequency``: shape (F,), Hz, without zero
    - result ``spectrum``: shape (F,), unit of the position squared per hertz
    - result ``floor``: shape (F,), what white noise gives whose level is the median over the top fifth of the
      frequencies that were read and not filtered, and at least that of the quantisation. Its lowest lines are raised by
      the window and the smoothing.
    """
    from scipy.signal import welch

    bend = np.diff(position, 2)
    length = int(np.clip(bend.size // 8, min(bend.size, 256), 4096))
    # Without the mean taken off: of differences it is no offset, and its loss would stand in the lowest line.
    frequency, power = welch(bend, rate, nperseg=length, detrend=False)
    gain = (2.0 - 2.0 * np.cos(2.0 * np.pi * frequency / rate)) ** 2
    # What Hann's window makes of the gain: its spectrum has the powers 1/6, 2/3, 1/6 over three lines.
    seen = np.convolve(np.concatenate([gain[1:2], gain, gain[-2:-1]]), [1.0 / 6.0, 2.0 / 3.0, 1.0 / 6.0], "valid")
    spectrum = _smooth(np.asarray(power[1:], dtype=np.float64)) / gain[1:]
    top = rate if read is None else read
    most = min(0.5 * top, retained)
    top_fifth = (frequency[1:] >= 0.8 * most) & (frequency[1:] <= most)
    kept = 1.0 if top >= rate else interpolation_gain(frequency[1:][top_fifth] / top, smooth=True) ** 2
    level = float(np.median(spectrum[top_fifth] / kept))
    step = quantisation_step(position)
    level = max(level, 0.0 if step is None else step**2 / (6.0 * rate))  # q^2/12 over half of the rate
    return frequency[1:], spectrum, level * _smooth(seen[1:]) / gain[1:]


def _expected_error(frequency: Array, motion: Array, spectrum: Array, rate: float, cutoffs: Array) -> Array:
    """Expected squared error of the acceleration for each cut-off frequency, never less than negligible.

    ``integral of w^4 [(1 - h g)^2 S + (h g)^2 N] df`` with gain ``h`` of the filter, ``g`` of two derivatives,
    spectrum ``S`` of the motion and ``N`` of the noise.
    """
    step = frequency[0]
    noise = spectrum - motion
    fourth = (2.0 * np.pi * frequency) ** 4 * step
    slope = differentiator_gain(frequency, rate) ** 2
    warped = np.tan(np.pi * np.minimum(frequency / rate, 0.4999))
    below = frequency <= HIGHEST * rate  # faster motion is lost at every offered cut-off
    order = 2 * MOTION_FILTER_ORDER
    kept = slope / (1.0 + np.outer(np.tan(np.pi * cutoffs / rate) ** -order, warped**order))
    errors = (1.0 - kept) ** 2 @ (fourth * motion * below) + kept**2 @ (fourth * noise)
    return np.asarray(np.maximum(errors, NEGLIGIBLE**2 * float(np.sum(fourth * motion * below))))


def _smooth(power: Array) -> Array:
    """Spectrum for the cut-off as a running mean over a tenth of each frequency, at least two bins."""
    index = np.arange(power.size)
    half = np.maximum(2, (index + 1) // 10)
    low, high = np.maximum(index - half, 0), np.minimum(index + half + 1, power.size)
    total = np.concatenate([[0.0], np.cumsum(power)])
    return np.asarray((total[high] - total[low]) / (high - low), dtype=np.float64)
