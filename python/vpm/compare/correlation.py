"""Correlation of a residual with its own past and with inputs."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vpm.numbers import NORMAL_95, Array
from vpm.results import Storable

#: Most lags that are kept.
MOST_LAGS = 200


@dataclass(frozen=True, repr=False, eq=False)
class Correlation(Storable):
    """Correlation of a residual with its own past or with an input.

    Attributes
    ----------
    of : str
        The residual's own channel, or the input.
    lags : ndarray, shape (L,)
        s; positive where the residual comes later.
    values : ndarray, shape (L,)
        Between -1 and 1.
    band : float
        95 % of the values of an independent signal lie within this distance from zero.
    outside : float
        Share of the lags outside the band, without lag zero of a signal with itself; about 0.05 if there is nothing
        to find.
    """

    _samples = ("lags", "values")

    of: str
    lags: Array
    values: Array
    band: float
    outside: float


def autocorrelation(residual: Array, pieces: Sequence[slice], dt: float, channel: str) -> Correlation:
    """Correlation of a residual with its own past, pooled over contiguous pieces.

    The band ``1.96 / sqrt(N)`` is that of white noise (G. Box and G. Jenkins, *Time Series Analysis*, 1976).

    ``residual``: shape (N,); ``pieces``: contiguous in time; ``dt``: s.
    """
    values = _normalised(residual, residual, pieces, _lags(pieces))[1:]
    half = values.size // 2
    positive = np.concatenate([[1.0], values[half:]]) if values.size else np.ones(1)
    band = NORMAL_95 / np.sqrt(residual.size)
    outside = float(np.mean(np.abs(positive[1:]) > band)) if positive.size > 1 else 0.0
    return Correlation(channel, _times(dt, 0, positive.size), positive, float(band), outside)


def gapped_autocorrelation(residual: Array, dt: float) -> tuple[Array, Array, Array]:
    """Correlation of a residual with its own past over gaps: of the pairs of samples that are both there.

    ``residual``: shape (N,), NaN where there is a gap; ``dt``: s.

    - result ``lags``, ``values``, ``band``: shape (L,), s; between -1 and 1; 95 % of the values of white noise are
      within ``1.96 / sqrt(pairs)`` from zero. Lags that less than half of the samples have pairs for are left out;
      nothing without samples that vary.
    """
    there = np.isfinite(residual)
    centred = np.where(there, residual - residual[there].mean(), 0.0) if there.any() else np.zeros(0)
    power = float(centred @ centred)
    if not power > 0.0:
        return np.zeros(0), np.zeros(0), np.zeros(0)
    most = max(1, min(MOST_LAGS, residual.size // 4))
    ones = there.astype(np.float64)
    pairs = np.array([ones[k:] @ ones[: ones.size - k] for k in range(most + 1)])
    products = np.array([centred[k:] @ centred[: centred.size - k] for k in range(most + 1)])
    enough = np.append(pairs < 0.5 * pairs[0], True)
    last = int(np.argmax(enough))
    values = products[:last] / pairs[:last] * (pairs[0] / power)
    return _times(dt, 0, last), values, NORMAL_95 / np.sqrt(pairs[:last])


def cross_correlation(residual: Array, signal: Array, pieces: Sequence[slice], dt: float, name: str) -> Correlation:
    """Correlation of a residual with an input, over lags of both signs.

    Two signals that both vary slowly resemble each other by chance, so that the band widens with the product of their
    autocorrelations: ``1.96 sqrt(sum_k rho_x(k) rho_y(k) / N)`` (M. Bartlett, *J. Royal Statistical Society* 98, 1935).

    ``residual``, ``signal``: shape (N,); ``name``: the input.
    """
    most = _lags(pieces)
    values = _normalised(residual, signal, pieces, most)
    own = _normalised(residual, residual, pieces, most) * _normalised(signal, signal, pieces, most)
    band = min(1.0, NORMAL_95 * float(np.sqrt(max(1.0, own.sum()) / residual.size)))
    outside = float(np.mean(np.abs(values) > band))
    return Correlation(name, _times(dt, -most, most + 1), values, band, outside)


def effective_samples(residual: Array, pieces: Sequence[slice]) -> float:
    """Number of independent samples of a residual by its correlation: ``N / (1 + 2 sum rho_k)``.

    The sum ends where two neighbouring correlations together are no longer positive (C. Geyer, *Statistical Science* 7,
    1992).

    ``residual``: shape (N,).
    Result: between 1 and N.
    """
    longest = max(piece.stop - piece.start for piece in pieces)
    most = max(0, longest // 2)
    rho = _normalised(residual, residual, pieces, most)[most:]
    pairs = rho[: 2 * (rho.size // 2)].reshape(-1, 2).sum(axis=1)
    negative = np.flatnonzero(pairs <= 0.0)
    total = 2.0 * float(pairs[: negative[0] if negative.size else pairs.size].sum()) - 1.0
    return float(np.clip(residual.size / max(total, 1.0), 1.0, residual.size))


def _lags(pieces: Sequence[slice]) -> int:
    shortest = min(int(piece.stop) - int(piece.start) for piece in pieces)
    return max(1, min(MOST_LAGS, shortest // 4))


def _times(dt: float, first: int, last: int) -> Array:
    return np.arange(first, last, dtype=np.float64) * dt


def _normalised(left: Array, right: Array, pieces: Sequence[slice], most: int) -> Array:
    """Correlation of ``left(t + lag)`` with ``right(t)`` for lags -most ... most, about the means of the whole."""
    a, b = left - left.mean(), right - right.mean()
    scale = float(np.sqrt((a @ a) * (b @ b)))
    total = np.zeros(2 * most + 1)
    if scale == 0.0:
        return total
    for piece in pieces:
        x, y = a[piece], b[piece]
        length = 1 << int(np.ceil(np.log2(x.size + most + 1)))
        product = np.fft.irfft(np.fft.rfft(x, length) * np.conj(np.fft.rfft(y, length)), length)
        total += np.concatenate([product[length - most :], product[: most + 1]]) if most else product[:1]
    return total / scale
