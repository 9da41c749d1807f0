"""Three ways from a weighted regression to parameters and their covariance."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vpm.identify.base_parameters import Base
from vpm.identify.feasibility import Distance, nearest
from vpm.identify.identifiability import column_lengths
from vpm.identify.inertial_noise import score_covariance
from vpm.identify.inertial_regression import InertialRegression

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Solution:
    """Parameters, the covariance of those that are sought in, and how they move the parameters."""

    values: Array
    covariance: Array
    white: Array
    robust: Array
    method: str


def weighted(regression: InertialRegression, noise: Array) -> tuple[Array, Array]:
    """Regressor and effort in units of each channel's noise."""
    return regression.regressor / noise[:, None], regression.effort / noise


def least_squares(columns: Array, right: Array) -> Array:
    """Least squares with columns scaled to equal length."""
    lengths = column_lengths(columns)
    return np.asarray(np.linalg.lstsq(columns / lengths, right, rcond=None)[0] / lengths)


def solve_free(regression: InertialRegression, base: Base, noise: Array, nominal: Array) -> Solution:
    """Base parameters by least squares; single parameters as near to the nominal ones as those allow."""
    table, effort = weighted(regression, noise)
    mine = table[:, :, list(base.kept)]
    columns = mine.reshape(-1, base.rank)
    beta = least_squares(columns, effort.ravel())
    inverse = _inverse(columns)
    robust = inverse @ score_covariance(mine, effort - mine @ beta, regression.slices) @ inverse
    sizes = 1.0 / column_lengths(table.reshape(-1, len(nominal)))
    scaled = base.map * sizes
    spread = sizes[:, None] * np.linalg.pinv(scaled)
    values = nominal + spread @ (beta - base.map @ nominal)
    covariance = spread @ _small_sample(robust, effort.size, base.rank) @ spread.T
    return Solution(values, covariance, np.diag(inverse), np.diag(robust), "least squares in base parameters")


def solve_pulled(regression: InertialRegression, noise: Array, nominal: Array, deviations: Array) -> Solution:
    """Least squares with one more equation for each parameter that is known beforehand."""
    table, effort = weighted(regression, noise)
    count = len(nominal)
    known = np.diag(1.0 / deviations)
    columns = np.vstack([table.reshape(-1, count), known])
    values = nominal + least_squares(columns, np.concatenate([(effort - table @ nominal).ravel(), np.zeros(count)]))
    inverse = _inverse(columns)
    meat = _small_sample(score_covariance(table, effort - table @ values, regression.slices), effort.size, count)
    covariance = inverse @ (meat + known**2) @ inverse
    return Solution(
        values, covariance, np.diag(inverse), np.diag(covariance), "least squares pulled to the nominal values"
    )


def solve_physical(
    regression: InertialRegression, noise: Array, nominal: Array, deviations: Array | None, free: Solution
) -> Solution:
    """Least squares among what bodies can have.

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
    """``(A'A)^-1`` by the singular values of A, columns of equal length."""
    lengths = column_lengths(columns)
    _, values, directions = np.linalg.svd(np.linalg.qr(columns / lengths, mode="r"), full_matrices=False)
    usable = values > 1e-14 * values[0]
    root = directions[usable].T / values[usable] / lengths[:, None]
    return np.asarray(root @ root.T)


def _small_sample(covariance: Array, rows: int, unknowns: int) -> Array:
    return covariance * (rows / max(rows - unknowns, 1))
