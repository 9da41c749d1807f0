"""Statistics that hold for residuals whose neighbours resemble each other.

Residuals of a machine are never white: what the model leaves out lasts for many samples. Every interval and every test
here therefore counts blocks or corrects for autocorrelation instead of trusting the number of samples.

Two covariances stand here: `robust_covariance`, quick, for the many fits of a search, and `sandwich`, corrected for few
samples, for final estimates.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft
from scipy.linalg import solve_toeplitz
from scipy.special import fdtri

from vpm.identify.identifiability import column_lengths
from vpm.identify.problem import Block
from vpm.numbers import NORMAL_95, Array

#: Largest order of the noise's autoregression.
MOST_ORDER = 30
#: Largest autoregression that scores are freed of: beyond it the correction is larger than what it corrects.
MOST_PERSISTENT = 0.97
#: Least share of a residual that its own fit leaves: one sample that decides a parameter alone says nothing of noise.
LEAST_LEFT = 0.1
#: Variance of a score that counts as none, as of a residual of zeros.
LEAST_SCORE = 1e-200


def correlation_length(residual: Array) -> int:
    """Statistic of a residual: lag in samples beyond which it no longer resembles itself.

    The first lag at which the autocorrelation stays below the 95 % band of white noise, at most a tenth of the record.

    ``residual``: shape (n,).
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
    """Statistical covariance of a least-squares estimate under autocorrelated, unequal residuals.

    The sandwich ``B S B`` with ``B = (J'J)^-1`` and ``S`` the Bartlett-weighted sum of the score autocovariances
    (W. Newey and K. West, *Econometrica* 55, 1987), summed over the records of the fit.

    - ``jacobian``: shape (n, p), derivative of the residual by the parameters, of full column rank
    - ``residual``: shape (n,)
    - ``segments``: one contiguous record each; correlation is not carried over from one to the next
    - result: shape (p, p)
    """
    bread = np.linalg.pinv(jacobian.T @ jacobian, hermitian=True)
    covariance: Array = bread @ _meat(jacobian, residual, segments) @ bread
    return 0.5 * (covariance + covariance.T)


def information_root(jacobian: Array, residual: Array, segments: Iterable[slice]) -> Array:
    """Statistical information of a least-squares estimate: rows R with ``R'R`` the inverse of `robust_covariance`.

    Parameters that the residual does not show have none: columns may be copies of each other. Shape (p, p).
    """
    values, vectors = np.linalg.eigh(_meat(jacobian, residual, segments))
    least = max(float(np.finfo(float).eps * values[-1]), LEAST_SCORE) if len(values) else 0.0
    rows: Array = (vectors / np.sqrt(np.maximum(values, least))).T @ jacobian.T @ jacobian
    return rows


def _meat(jacobian: Array, residual: Array, segments: Iterable[slice]) -> Array:
    """Statistical covariance of the score of a least-squares estimate, summed over segments."""
    meat = np.zeros((jacobian.shape[1], jacobian.shape[1]))
    for segment in segments:
        sums = window_sums(jacobian[segment] * residual[segment, None], correlation_length(residual[segment]) + 1)
        meat += sums.T @ sums
    return meat


def window_sums(score: Array, length: int) -> Array:
    """Sums over windows of ``length`` rows for statistics, also partial ones, over ``sqrt(length)``.

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
    """How much smaller one residual is than another on the same samples, and how sure that is."""

    #: Root mean square of the two residuals.
    before: float
    after: float
    #: Share of the change from one prediction to the other that the data ask for: 1 if the second prediction is right,
    #: 0 if the change has nothing to do with the data.
    weight: float
    score: float  #: That weight in standard deviations.
    pieces: int  #: Independent pieces of the records that the standard deviation rests on.

    @property
    def relative(self) -> float:
        """Statistic of a gain: share of the residual's mean square that is gone (negative: it grew)."""
        return 1.0 - (self.after / self.before) ** 2 if self.before > 0.0 else 0.0

    @property
    def harm(self) -> float:
        """Statistic of harm: standard deviations by which the second residual is larger.

        Where half of the change is asked for, both are equally large: ``after^2 - before^2 = (1 - 2 weight) change^2``.
        """
        if self.score == 0.0:
            return 0.0
        std = abs(self.weight / self.score)
        return (0.5 - self.weight) / std if std > 0.0 else float(np.copysign(np.inf, 0.5 - self.weight))


