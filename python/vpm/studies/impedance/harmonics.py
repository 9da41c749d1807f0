"""Fourier series of periodic channels by least squares: any start, any drift, no window."""

from dataclasses import dataclass

import numpy as np

from vpm.numbers import Array, Complex


@dataclass(frozen=True)
class Series:
    """``y = drift + Re sum_n Y_n exp(i n omega (t - t0))``."""

    amplitudes: Complex  #: Shape (H,); Y_1 ... Y_H.
    drift: Array  #: Shape (N,); mean and drift at the samples.
    mean: float  #: Of the drift.
    noise: float  #: Standard deviation of what the series leaves.


def basis(time: Array, frequency: float, count: int) -> Array:
    """Columns cos, sin of harmonics 1 ... count, shape (N, 2 count)."""
    angle = 2.0 * np.pi * frequency * np.outer(time - time[0], np.arange(1, count + 1))
    return np.concatenate([np.cos(angle), np.sin(angle)], axis=1)


def fourier(time: Array, values: Array, frequency: float, count: int, drift: int) -> Series:
    """Harmonics of a periodic channel: a Fourier series fitted beside a polynomial drift.

    ``time``, ``values``: shape (N,); ``frequency``: Hz; ``count``: harmonics; ``drift``: degree of the polynomial.
    """
    waves = basis(time, frequency, count)
    scaled = 2.0 * (time - time[0]) / (time[-1] - time[0]) - 1.0
    slow = np.polynomial.legendre.legvander(scaled, drift)
    matrix = np.concatenate([slow, waves], axis=1)
    found = np.linalg.lstsq(matrix, values, rcond=None)[0]
    left = values - matrix @ found
    free = max(values.size - matrix.shape[1], 1)
    cosines, sines = np.split(found[drift + 1 :], 2)
    trend = slow @ found[: drift + 1]
    return Series(cosines - 1j * sines, trend, float(trend.mean()), float(np.sqrt(left @ left / free)))


def evaluate(amplitudes: Complex, phase: Array) -> Array:
    """Sum of harmonics, ``Re sum_n Y_n exp(i n phase)``, shape of `phase`."""
    orders = np.arange(1, amplitudes.size + 1)
    return np.asarray((np.exp(1j * np.outer(phase, orders)) @ amplitudes).real)


def fundamental(time: Array, values: Array) -> float:
    """Frequency (Hz) of the strongest line, refined by the best fit of up to eight harmonics beside a drift."""
    from scipy.optimize import minimize_scalar

    even = np.linspace(time[0], time[-1], time.size)
    line = np.polynomial.polynomial.Polynomial.fit(time, values, 1)
    flat = np.interp(even, time, values - line(time)) * np.hanning(time.size)
    spectrum = np.abs(np.fft.rfft(flat, 8 * time.size))
    lines = np.fft.rfftfreq(8 * time.size, even[1] - even[0])
    peak = float(lines[np.argmax(spectrum)])
    width = 0.5 / float(time[-1] - time[0])

    # As many harmonics as the samples carry: those that the fit lacks would pull at the frequency.
    count = min(max(int(0.25 / (peak * float(even[1] - even[0]))), 1), 8)

    def left(frequency: float) -> float:
        return fourier(time, values, float(frequency), count, 1).noise

    low = max(peak - width, 0.2 * width)
    return float(minimize_scalar(left, bounds=(low, peak + width), method="bounded", options={"xatol": 1e-7 * peak}).x)
