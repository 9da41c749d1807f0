"""The difference equation of the element and what its parameters do to it, as filters over whole records."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from vpm.numbers import Array

Scheme = Literal["trapezoidal", "printed", "central_mean"]


@dataclass(frozen=True)
class Weights:
    """``(alpha + beta r) F[k] = E + r (K + k1) ds + (gamma + delta r) F[k - lag]``, ``r = tau / h``."""

    lag: int
    alpha: float
    beta: float
    gamma: float
    delta: float


#: The three forms of D'Imperio (2016), equations 5.45 to 5.52, beside the core's `MaxwellScheme`.
WEIGHTS: dict[Scheme, Weights] = {
    "trapezoidal": Weights(1, 0.5, 1.0, -0.5, 1.0),
    "printed": Weights(2, 1.0, 0.5, 0.0, 0.5),
    "central_mean": Weights(2, 0.5, 0.5, -0.5, 0.5),
}


def seen(scheme: Scheme, values: Array) -> Array:
    """Part of a quantity that the recursion of sample k sees; nothing in the samples of the start."""
    out = np.zeros_like(values)
    if scheme == "trapezoidal":
        out[1:] = 0.5 * (values[1:] + values[:-1])
    else:
        out[2:] = values[1:-1]
    return out


def stretch(scheme: Scheme, length: Array) -> Array:
    """Stretch over one step that the recursion of sample k sees, m, shape (N,)."""
    out = np.zeros_like(length)
    if scheme == "trapezoidal":
        out[1:] = np.diff(length)
    elif scheme == "printed":
        out[2:] = length[1:-1] - length[:-2]
    else:
        out[2:] = 0.5 * (length[2:] - length[:-2])
    return out


@dataclass(frozen=True)
class Recursion:
    """The equation at one relaxation time."""

    scheme: Scheme  #: One of "trapezoidal", "printed", "central_mean".
    ratio: float  #: ``tau / h``.

    @property
    def weights(self) -> Weights:
        """Weights of the recursion's scheme."""
        return WEIGHTS[self.scheme]

    def filtered(self, right: Array) -> Array:
        """Solution of the recursion ``(alpha + beta r) y[k] = right[k] + (gamma + delta r) y[k - lag]``."""
        from scipy.signal import lfilter

        w, r = self.weights, self.ratio
        denominator = np.zeros(w.lag + 1)
        denominator[0], denominator[-1] = w.alpha + w.beta * r, -(w.gamma + w.delta * r)
        return np.asarray(lfilter([1.0], denominator, right, axis=0), dtype=np.float64)

    def start_responses(self, samples: int) -> Array:
        """Response of the recursion to each starting force of 1 N, shape (N, lag)."""
        w = self.weights
        right = np.zeros((samples, w.lag))
        right[np.arange(w.lag), np.arange(w.lag)] = w.alpha + w.beta * self.ratio
        return self.filtered(right)

    def lagged(self, values: Array) -> Array:
        """Values of the recursion one lag ago, zero at the start."""
        out = np.zeros_like(values)
        out[self.weights.lag :] = values[: -self.weights.lag]
        return out

    def by_ratio(self, force: Array, rate: Array) -> Array:
        """Derivative of the recursion's force by ``r``, where ``rate = (K + k1) ds``."""
        w = self.weights
        right = rate + w.delta * self.lagged(force) - w.beta * force
        right[: w.lag] = 0.0
        return self.filtered(right)


def surface_columns(drive: Array, length: Array) -> Array:
    """Monomials of the recursion ``1, u, s, u^2, u s, s^2, u^3, u^2 s, u s^2, s^3``, shape (N, 10)."""
    return np.column_stack([drive**i * length**j for i, j in POWERS])


#: Powers of u and s in the order of the core's maps.
POWERS = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3))
#: The same in words.
POWER_NAMES = ("1", "u", "s", "u^2", "u*s", "s^2", "u^3", "u^2*s", "u*s^2", "s^3")
