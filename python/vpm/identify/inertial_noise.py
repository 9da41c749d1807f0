"""How far linear estimates may be trusted when neighbouring residuals resemble each other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vpm.identify.identifiability import column_lengths
from vpm.identify.statistics import correlation_length, window_sums

Array = NDArray[np.float64]

#: Largest autoregressive coefficient that is taken out of scores: closer to one the way back loses all digits.
LARGEST_ROOT = 0.97
#: Residuals below this share of the effort are rounding.
ROUNDING = 1e-11


def channel_noise(residual: Array, effort: Array, unknowns: int) -> Array:
    """Standard deviation (n,) of each channel's residual (N, n); at least what rounding leaves of its effort."""
    size = np.sqrt(np.mean(effort**2, axis=0))
    count = residual.size / max(residual.size - unknowns, 1)
    spread = np.sqrt(np.mean(residual**2, axis=0) * count)
    return np.maximum(spread, ROUNDING * np.where(size > 0.0, size, 1.0))


def score_covariance(regressor: Array, residual: Array, records: Sequence[slice]) -> Array:
    """Covariance (k, k) of ``sum_t regressor_t' residual_t``, whatever the noise's spectrum and its size along the way.

    The channels of one sample are summed first, so that noise which they share is counted. The scores are whitened by an
    autoregression of order one each, the rest is summed with Bartlett weights (W. Newey and K. West, *Econometrica* 55,
    1987), and the whitening is undone (D. Andrews and J. Monahan, *Econometrica* 60, 1992): without it those weights cut
    off slow noise and intervals are too short.

    Parameters
    ----------
    regressor : ndarray, shape (N, n, k)
    residual : ndarray, shape (N, n)
    records : sequence of slice
        Correlation is not carried over from one to the next.
    """
    count = regressor.shape[2]
    # In orthogonal directions the whitening mixes nothing: what single scores say of nearly parallel columns is lost.
    lengths = column_lengths(regressor.reshape(-1, count))
    basis, triangle = np.linalg.qr(regressor.reshape(-1, count) / lengths)
    basis, triangle = basis.reshape(*residual.shape, -1), triangle * lengths
    total = np.zeros((basis.shape[2],) * 2)
    for record in records:
        score = np.einsum("tck,tc->tk", basis[record], residual[record])
        power = np.sum(score[:-1] ** 2, axis=0)
        root = np.sum(score[1:] * score[:-1], axis=0) / np.where(power > 0.0, power, 1.0)
        root = np.clip(root, -LARGEST_ROOT, LARGEST_ROOT)
        white = score.copy()
        white[1:] -= root * score[:-1]
        white[0] *= np.sqrt(1.0 - root**2)
        length = max((correlation_length(column) for column in white.T), default=1)
        sums = window_sums(white, length + 1)
        back = 1.0 / (1.0 - root)
        total += back[:, None] * (sums.T @ sums) * back
    covariance: Array = triangle.T @ total @ triangle
    return covariance


def effective_samples(white: Array, robust: Array, rows: int) -> float:
    """Equations that independent noise would need for the same intervals: ``rows`` times the mean ratio of variances.

    Parameters
    ----------
    white, robust : ndarray, shape (k,)
        Variances of the estimates, were the noise independent, and as they are.
    rows : int
        Equations.
    """
    ratio = np.where(robust > 0.0, white / np.where(robust > 0.0, robust, 1.0), 1.0)
    return float(rows * min(1.0, np.exp(np.mean(np.log(np.maximum(ratio, 1e-12)))))) if ratio.size else float(rows)
