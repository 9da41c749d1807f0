"""The regressions of the thesis as they are printed, for reproduction: what they give and why it is no stiffness."""

import numpy as np
from numpy.typing import ArrayLike

from vpm.errors import IdentificationError
from vpm.numbers import Array


def static_regressors(force: ArrayLike, length: ArrayLike, step: float) -> tuple[Array, Array]:
    """Printed regressors ``s[k], F[k-1] / (2 h), 1`` and forces ``F[k+1]`` of D'Imperio (2016), eq 5.56.

    ``force``, ``length``: shape (N,), N and m; ``step``: h, s.

    - result ``columns``: shape (N - 2, 3)
    - result ``forces``: shape (N - 2,)
    """
    f, s = _pair(force, length)
    return np.column_stack([s[1:-1], f[:-2] / (2.0 * step), np.ones(f.size - 2)]), f[2:]


def static_rank(force: ArrayLike, length: ArrayLike, step: float) -> int:
    """Rank of the printed static regression; 3 is needed for k0, s0 and tau, one pose has 2 at most.

    Parameters
    ----------
    force, length : array-like, shape (N,)
    step : float
        s.
    """
    columns, _ = static_regressors(force, length, step)
    sizes = np.linalg.norm(columns, axis=0)
    return int(np.linalg.matrix_rank(columns / np.where(sizes > 0.0, sizes, 1.0), tol=1e-9 * np.sqrt(len(columns))))


def minimum_norm_static(force: ArrayLike, length: ArrayLike, step: float) -> tuple[float, float, float]:
    """Printed "right pseudo-inverse" of D'Imperio (2016), eq 5.57 and 5.58: an artefact, for reproduction.

    With constant length, the minimum-norm solution shares the force among linearly dependent columns, in
    proportion to their size: ``s0 = -1/s`` and, at rest, ``k0 = F s / (s^2 + 1)``, whatever the element is. Use
    `static_windows` for stiffness and free length.

    Parameters
    ----------
    force, length : array-like, shape (N,)
        3 or 4 samples, which make one or two equations for three unknowns.
    step : float
        s.

    Returns
    -------
    tuple of three floats
        "k0" in N/m, "s0" in m, "tau" in s.

    Raises
    ------
    IdentificationError
        More samples: then the equations determine a left pseudo-inverse, and the right one does not exist.
    """
    columns, forces = static_regressors(force, length, step)
    if len(forces) > 2:
        raise IdentificationError(
            f"{len(forces)} equations for three unknowns have no minimum-norm solution; give 3 or 4 samples, or take "
            "static_windows"
        )
    a1, a2, a3 = np.linalg.pinv(columns, rcond=1e-12) @ forces
    left = 1.0 - a2 / (2.0 * step)
    return float(a1 / left), float(-a3 / a1), float(a2 / left)


def printed_dynamic_regression(
    force: ArrayLike, length: ArrayLike, elastic: ArrayLike, k0: float, step: float
) -> tuple[float, float]:
    """k1 and c1 by the least squares of D'Imperio (2016), eq 5.63 to 5.66, as corrected.

    Columns ``F_el = k0 (s - s0)`` (without the factor D, which the print counts twice), ``ds/dt`` and
    ``F[k-1] / (2 h)`` with coefficients ``D``, ``tau (k0 + k1) D`` and ``tau D``; then 5.66 as three equations for k1
    and c1, solved by least squares. The measured force stands among the columns, so that its noise biases the result:
    errors in variables. Use `dynamic_windows` for measured records.

    Parameters
    ----------
    force, length, elastic : array-like, shape (N,)
        N, m, N.
    k0 : float
        N/m.
    step : float
        s.

    Returns
    -------
    k1, c1 : float
        N/m and N s/m.

    Raises
    ------
    IdentificationError
        The length does not move, or the arrays do not fit.
    """
    f, s = _pair(force, length)
    e, _ = _pair(elastic, length)
    columns = np.column_stack([e[1:-1], (s[1:-1] - s[:-2]) / step, f[:-2] / (2.0 * step)])
    sizes = np.linalg.norm(columns, axis=0)
    if sizes.min() == 0.0 or np.linalg.matrix_rank(columns / sizes, tol=1e-12 * len(f)) < 3:
        raise IdentificationError(
            "force, stretch and its rate are linearly dependent in this record, so that k1 and c1 have no estimate; "
            "give a record in which the length moves"
        )
    solution, *_ = np.linalg.lstsq(columns / sizes, f[2:], rcond=None)
    b1, b2, b3 = solution / sizes
    rows = np.array([[1.0, 2.0 * step * (1.0 - 1.0 / b1)], [1.0, -b3 / b1], [0.0, 1.0]])
    # In units in which k1 and c1 = tau k1 are of one size, else the third row would decide alone.
    scale = np.array([abs(b3 / b1), 1.0])
    c1, k1 = np.linalg.lstsq((rows * scale) / [[scale[0]], [scale[0]], [1.0]], [0.0, 0.0, b2 / b3 - k0], rcond=None)[0]
    return float(k1), float(c1 * scale[0])


def _pair(force: ArrayLike, length: ArrayLike) -> tuple[Array, Array]:
    f, s = np.asarray(force, dtype=np.float64), np.asarray(length, dtype=np.float64)
    if f.ndim != 1 or f.shape != s.shape or f.size < 3:
        raise IdentificationError(
            f"arrays of shapes {f.shape} and {s.shape} make no equations; give as many forces as lengths, 3 at least"
        )
    return f, s
