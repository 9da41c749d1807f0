"""What a residual is like where nothing is missing: an autoregression for each channel, and its likelihood."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_toeplitz

Array = NDArray[np.float64]
#: Stretches of samples that belong together: the records without their beginnings.
Parts = Sequence[slice]

#: Relative noise on the diagonal of the normal equations, so that a residual of a few lines can be predicted.
FLOOR = 1e-9


@dataclass(frozen=True)
class Colour:
    """How the residual of each channel follows from its own past.

    Attributes
    ----------
    filters : tuple of ndarray
        Coefficients of the prediction error, the first one 1.
    deviations : tuple of float
        Standard deviations of these errors.
    """

    filters: tuple[Array, ...]
    deviations: tuple[float, ...]

    def whitened(self, values: Array, parts: Parts) -> Array:
        """Prediction errors of residuals (N, m), or of their derivatives (N, m, k), channel after channel.

        Returns
        -------
        ndarray, shape (n,) or (n, k)
            In standard deviations.
        """
        channels = [
            _filtered(values[:, place], parts, taps) / deviation
            for place, (taps, deviation) in enumerate(zip(self.filters, self.deviations, strict=True))
        ]
        return np.concatenate(channels)


def plain(residual: Array, parts: Parts) -> Colour:
    """Channels as they are, in their root mean squares."""
    one = np.ones(1)
    sizes = [_deviation(_filtered(residual[:, place], parts, one)) for place in range(residual.shape[1])]
    return Colour(tuple(one for _ in sizes), tuple(sizes))


def colour_of(residual: Array, parts: Parts, order: int) -> Colour:
    """The autoregression that predicts each channel best (Yule 1927, Walker 1931)."""
    taps, deviations = [], []
    for place in range(residual.shape[1]):
        products = np.zeros(order + 1)
        for part in parts:
            values = residual[part, place]
            spectrum = np.fft.rfft(values, 2 * len(values))
            products += np.fft.irfft(np.abs(spectrum) ** 2)[: order + 1]
        products[0] = products[0] * (1.0 + FLOOR) + 1e-300
        taps.append(np.concatenate([[1.0], solve_toeplitz(products[:-1], -products[1:])]))
        deviations.append(_deviation(_filtered(residual[:, place], parts, taps[-1])))
    return Colour(tuple(taps), tuple(deviations))


def log_likelihood(colour: Colour, residual: Array, parts: Parts) -> Array:
    """Logarithm of the density of each sample of each channel, one after the other, in the order of `whitened`."""
    errors = colour.whitened(residual, parts)
    share = len(errors) // len(colour.deviations)
    sizes = np.repeat(np.log(colour.deviations), share)
    return np.asarray(-0.5 * (errors**2 + np.log(2.0 * np.pi)) - sizes)


def _filtered(values: Array, parts: Parts, taps: Array) -> Array:
    """Prediction errors of each part, without its first samples, of which the past is unknown."""
    past = len(taps) - 1
    pieces = []
    for part in parts:
        piece = values[part]
        errors = piece[past:].copy()
        for lag in range(1, past + 1):
            errors += taps[lag] * piece[past - lag : len(piece) - lag]
        pieces.append(errors)
    return np.asarray(np.concatenate(pieces))


def _deviation(errors: Array) -> float:
    return max(float(np.sqrt(np.mean(errors**2))), 1e-300)