def gain(before: Array, after: Array, segments: Sequence[slice]) -> Gain:
    """Statistical comparison of two residuals of the same records.

    Does the second model know something that the first does not? The first residual is regressed on the change,
    ``before = weight (before - after) + rest``: the test of forecast encompassing (D. Harvey, S. Leybourne, P. Newbold,
    *J. Business & Economic Statistics* 16, 1998), with the standard deviation of :func:`robust_covariance`.

    ``before``, ``after``: shape (n,); ``segments``: the records, in the order of the samples.
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


def record_groups(blocks: Sequence[Block]) -> list[list[slice]]:
    """Slices of the residual by record for statistics, since channels of a record are disturbed together.

    Channels whose samples are others stand alone.
    """
    groups: dict[tuple[str, int], list[slice]] = {}
    for block in blocks:
        groups.setdefault((block.experiment, block.time.size), []).append(block.samples)
    return list(groups.values())


def sandwich(jacobian: Array, residual: Array, groups: Sequence[Sequence[slice]], exact: Sequence[int] = ()) -> Array:
    """Sandwich statistics: covariance under autocorrelated, unequal residuals, for few samples.

    The sandwich ``B S B`` with ``B = (J'J)^-1``. ``S`` is the long-run covariance of the scores: these are freed of
    their autoregression of first order, weighed as by W. Newey and K. West (*Econometrica* 55, 1987) over the lags of
    their automatic rule, ``4 (n/100)^(2/9)`` (*Review of Economic Studies* 61, 1994), and coloured again (D. Andrews
    and J. Monahan, *Econometrica* 60, 1992). Residuals are divided by the share that the fit leaves of each (HC3: J.
    MacKinnon and H. White, *J. Econometrics* 29, 1985).

    - ``jacobian``: shape (n, p)
    - ``residual``: shape (n,)
    - ``groups``: slices of one length each whose rows belong to the same times; see `record_groups`
    - ``exact``: rows that are as large as their deviation says: independent, and not corrected
    - result: shape (p, p)
    """
    lengths = column_lengths(jacobian)
    bread, scores = _bread_and_scores(jacobian / lengths, residual, exact)
    meat = scores[list(exact)].T @ scores[list(exact)]
    for group in groups:
        meat = meat + _long_run(np.sum([scores[rows] for rows in group], axis=0))
    covariance: Array = bread @ meat @ bread
    return 0.5 * (covariance + covariance.T) / np.outer(lengths, lengths)


def white_sandwich(jacobian: Array, residual: Array) -> Array:
    """Sandwich statistics for independent residuals (n,) of unequal size."""
    bread, scores = _bread_and_scores(jacobian, residual)
    return np.asarray(bread @ (scores.T @ scores) @ bread)


def _bread_and_scores(jacobian: Array, residual: Array, exact: Sequence[int] = ()) -> tuple[Array, Array]:
    """Sandwich statistics' ``(J'J)^-1``, and scores with leverage-corrected residuals."""
    bread = np.asarray(np.linalg.pinv(jacobian.T @ jacobian, hermitian=True), dtype=np.float64)
    left = 1.0 - np.einsum("ij,jk,ik->i", jacobian, bread, jacobian)
    left[list(exact)] = 1.0
    return bread, jacobian * (residual / np.maximum(left, LEAST_LEFT))[:, None]


def freedom(jacobian: Array, blocks: Sequence[Block], unknowns: int) -> Array:
    """Statistical degrees of freedom (p,) of each estimate's variance, at least 1.

    ``(sum q)^2 / sum q^2`` of what stretches of the records share in it, as if all residuals were equally large (F.
    Satterthwaite, *Biometrics* 2, 1946; R. Bell and D. McCaffrey, *Survey Methodology* 28, 2002): few where a few
    moments decide, as those at which friction turns round. A stretch is as long as Bartlett's weights resemble: of
    ``n`` equal samples there are ``3/2 n / (lags + 1)`` (M. Priestley, *Spectral Analysis and Time Series*, 1981, table
    6.1, halved at frequency zero). Samples that do not count and the unknowns take theirs.

    - ``jacobian``: shape (n, p); columns of similar length
    - ``unknowns``: parameters and first states
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
    """Pooled statistics: variances and degrees of freedom with how far noise moves the estimates.

    The sandwich knows whatever disturbed this one log, the draws how noise is spread over it: where a few moments
    decide, one log holds too few of them to tell how large they might have been. Both are weighed by their degrees of
    freedom, unless Fisher's test says that the log was disturbed by more than the noise: then the sandwich is right (T.
    Bancroft, *Annals of Mathematical Statistics* 15, 1944).

    - ``variance``, ``freedom``: shape (p,), of the sandwich
    - ``drawn``: shape (draws, p), errors of the estimates
    - ``level``: of the test
    """
    draws, by_noise = len(drawn), np.mean(drawn**2, axis=0)
    more = variance > by_noise * fdtri(freedom, draws, 1.0 - level)
    together = (freedom * variance + draws * by_noise) / (freedom + draws)
    return np.where(more, variance, together), np.where(more, freedom, freedom + draws)


def _lags(samples: float) -> int:
    """Number of lags for long-run statistics by the automatic rule of Newey and West."""
    return int(np.ceil(4.0 * (samples / 100.0) ** (2.0 / 9.0)))


def _long_run(scores: Array) -> Array:
    """Long-run statistics: covariance (p, p), times the number of samples, of scores (n, p)."""
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


def autoregression(residual: Array, records: Sequence[slice]) -> Array:
    """Statistics of the autoregression of least BIC: coefficients ``1, a_1, ... a_p``."""
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
