"""How far linear estimates may be trusted when neighbouring residuals resemble each other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len, rfft
from scipy.linalg import solve_toeplitz

Array = NDArray[np.float64]

#: Largest order of the noise's autoregression.
MOST_ORDER = 30
#: Residuals below this share of the effort are rounding.
ROUNDING = 1e-11


def channel_noise(residual: Array, effort: Array, unknowns: int) -> Array:
    """Standard deviation (n,) of each channel's residual (N, n); at least what rounding leaves of its effort."""
    size = np.sqrt(np.mean(effort**2, axis=0))
    count = residual.size / max(residual.size - unknowns, 1)
    spread = np.sqrt(np.mean(residual**2, axis=0) * count)
    return np.asarray(np.maximum(spread, ROUNDING * np.where(size > 0.0, size, 1.0)))


def score_covariance(regressor: Array, residual: Array, records: Sequence[slice]) -> Array:
    """Covariance (k, k) of ``sum_t regressor_t' noise_t`` for noise that is stationary but not white.

    The noise of each channel is an autoregression, its order the one of least BIC, found from the residual by the
    Yule-Walker equations; the innovations of the channels may resemble each other. Its spectra weigh the regressor's
    Fourier transform, ``sum_f X(f)^H S(f) X(f)`` (P. Stoica, R. Moses, *Spectral Analysis of Signals*, 2005, 3.4).

    Parameters
    ----------
    regressor : ndarray, shape (N, n, k)
    residual : ndarray, shape (N, n)
    records : sequence of slice
        Correlation is not carried over from one to the next.
    """
    channels = residual.shape[1]
    models = [autoregression(residual[:, c], records) for c in range(channels)]
    memory = max(len(model) for model in models) - 1
    parts = [
        np.stack(
            [np.convolve(residual[record, c], models[c])[memory : record.stop - record.start] for c in range(channels)],
            axis=1,
        )
        for record in records
    ]
    innovations = np.concatenate(parts)
    spread = innovations.T @ innovations / max(len(innovations), 1)
    total = np.zeros((regressor.shape[2],) * 2)
    for record in records:
        count = record.stop - record.start
        length = next_fast_len(2 * count, real=True)
        turned = rfft(regressor[record], length, axis=0)
        for c, model in enumerate(models):
            turned[:, c] /= rfft(model, length)[:, None].conj()
        weight = np.full(len(turned), 2.0)
        weight[0] = 1.0
        weight[-1] = 1.0 if length % 2 == 0 else 2.0
        colored = np.einsum("cd,fdk->fck", spread, turned) * weight[:, None, None]
        flat, other = turned.reshape(-1, total.shape[0]), colored.reshape(-1, total.shape[0])
        total += np.real(flat.conj().T @ other) / length
    return np.asarray(0.5 * (total + total.T))


def autoregression(residual: Array, records: Sequence[slice]) -> Array:
    """Coefficients ``1, a_1, ... a_p`` of the autoregression of least BIC."""
    count = residual.size
    most = max(0, min(MOST_ORDER, min(record.stop - record.start for record in records) // 10))
    lags = np.zeros(most + 1)
    for record in records:
        part = residual[record]
        lags += [float(part[: part.size - lag] @ part[lag:]) / count for lag in range(most + 1)]
    best, chosen = count * np.log(max(lags[0], 1e-300)), np.ones(1)
    for order in range(1, most + 1):
        if not lags[0] > 0.0:
            break
        found = solve_toeplitz(lags[:order], -lags[1 : order + 1])
        power = lags[0] + float(found @ lags[1 : order + 1])
        if not power > 0.0:
            break
        score = count * np.log(power) + order * np.log(count)
        if score < best:
            best, chosen = score, np.array([1.0, *found])
    return chosen


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
