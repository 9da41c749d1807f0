"""Whether what a fit leaves is noise: whiteness of a residual, and how much of it the motion explains.

Instruments alone make residuals that are not white: derivatives of counted positions, filters, drifts. What a model
lacks differs from these in that it repeats with the motion. So two tests answer two questions:

- Is the residual white? (G. Ljung and G. Box, "On a measure of lack of fit in time series models", *Biometrika* 65,
  1978.)
- Does it depend on the motion, once its own correlation is taken out? A test of added regressors in the residual of an
  autoregression (J. Ramsey, "Tests for specification errors in classical linear least-squares regression analysis", *J.
  Royal Statistical Society B* 31, 1969; D. Cochrane and G. Orcutt, *J. American Statistical Association* 44, 1949). A
  residual is larger where friction turns round than elsewhere, which an F test takes for a law of the motion. Wald's
  test with a covariance that allows for unequal residuals (HC3: J. MacKinnon and H. White, *J. Econometrics* 29, 1985)
  does not, but calls too much unlikely in small samples (J. Long and L. Ervin, *American Statistician* 54, 2000). So
  both have to say it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr, svd
from scipy.special import chdtrc, fdtrc

from vpm.identify.identifiability import column_lengths
from vpm.identify.problem import FEWEST_SAMPLES
from vpm.identify.statistics import autoregression, white_sandwich
from vpm.numbers import Array
from vpm.results import Storable

#: Columns of which others leave less than this share of their length are left out.
DEPENDENT = 1e-3
#: Share of a signal's size at which a rounded sign bends.
SHARPNESS = 0.05
#: Samples by which laws of effort may come earlier or later.
REACH = 3


@dataclass(frozen=True, repr=False, eq=False)
class Whiteness(Storable):
    """Whiteness of the residual of one channel of one record after a fit, and what motion explains of it.

    Attributes
    ----------
    lags : int
        Of the test of whiteness.
    white : float
        Probability that white noise is as correlated as the residual (Ljung and Box).
    explained : float
        Share of the residual's power that the motion explains, 0 to 1.
    chance : float
        Probability that noise that knows nothing of the motion is explained as well as that.
    visible : float
        Root mean square of what the motion explains, as a share of the measured signal.
    late : float
        By how much later than logged an effort acts, s, where that is less than half a sample and explains as much; 0
        elsewhere.
    """

    experiment: str
    channel: str
    lags: int
    white: float
    explained: float
    chance: float
    visible: float
    late: float = 0.0


def ljung_box(residual: Array, lags: int) -> float:
    """Whiteness test: probability of autocorrelations as large in white noise.

    ``Q = n (n + 2) sum_k r_k^2 / (n - k)`` is chi-square with ``lags`` degrees of freedom for white noise (G. Ljung and
    G. Box, *Biometrika* 65, 1978).

    ``residual``: shape (n,); ``lags``: less than n.
    """
    n, centred = residual.size, residual - residual.mean()
    power = float(centred @ centred)
    if not power > 0.0:
        return 1.0
    shares = np.array([float(centred[k:] @ centred[:-k]) for k in range(1, lags + 1)]) / power
    statistic = n * (n + 2) * float(np.sum(shares**2 / (n - np.arange(1, lags + 1))))
    return float(chdtrc(lags, statistic))


def explained_by(residual: Array, fitted: Array, added: Array, counts: NDArray[np.bool_]) -> tuple[float, float]:
    """Whiteness by added regressors: the share of a residual that they explain, and its probability.

    Residual and regressors pass the whitening filter of the residual's own autoregression before they are compared.

    - ``residual``: shape (n,)
    - ``fitted``: shape (n, p), derivative of the residual by what was fitted: what it explains is not counted
    - ``added``: shape (n, k)
    - ``counts``: shape (n,), samples that count
    """
    old = basis(np.where(counts[:, None], fitted, 0.0))
    new = basis(np.where(counts[:, None], added, 0.0), old)
    columns = np.column_stack([old, new])
    p, k = old.shape[1], new.shape[1]
    # The correlation of the noise is that of what both leave: that of the residual would take the effect for noise.
    noise = np.where(counts, residual - columns @ (columns.T @ residual), 0.0)
    filter_ = autoregression(noise, [slice(0, residual.size)])
    # A sample counts if all that its filter reaches does.
    sound = np.convolve(~counts, np.ones(filter_.size))[: counts.size] < 0.5
    sound[: filter_.size - 1] = False
    n = int(sound.sum())
    if k < 1 or n < 2 * (p + k + filter_.size) + FEWEST_SAMPLES:
        return 0.0, 1.0
    white = np.apply_along_axis(np.convolve, 0, np.column_stack([residual, columns]), filter_)[: counts.size][sound]
    before, _ = _left(white[:, 0], white[:, 1 : p + 1])
    after, weights = _left(white[:, 0], white[:, 1:])
    freedom = n - p - k - (filter_.size - 1)
    ratio = (before - after) / k / max(after / freedom, 1e-300)
    covariance = white_sandwich(white[:, 1:], white[:, 0] - white[:, 1:] @ weights)[p:, p:]
    unequal = weights[p:] @ np.linalg.pinv(covariance, hermitian=True) @ weights[p:] / k
    left = residual - columns @ weights
    share = 1.0 - float(left[counts] @ left[counts]) / max(float(residual[counts] @ residual[counts]), 1e-300)
    return max(0.0, share), float(fdtrc(k, freedom, min(ratio, unequal)))


def explained_size(share: float, residual: Array, weight: float) -> float:
    """Size of what regressors explain in a whiteness test of a residual (n,); nothing without samples."""
    return float(np.sqrt(share * np.mean(residual**2))) / weight if residual.size else 0.0


def _left(target: Array, columns: Array) -> tuple[float, Array]:
    """Sum of squares that columns leave of a target in a whiteness test, and their weights."""
    weights = np.linalg.lstsq(columns, target, rcond=None)[0]
    rest = target - columns @ weights
    return float(rest @ rest), np.asarray(weights, dtype=np.float64)


def basis(columns: Array, others: Array | None = None) -> Array:
    """Orthonormal basis for a whiteness test of what columns add to another basis."""
    scaled = columns / column_lengths(columns)
    if others is not None:
        scaled = scaled - others @ (others.T @ scaled)
    orthogonal, triangle, _ = qr(scaled, mode="economic", pivoting=True)
    return np.asarray(orthogonal[:, np.abs(np.diag(triangle)) > DEPENDENT])


def default_lags(samples: int) -> int:
    """Lags of a test of whiteness, ``10 log10(n)``, at most a fifth of the samples."""
    return max(1, min(round(10.0 * float(np.log10(max(samples, 2)))), samples // 5))


def powers(signal: Array) -> Array:
    """Regressors (n, 4) of a whiteness test: a constant, a signal, its rounded sign and its square with the sign."""
    scaled = signal / (float(np.sqrt(np.mean(signal**2))) or 1.0)
    return np.column_stack([np.ones_like(scaled), scaled, np.tanh(scaled / SHARPNESS), scaled * np.abs(scaled)])


def waves(signal: Array, most: int, each: int) -> list[Array]:
    """Waves for a whiteness test: sines and cosines of a signal (n,) in groups (n, 2 each)."""
    angle = 2.0 * np.pi * (signal - signal.min()) / (float(np.ptp(signal)) or 1.0)
    groups = [np.arange(first, first + each) for first in range(1, most + 1, each)]
    return [np.column_stack([turn(np.outer(angle, group)) for turn in (np.sin, np.cos)]) for group in groups]


def shifted(signal: Array) -> Array:
    """Signal (n,) for a whiteness test up to `REACH` samples earlier and later: (n, 2 REACH + 1)."""
    padded = np.pad(signal, REACH, mode="edge")
    return np.column_stack([padded[k : k + signal.size] for k in range(2 * REACH + 1)])


def heard(late: Array, residual: Array, fitted: Array, counts: NDArray[np.bool_], clear: float) -> Array:
    """Directions of shifted signals clear of noise in a whiteness test, beside what was fitted.

    An effort has in it what the residual is made of: noise of encoders, and all that a drive did without being told,
    to which its controller answers. It is the sum of forces that were fitted and of that. Where the rest of it is
    quiet, a few shifts of it would leave just that, and explain any residual by themselves.

    - ``late``: shape (n, shifts)
    - ``residual``: shape (n,)
    - ``fitted``: shape (n, p), derivative of the residual by what was fitted
    - ``counts``: shape (n,)
    - ``clear``: how many times larger a direction has to be than what those that are leave, per size of the residual's
      channel
    - result: shape (n, k), without what was fitted
    """
    old, columns = basis(fitted * counts[:, None]), late * counts[:, None]
    directions, sizes, _ = svd(columns - old @ (old.T @ columns), full_matrices=False)
    least = clear * np.linalg.norm(columns) / np.sqrt(columns.shape[1] * counts.sum())
    left, known = (residual - old @ (old.T @ residual)) * counts, 0
    while (stand := int(np.sum(sizes > least * np.linalg.norm(left)))) > known:
        fresh, known = directions[:, known:stand], stand
        left = left - fresh @ (fresh.T @ left)
    return np.asarray(directions[:, :known])
