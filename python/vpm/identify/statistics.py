"""Statistics that hold for residuals whose neighbours resemble each other.

Residuals of a machine are never white: what the model leaves out lasts for many samples. Every interval and every test
here therefore counts blocks or corrects for autocorrelation instead of trusting the number of samples.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
    if n < 4 or power == 0.0:
        return 1
    spectrum = np.abs(np.fft.rfft(centred, 2 * n)) ** 2
    correlation = np.fft.irfft(spectrum)[: limit + 1] / power
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
        score = jacobian[segment] * residual[segment, None]
        meat += score.T @ score
        lags = correlation_length(residual[segment])
        for lag in range(1, lags + 1):
            cross = score[lag:].T @ score[:-lag]
            meat += (1.0 - lag / (lags + 1)) * (cross + cross.T)
    covariance: Array = bread @ meat @ bread
    return 0.5 * (covariance + covariance.T)


@dataclass(frozen=True)
class Gain:
    """How much smaller one residual is than another on the same samples.

    Attributes
    ----------
    before, after : float
        Root mean square of the two residuals.
    score : float
        Mean drop of the squared residual over its standard error between blocks, in standard deviations.
    blocks : int
        Number of blocks the standard error rests on.
    """

    before: float
    after: float
    score: float
    blocks: int

    @property
    def relative(self) -> float:
        """Share of the residual's mean square that is gone (negative: it grew)."""
        return 1.0 - (self.after / self.before) ** 2 if self.before > 0.0 else 0.0


def gain(before: Array, after: Array, segments: Sequence[slice]) -> Gain:
    """Compare two residuals of the same records, block by block.

    Samples of one correlation length are drawn together into a block, so that the standard error of the mean drop
    counts independent pieces (P. Carlstein's non-overlapping block variance, *Annals of Statistics* 14, 1986).

    Parameters
    ----------
    before, after : ndarray, shape (n,)
    segments : sequence of slice
        The records, in the order of the samples.
    """
    drops = np.concatenate([_block_means(before[s] ** 2 - after[s] ** 2, before[s] - after[s]) for s in segments])
    spread = float(drops.std(ddof=1)) / np.sqrt(drops.size) if drops.size > 1 else np.inf
    mean = float(drops.mean())
    score = mean / spread if spread > 0.0 else (np.inf if mean > 0.0 else 0.0)
    return Gain(_rms(before), _rms(after), float(score), int(drops.size))


def _block_means(drop: Array, difference: Array) -> Array:
    """Means of ``drop`` over blocks of two correlation lengths, at least eight blocks to a record."""
    length = min(2 * max(correlation_length(drop), correlation_length(difference)), max(1, drop.size // 8))
    count = max(1, drop.size // length)
    return np.array([piece.mean() for piece in np.array_split(drop, count)])


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else 0.0
