"""Filters, differences and resampling: all of them linear, none of them shifts a signal in time."""

from functools import lru_cache
from math import ceil

import numpy as np

from vpm._core import zero_phase
from vpm.errors import ExperimentError
from vpm.numbers import Array

#: Highest order of one pass of a filter: beyond, sections of second order overflow.
HIGHEST_ORDER = 20

#: Least share of a period of the cut-off frequency that a record has to hold: below, a filter leaves a straight line.
SHORTEST = 1e-2

#: Order of the Butterworth filter of the motion, applied forward and backward.
MOTION_FILTER_ORDER = 4

#: Share of the new Nyquist frequency that the anti-aliasing filter keeps.
RETAINED_BAND = 0.8

#: Ripple of one pass of the anti-aliasing filter, dB.
RIPPLE = 0.05

#: Share of the motion filter's cut-off frequency below which it changes an amplitude by less than 0.1 %.
UNDISTORTED_BAND = 0.4


def lowpass(values: Array, rate: float, cutoff: float, order: int = MOTION_FILTER_ORDER) -> Array:
    """Low-pass signal: zero-phase Butterworth, forward and backward over time.

    The gain is ``1 / (1 + (tan(pi f/rate) / tan(pi cutoff/rate))^(2 order))``: one half at the cut-off frequency
    (A. Oppenheim and R. Schafer, *Discrete-Time Signal Processing*, bilinear transform of the Butterworth prototype,
    squared by the second pass). Both ends are continued by point reflection.

    Parameters
    ----------
    values : ndarray, shape (N,) or (N, C)
    rate : float
        Samples per second, Hz.
    cutoff : float
        Frequency at which half of the amplitude is left, Hz.
    order : int
        Order of one pass.

    Returns
    -------
    ndarray, shape of `values`
    """
    if not 1 <= order <= HIGHEST_ORDER:
        raise ExperimentError(f"a filter of order {order} cannot be had; choose an order from 1 to {HIGHEST_ORDER}")
    _need_samples(values, 4, "filtering")
    check_cutoff(cutoff, rate, len(values))
    from scipy.signal import butter

    sections = butter(order, cutoff / (0.5 * rate), output="sos")
    return _forward_backward(sections, values, 2 * settling_samples(rate, cutoff))


def check_cutoff(cutoff: float, rate: float, samples: int) -> None:
    """Refuse a cut-off frequency that a signal cannot have.

    ``cutoff``, ``rate``: Hz, and samples per second.
    """
    if not 0.0 < cutoff < 0.5 * rate:
        raise ExperimentError(
            f"a cut-off frequency of {cutoff:g} Hz cannot be had at {rate:g} samples per second; "
            f"choose one between 0 and {0.5 * rate:g} Hz"
        )
    if cutoff * samples < SHORTEST * rate:
        raise ExperimentError(
            f"a cut-off frequency of {cutoff:g} Hz is too low for {samples / rate:g} s of record, which hold less "
            f"than {SHORTEST:g} of its period; choose at least {SHORTEST * rate / samples:.3g} Hz"
        )


def settling_samples(rate: float, cutoff: float) -> int:
    """Samples after which a signal filter of order 4 has decayed below 0.1 %.

    Its slowest pair of poles decays as ``exp(-2 pi cutoff sin(pi/8) t)``, which is 7e-4 at ``t = 3/cutoff``.
    """
    return ceil(3.0 * rate / cutoff)


def differentiate(values: Array, dt: float) -> Array:
    """Derivative of a signal by central differences of fourth order.

    ``dy/dt = (y[k-2] - 8 y[k-1] + 8 y[k+1] - y[k+2]) / (12 dt)``, with error ``dt^4 y'''''/30`` (B. Fornberg,
    *Mathematics of Computation* 51, 1988); second order at the two samples next to each end.

    Parameters
    ----------
    values : ndarray, shape (N,) or (N, C)
    dt : float
        Time between samples, s.

    Returns
    -------
    ndarray, shape of `values`
        Unit of the values per second.

    Raises
    ------
    ExperimentError
        Fewer than three samples, or `dt` is not positive.
    """
    if not dt > 0.0:
        raise ExperimentError(f"a derivative needs a positive time between samples, and this one is {dt:g} s")
    _need_samples(values, 3, "a derivative")
    rates: Array = np.gradient(values, dt, axis=0, edge_order=2)
    if len(values) >= 5:
        rates[2:-2] = (values[:-4] - 8.0 * values[1:-3] + 8.0 * values[3:-1] - values[4:]) / (12.0 * dt)
    return rates


def differentiator_gain(frequency: Array, rate: float) -> Array:
    """Gain of a signal's `differentiate` over the true derivative: ``(8 sin w - sin 2w) / (6 w)``."""
    w = 2.0 * np.pi * np.asarray(frequency, dtype=np.float64) / rate
    safe = np.where(w == 0.0, 1.0, w)
    return np.where(w == 0.0, 1.0, (8.0 * np.sin(safe) - np.sin(2.0 * safe)) / (6.0 * safe))


