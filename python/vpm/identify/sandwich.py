"""Covariance of final estimates whose residuals are neither white nor equally large, also from few samples."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtri

from vpm.identify.problem import Block

Array = NDArray[np.float64]

#: Largest autoregression that scores are freed of: beyond it the correction is larger than what it corrects.
MOST_PERSISTENT = 0.97
#: Least share of a residual that its own fit leaves: one sample that decides a parameter alone says nothing of noise.
LEAST_LEFT = 0.1


def record_groups(blocks: Sequence[Block]) -> list[list[slice]]:
    """Slices of the residual by record: channels of one record are measured at the same times and disturbed together.

    Channels whose samples are others stand alone.
    """
    groups: dict[tuple[str, int], list[slice]] = {}
    for block in blocks:
        groups.setdefault((block.experiment, block.time.size), []).append(block.samples)
    return list(groups.values())


def sandwich(jacobian: Array, residual: Array, groups: Sequence[Sequence[slice]], exact: Sequence[int] = ()) -> Array:
    """Covariance of a least-squares estimate under autocorrelated, unequal residuals, corrected for few samples.

    The sandwich ``B S B`` with ``B = (J'J)^-1``. ``S`` is the long-run covariance of the scores: these are freed of
    their autoregression of first order, weighed as by W. Newey and K. West (*Econometrica* 55, 1987) over the lags of
    their automatic rule, ``4 (n/100)^(2/9)`` (*Review of Economic Studies* 61, 1994), and coloured again (D. Andrews
    and J. Monahan, *Econometrica* 60, 1992). Residuals are divided by the share that the fit leaves of each (HC3: J.
    MacKinnon and H. White, *J. Econometrics* 29, 1985).

    Parameters
    ----------
    jacobian : ndarray, shape (n, p)
        Columns of similar length.
    residual : ndarray, shape (n,)
    groups : sequence of sequence of slice
        Slices of one length each whose rows belong to the same times; see `record_groups`.
    exact : sequence of int
        Rows that are as large as their deviation says: independent, and not corrected.

    Returns
    -------
    ndarray, shape (p, p)
    """
    bread, scores = _bread_and_scores(jacobian, residual, exact)
    meat = scores[list(exact)].T @ scores[list(exact)]
    for group in groups:
        meat = meat + _long_run(np.sum([scores[rows] for rows in group], axis=0))
    covariance: Array = bread @ meat @ bread
    return 0.5 * (covariance + covariance.T)


def white_sandwich(jacobian: Array, residual: Array) -> Array:
    """The same for residuals (n,) that are unequal, but do not know of each other."""
    bread, scores = _bread_and_scores(jacobian, residual)
    return np.asarray(bread @ (scores.T @ scores) @ bread)


def _bread_and_scores(jacobian: Array, residual: Array, exact: Sequence[int] = ()) -> tuple[Array, Array]:
    """``(J'J)^-1``, and the scores with residuals divided by what a fit leaves of each."""
    bread = np.asarray(np.linalg.pinv(jacobian.T @ jacobian, hermitian=True), dtype=np.float64)
    left = 1.0 - np.einsum("ij,jk,ik->i", jacobian, bread, jacobian)
    left[list(exact)] = 1.0
    return bread, jacobian * (residual / np.maximum(left, LEAST_LEFT))[:, None]


def freedom(jacobian: Array, blocks: Sequence[Block], unknowns: int) -> Array:
    """Degrees of freedom (p,) of the variance of each estimate, at least 1.

    ``(sum q)^2 / sum q^2`` of what stretches of the records share in it, as if all residuals were equally large (F.
    Satterthwaite, *Biometrics* 2, 1946; R. Bell and D. McCaffrey, *Survey Methodology* 28, 2002): few where a few
    moments decide, as those at which friction turns round. A stretch is as long as Bartlett's weights resemble: of
    ``n`` equal samples there are ``3/2 n / (lags + 1)`` (M. Priestley, *Spectral Analysis and Time Series*, 1981, table
    6.1, halved at frequency zero). Samples that do not count and the unknowns take theirs.

    Parameters
    ----------
    jacobian : ndarray, shape (n, p)
        Columns of similar length.
    blocks : sequence of Block
    unknowns : int
        Parameters and first states.
    """
    bread = np.linalg.pinv(jacobian.T @ jacobian, hermitian=True)
    decided, shares = (jacobian @ bread) ** 2, []
    for group in record_groups(blocks):
        counts = np.any([block.moving > 0.0 for block in blocks if block.samples in group], axis=0)
        rows = np.sum([decided[samples] for samples in group], axis=0)[counts]
        if len(rows):
            length = (_lags(len(rows)) + 1.0) / 1.5
            shares.append(np.add.reduceat(rows, np.unique(np.arange(0.0, len(rows), length).astype(np.int64))))
    counted = max(float(sum(block.moving.sum() for block in blocks)), 1.0)
    stretches = np.concatenate(shares) if shares else np.zeros((1, decided.shape[1]))
    squares = np.sum(stretches**2, axis=0)
    free = np.sum(stretches, axis=0) ** 2 / np.where(squares > 0.0, squares, 1.0)
    return np.asarray(np.maximum(1.0, max(0.0, 1.0 - unknowns / counted) * free))


def pooled(variance: Array, freedom: Array, drawn: Array, level: float) -> tuple[Array, Array]:
    """Variances of estimates and their degrees of freedom, together with how far draws of noise move the estimates.

    The sandwich knows whatever disturbed this one log, the draws how noise is spread over it: where a few moments
    decide, one log holds too few of them to tell how large they might have been. Both are weighed by their degrees of
    freedom, unless Fisher's test says that the log was disturbed by more than the noise: then the sandwich is right (T.
    Bancroft, *Annals of Mathematical Statistics* 15, 1944).

    Parameters
    ----------
    variance, freedom : ndarray, shape (p,)
        Of the sandwich.
    drawn : ndarray, shape (draws, p)
        Errors of the estimates.
    level : float
        Of the test.
    """
    draws, by_noise = len(drawn), np.mean(drawn**2, axis=0)
    more = variance > by_noise * fdtri(freedom, draws, 1.0 - level)
    together = (freedom * variance + draws * by_noise) / (freedom + draws)
    return np.where(more, variance, together), np.where(more, freedom, freedom + draws)


def _lags(samples: float) -> int:
    """The automatic rule of Newey and West."""
    return int(np.ceil(4.0 * (samples / 100.0) ** (2.0 / 9.0)))


def _long_run(scores: Array) -> Array:
    """Long-run covariance (p, p), times the number of samples, of scores (n, p)."""
    n = len(scores)
    if n < 3:
        return np.asarray(scores.T @ scores)
    powers = np.sum(scores[:-1] ** 2, axis=0)
    products = np.sum(scores[1:] * scores[:-1], axis=0)
    memory = np.clip(products / np.where(powers > 0.0, powers, 1.0), -MOST_PERSISTENT, MOST_PERSISTENT)
    white = scores[1:] - memory * scores[:-1]
    lags = min(_lags(n), n - 2)
    total = white.T @ white
    for lag in range(1, lags + 1):
        products = white[lag:].T @ white[:-lag]
        total = total + (1.0 - lag / (lags + 1.0)) * (products + products.T)
    back = 1.0 / (1.0 - memory)
    return np.asarray(total * np.outer(back, back))
