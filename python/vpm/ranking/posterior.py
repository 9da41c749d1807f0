"""Posterior probabilities of the next missing effect, and effects that records do not discriminate."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vpm.numbers import Array


def probabilities(gains: Sequence[float], tempering: float) -> Array:
    """Posterior probabilities of each of several effects, and last that none is missing (k + 1,).

    Law: the posterior of models is proportional to their prior odds and a power of their evidence. The power is below
    one where no model is exact (P. Grunwald, *Algorithmic Learning Theory*, 2012).

    Parameters
    ----------
    gains : sequence of float
        Evidence that each effect adds beyond that at which it is as probable as none, nats.
    tempering : float
        The power.
    """
    logarithms = tempering * np.append(gains, 0.0)
    shares = np.exp(logarithms - np.max(logarithms))
    return np.asarray(shares / np.sum(shares))


def robust_probabilities(gains: Sequence[float], tempering: float, astray: float) -> Array:
    """Posterior probabilities of each effect, of none, and of an effect outside of the list (k + 2,).

    Law: a mixture with what knows nothing, as in robust statistics (J. Tukey, *Contributions to Probability and
    Statistics*, 1960), so that evidence that leads astray is no surprise without end.

    Parameters
    ----------
    gains, tempering
        See `probabilities`.
    astray : float
        How often evidence leads astray: then all of these are as probable.
    """
    shares = np.append(probabilities(gains, tempering), 0.0)
    return (1.0 - astray) * shares + astray / len(shares)


def log_volume(slopes: Array) -> float:
    """Log-determinant of ``1 + K' K`` for derivatives K (n, k): posterior volume relative to the prior.

    It is never below zero, however large derivatives are and however alike. Products of them would lose the one.
    """
    widths = np.linalg.svd(np.linalg.qr(slopes, mode="r"), compute_uv=False)
    return float(2.0 * np.sum(np.log(np.hypot(1.0, widths))))


def apart(one: Array, other: Array) -> float:
    """Discrimination beside posteriors: mean difference of two log-densities in nats.

    Law: where one of two models is exact, the logarithm of the ratio of their densities has half of its variance as
    mean (Q. Vuong, *Econometrica* 57, 1989, for the variance). Below a nat or so nobody can choose.
    """
    return 0.5 * len(one) * float(np.var(other - one))
