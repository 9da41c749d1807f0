"""Statistics that hold for residuals whose neighbours resemble each other.

Residuals of a machine are never white: what the model leaves out lasts for many samples. Every interval and every test
here therefore counts blocks or corrects for autocorrelation instead of trusting the number of samples.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft

Array = NDArray[np.float64]

#: Two-sided 95 % quantile of the normal distribution.
NORMAL_95 = 1.959963984540054


def correlation_length(residual: Array) -> int:
    """Lag in samples beyond which a residual no longer resembles itself.

    The first lag at which the autocorrelation stays below the 95 % band of white noise, at most a tenth of the record.

    Parameters
    ----------
    residual : ndarray, shape (n,)

    Returns
    -------
    int
        At least 1.
    """
    n = residual.size
    centred = residual - residual.mean()
    power = float(centred @ centred)
    limit = max(1, n // 10)
    if n < 4 or power == 0.0 or not np.isfinite(power):
        return 1  # of a simulation that has run away no square is a number
    padded = next_fast_len(n + limit, real=True)
    spectrum = np.abs(rfft(centred, padded)) ** 2
    correlation = irfft(spectrum, padded)[: limit + 1] / power
    outside = np.flatnonzero(np.abs(correlation) > NORMAL_95 / np.sqrt(n))
    gaps = np.flatnonzero(np.diff(outside) > 1)
    last = outside[gaps[0]] if gaps.size else outside[-1]
    return int(min(limit, last + 1))


def robust_covariance(jacobian: Array, residual: Array, segments: Iterable[slice]) -> Array:
    """Covariance of a least-squares estimate under autocorrelated, unequal residuals.

    The sandwich ``B S B`` with ``B = (J'J)^-1`` and ``S`` the Bartlett-weighted sum of the score autocovariances
    (W. Newey and K. West, *Econometrica* 55, 1987), summed over the records of the fit.

    Parameters
    ----------
    jacobian : ndarray, shape (n, p)
        Derivative of the residual by the parameters, of full column rank.
    residual : ndarray, shape (n,)
    segments : iterable of slice
        One contiguous record each; correlation is not carried over from one to the next.

    Returns
    -------
    ndarray, shape (p, p)
    """
    bread = np.linalg.pinv(jacobian.T @ jacobian, hermitian=True)
    meat = np.zeros_like(bread)
    for segment in segments:
        sums = window_sums(jacobian[segment] * residual[segment, None], correlation_length(residual[segment]) + 1)
        meat += sums.T @ sums
    covariance: Array = bread @ meat @ bread
    return 0.5 * (covariance + covariance.T)


def window_sums(score: Array, length: int) -> Array:
    """Sums over all windows of ``length`` rows, those that hang over the ends too, divided by ``sqrt(length)``.

    Two rows ``l`` apart share ``length - l`` windows, so the products of these sums carry the Bartlett weights
    ``1 - l/length`` without a loop over lags.
    """
    total = np.zeros((len(score) + 2 * length, score.shape[1]))
    np.cumsum(score, axis=0, out=total[length : length + len(score)])
    total[length + len(score) :] = total[length + len(score) - 1]
    sums: Array = (total[length:] - total[:-length]) / np.sqrt(length)
    return sums


@dataclass(frozen=True)
class Gain:
    """How much smaller one residual is than another on the same samples, and how sure that is.

    Attributes
    ----------
    before, after : float
        Root mean square of the two residuals.
    weight : float
        Share of the change from one prediction to the other that the data ask for: 1 if the second prediction is
        right, 0 if the change has nothing to do with the data.
    score : float
        That weight in standard deviations.
    pieces : int
        Independent pieces of the records that the standard deviation rests on.
    """

    before: float
    after: float
    weight: float
    score: float
    pieces: int

    @property
    def relative(self) -> float:
        """Share of the residual's mean square that is gone (negative: it grew)."""
        return 1.0 - (self.after / self.before) ** 2 if self.before > 0.0 else 0.0

    @property
    def harm(self) -> float:
        """By how many standard deviations the second residual is the larger one (negative: the smaller one).

        Where half of the change is asked for, both are equally large: ``after^2 - before^2 = (1 - 2 weight) change^2``.
        """
        if self.score == 0.0:
            return 0.0
        std = abs(self.weight / self.score)
        return (0.5 - self.weight) / std if std > 0.0 else float(np.copysign(np.inf, 0.5 - self.weight))


def gain(before: Array, after: Array, segments: Sequence[slice]) -> Gain:
    """Compare two residuals of the same records.

    Does the second model know something that the first does not? The first residual is regressed on the change,
    ``before = weight (before - after) + rest``: the test of forecast encompassing (D. Harvey, S. Leybourne, P. Newbold,
    *J. Business & Economic Statistics* 16, 1998), with the standard deviation of :func:`robust_covariance`.

    Parameters
    ----------
    before, after : ndarray, shape (n,)
    segments : sequence of slice
        The records, in the order of the samples.
    """
    change = before - after
    power = float(change @ change)
    lengths = [correlation_length(change[s] * before[s]) for s in segments]
    pieces = sum(max(1, (s.stop - s.start) // length) for s, length in zip(segments, lengths, strict=True))
    if power <= 1e-24 * float(before @ before):
        return Gain(_rms(before), _rms(after), 0.0, 0.0, pieces)
    weight = float(change @ before) / power
    variance = robust_covariance(change[:, None], before - weight * change, segments)[0, 0]
    score = weight / np.sqrt(variance) if variance > 0.0 else np.inf
    return Gain(_rms(before), _rms(after), weight, float(score), pieces)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else 0.0
