"""Three ways from a weighted regression to parameters and their covariance, and how far these may be trusted."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.fft import next_fast_len, rfft

from vpm.identify.feasibility import Distance, nearest
from vpm.identify.identifiability import Base, column_lengths, least_step
from vpm.identify.inertial_regression import InertialRegression
from vpm.identify.statistics import autoregression
from vpm.numbers import Array

#: Residuals below this share of the effort are rounding.
ROUNDING = 1e-11


@dataclass(frozen=True, eq=False)
class Solution:
    """Parameters, the covariance of those that are sought in, and how they move the parameters."""

    values: Array
    covariance: Array
    white: Array
    robust: Array
    method: str


def weighted(regression: InertialRegression, noise: Array) -> tuple[Array, Array]:
    """Inertial regressor and effort in units of each channel's noise, to be solved."""
    return regression.regressor / noise[:, None], regression.effort / noise


def solve_free(regression: InertialRegression, base: Base, noise: Array, nominal: Array) -> Solution:
    """Solve for base parameters; single inertial parameters as near to the nominal ones as those allow."""
    table, effort = weighted(regression, noise)
    mine = table[:, :, list(base.kept)]
    columns = mine.reshape(-1, base.rank)
    beta = least_step(columns, -effort.ravel())
    inverse = _inverse(columns)
    robust = inverse @ score_covariance(mine, effort - mine @ beta, regression.slices) @ inverse
    sizes = 1.0 / column_lengths(table.reshape(-1, len(nominal)))
    scaled = base.map * sizes
    spread = sizes[:, None] * np.linalg.pinv(scaled)
    values = nominal + spread @ (beta - base.map @ nominal)
    covariance = spread @ _small_sample(robust, effort.size, base.rank) @ spread.T
    return Solution(values, covariance, np.diag(inverse), np.diag(robust), "least squares in base parameters")


def solve_pulled(regression: InertialRegression, noise: Array, nominal: Array, deviations: Array) -> Solution:
    """Solve for inertial parameters with one more equation for each that is known beforehand."""
    table, effort = weighted(regression, noise)
    count = len(nominal)
    known = np.diag(1.0 / deviations)
    columns = np.vstack([table.reshape(-1, count), known])
    values = nominal + least_step(columns, np.concatenate([(table @ nominal - effort).ravel(), np.zeros(count)]))
    inverse = _inverse(columns)
    meat = _small_sample(score_covariance(table, effort - table @ values, regression.slices), effort.size, count)
    covariance = inverse @ (meat + known**2) @ inverse
    return Solution(
        values, covariance, np.diag(inverse), np.diag(covariance), "least squares pulled to the nominal values"
    )


def solve_physical(
    regression: InertialRegression, noise: Array, nominal: Array, deviations: Array | None, free: Solution
) -> Solution:
    """Solve for inertial parameters among what bodies can have.

    Deviations stay those without the constraint. In the norm of the data an estimate in a convex set is no farther from
    any truth in that set than the free one, while deviations at the border itself would promise far too much.
    """
    table, effort = weighted(regression, noise)
    count = len(nominal)
    # The triangle of a QR factorisation stands for all samples, whatever their number.
    triangle = np.asarray(np.linalg.qr(np.column_stack([table.reshape(-1, count), effort.ravel()]), mode="r"))
    known = np.zeros((count, count)) if deviations is None else np.diag(1.0 / deviations)
    columns = np.vstack([triangle[:, :count], known])
    values = nearest(columns, np.concatenate([triangle[:, count], known @ nominal]), Distance(regression))
    return replace(free, values=values, method=f"{free.method}, among feasible parameters")


def _inverse(columns: Array) -> Array:
    """Inverse ``(A'A)^-1`` for an inertial solution by the singular values of A."""
    lengths = column_lengths(columns)
    _, values, directions = np.linalg.svd(np.linalg.qr(columns / lengths, mode="r"), full_matrices=False)
    usable = values > 1e-14 * values[0]
    root = directions[usable].T / values[usable] / lengths[:, None]
    return np.asarray(root @ root.T)


def _small_sample(covariance: Array, rows: int, unknowns: int) -> Array:
    return covariance * (rows / max(rows - unknowns, 1))


def channel_noise(residual: Array, effort: Array, unknowns: int) -> Array:
    """Noise deviation (n,) of each channel's inertial residual (N, n); at least rounding."""
    size = np.sqrt(np.mean(effort**2, axis=0))
    count = residual.size / max(residual.size - unknowns, 1)
    spread = np.sqrt(np.mean(residual**2, axis=0) * count)
    return np.asarray(np.maximum(spread, ROUNDING * np.where(size > 0.0, size, 1.0)))


def score_covariance(regressor: Array, residual: Array, records: Sequence[slice]) -> Array:
    """Covariance (k, k) of ``sum_t regressor_t' noise_t`` for an inertial solution; noise need not be white.

    The noise of each channel is an autoregression, its order the one of least BIC, found from the residual by the
    Yule-Walker equations; the innovations of the channels may resemble each other. Its spectra weigh the regressor's
    Fourier transform, ``sum_f X(f)^H S(f) X(f)`` (P. Stoica, R. Moses, *Spectral Analysis of Signals*, 2005, 3.4).

    - ``regressor``: shape (N, n, k)
    - ``residual``: shape (N, n)
    - ``records``: correlation is not carried over from one to the next
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


def effective_samples(white: Array, robust: Array, rows: int) -> float:
    """Effective number of equations in an inertial solution under autocorrelated noise.

    ``white``, ``robust``: shape (k,), variances of the estimates, were the noise independent, and as they are.
    """
    ratio = np.where(robust > 0.0, white / np.where(robust > 0.0, robust, 1.0), 1.0)
    return float(rows * min(1.0, np.exp(np.mean(np.log(np.maximum(ratio, 1e-12)))))) if ratio.size else float(rows)
