"""The same selection by sysidentpy, for comparison where it is installed."""

import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Term = tuple[tuple[int, int], ...]


def fitted(y: Array, u: Array, *, lags: int, degree: int, n_terms: int) -> Any:
    """The fitted model."""
    from sysidentpy.basis_function import Polynomial
    from sysidentpy.model_structure_selection import FROLS
    from sysidentpy.parameter_estimation import LeastSquares

    model = FROLS(
        n_terms=n_terms,
        order_selection=False,
        ylag=lags,
        xlag=lags,
        estimator=LeastSquares(),
        basis_function=Polynomial(degree=degree),
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        model.fit(X=u[:, None], y=y[:, None])
    return model


def sysidentpy_terms(y: Array, u: Array, *, lags: int, degree: int, n_terms: int) -> dict[Term, float]:
    """Its terms as factors (signal, lag), with coefficients: it writes 1000 + d for y[k-d], 2000 + d for u[k-d]."""
    model = fitted(y, u, lags=lags, degree=degree, n_terms=n_terms)
    found = {}
    for code, value in zip(model.final_model, np.asarray(model.theta).ravel(), strict=True):
        factors = [(int(number) // 1000 - 1, int(number) % 1000) for number in code if number > 0]
        found[tuple(sorted(factors))] = float(value)
    return found