def decimation_for(rate: float, cutoff: float) -> int:
    """Decimation of a signal whose retained band ends where the motion filter begins to act.

    Keeps ``0.8 * rate/2 / d`` at ``0.4 * cutoff``, where the filter has taken 0.07 % of the amplitude; 10 for 100 Hz
    at 1 kHz.
    """
    return max(1, int(RETAINED_BAND * 0.5 * rate / (UNDISTORTED_BAND * cutoff) + 1e-9))


def parallel_filter(values: Array, decimation: int) -> Array:
    """Low-pass a signal and keep every `decimation`-th sample, for residuals and regressors alike.

    A Chebyshev filter of order 8 with 0.05 dB ripple up to 80 % of the new Nyquist frequency, forward and backward.
    Filtering both sides of a linear regression alike leaves its solution unbiased and its residual uncorrelated
    above the retained band (M. Gautier, "Dynamic identification of robots with power model", ICRA 1997).

    - ``values``: shape (N,) or (N, k), uniformly sampled columns
    - ``decimation``: 1 keeps every sample and filters nothing
    - result: ``ceil(N / decimation)`` rows; row ``j`` stands at the time of sample ``j * decimation``

    Raises
    ------
    ExperimentError
        `decimation` is below one, or there are not two samples left to keep.
    """
    if decimation < 1:
        raise ExperimentError(f"a decimation by {decimation} is not possible; give a whole number of at least 1")
    if decimation == 1:
        return np.array(values, dtype=np.float64)
    _need_samples(values, 2 * decimation, f"decimation by {decimation}")
    return _anti_aliased(values, decimation, decimation)


def anti_alias(values: Array, factor: float) -> Array:
    """Anti-aliased signal: zero-phase Chebyshev (order 8, 0.05 dB), 80 % of Nyquist after `factor`.

    An even order takes its ripple from a constant in each pass. It is given back, for friction and gravity are no
    smaller in a record of another rate.
    """
    return np.asarray(_anti_aliased(values, factor, 1) * 10.0 ** (2.0 * RIPPLE / 20.0))


def _anti_aliased(values: Array, factor: float, every: int) -> Array:
    return _forward_backward(_anti_alias_sections(factor), values, ceil(40 * factor), every)


@lru_cache(maxsize=32)
def _anti_alias_sections(factor: float) -> Array:
    """Sections of the signal's anti-alias filter, designed once for each factor."""
    from scipy.signal import cheby1

    return np.asarray(cheby1(8, RIPPLE, RETAINED_BAND / factor, output="sos"), dtype=np.float64)


def interpolation_gain(share: Array, *, smooth: bool) -> Array:
    """Gain of the signal that interpolation draws through readings, over the frequency as a share of their rate.

    Straight lines: ``sinc^2(f)``. Cubic splines: ``sinc^4(f) / sum_k sinc^4(f - k)`` (M. Unser, "Splines: a perfect
    fit for signal and image processing", IEEE Signal Processing Magazine 16(6), 1999).
    """
    if not smooth:
        return np.asarray(np.sinc(share) ** 2)
    own = np.sinc(share) ** 4
    # Both neighbours on each side of the nearest multiple of the rate: the next add less than a thousandth.
    near = np.round(share)
    return np.asarray(own / sum(np.sinc(share - near - k) ** 4 for k in (-2, -1, 0, 1, 2)))


def interpolate(time: Array, values: Array, at: Array, *, smooth: bool) -> Array:
    """Values of a signal at other times of the record.

    - ``time``: shape (N,), increasing, s
    - ``values``: shape (N,) or (N, C)
    - ``at``: shape (M,), s, within `time`
    - ``smooth``: cubic spline through all samples (motion); otherwise straight lines (commands, which jump)
    - result: shape (M,) or (M, C)
    """
    from scipy.interpolate import make_interp_spline

    degree = 3 if smooth and len(time) > 3 else 1
    return np.asarray(make_interp_spline(time, values, k=degree, axis=0)(at), dtype=np.float64)


def _forward_backward(sections: Array, values: Array, padding: int, every: int = 1) -> Array:
    """Filter a signal over the record and back, both ends continued by point reflection; keep every n-th sample.

    As ``scipy.signal.sosfiltfilt``, which takes many times as long for the columns of a regressor.
    """
    x = np.asarray(values, dtype=np.float64)
    kept = zero_phase(sections, x.reshape(len(x), -1), padding, every)
    return kept.reshape(len(kept), *x.shape[1:])


def _need_samples(values: Array, least: int, purpose: str) -> None:
    if len(values) < least:
        raise ExperimentError(f"{purpose} needs at least {least} samples, and there are {len(values)}; record longer")
