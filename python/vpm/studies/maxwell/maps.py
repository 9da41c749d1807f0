"""Polynomial maps of an element's parameters in drive signal and length, from estimates of windows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vpm.errors import IdentificationError
from vpm.narx.maxwell_basis import COUNTS, EXACT, Basis
from vpm.narx.maxwell_recursion import POWER_NAMES, POWERS, surface_columns
from vpm.numbers import Array
from vpm.results import Result

if TYPE_CHECKING:
    from vpm.studies.maxwell.windows import MaxwellWindows


@dataclass(frozen=True, repr=False, eq=False)
class MaxwellMap(Result):
    """A parameter of the element as a polynomial of drive signal and length.

    Attributes
    ----------
    of : str
        ``"k0"``, ``"s0"``, ``"k1"`` or ``"c1"``.
    coefficients : ndarray, shape (10,)
        Over ``1, u, s, u^2, u s, s^2, u^3, u^2 s, u s^2, s^3``, as `MaxwellNarx` takes them.
    covariance : ndarray, shape (10, 10)
        Of the coefficients.
    misfit : float
        Root of the mean squared difference to the windows' values.
    centre, scale : tuple of two floats
        Of the variables in which it was fitted.
    terms : tuple of int
        Which of the ten were fitted.
    notes : tuple of str
        What the windows cannot tell.
    """

    of: str
    coefficients: Array
    covariance: Array
    degree: int
    misfit: float
    windows: int
    centre: tuple[float, float]
    scale: tuple[float, float]
    terms: tuple[int, ...]
    notes: tuple[str, ...] = ()

    def __call__(self, drive: Array, length: Array) -> Array:
        """Value of a map at drive signals and lengths, shape (N,)."""
        return np.asarray(surface_columns(np.atleast_1d(drive), np.atleast_1d(length)) @ self.coefficients)

    @property
    def basis(self) -> Basis:
        """Basis in which a map was fitted."""
        return Basis(self.centre, self.scale, self.terms)

    @property
    def std(self) -> Array:
        """Standard errors of a map's coefficients, shape (10,); zero where a term was not fitted."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    def _headline(self) -> Mapping[str, object]:
        return {"of": self.of, "degree": self.degree, "terms": len(self.terms), "misfit": self.misfit}

    def _frame_columns(self) -> Mapping[str, object]:
        return {"power": POWER_NAMES, "coefficient": self.coefficients, "std": self.std}


def fit_maxwell_map(windows: MaxwellWindows, of: str, degree: int | None = None) -> MaxwellMap:
    """Least-squares polynomial through the windows' values of one parameter, each weighted by its standard error.

    Parameters
    ----------
    windows : MaxwellWindows
        Of the training records.
    of : str
        One of its parameters.
    degree : int, optional
        0 to 3; by default the lowest that predicts windows left out of the fit, one by one, within a standard error as
        well as the best (L. Breiman et al., *Classification and Regression Trees*, 1984, section 3.4.3), where errors
        below a window's own are no merit.

    Raises
    ------
    IdentificationError
        Fewer windows than coefficients, a drive signal that is the same in all of them, another degree or parameter.

    Notes
    -----
    D'Imperio (2016), section 5.2.5: ten coefficients each by ``(Y^T Y)^-1 Y^T``; here over centred variables, with
    weights, and with terms left out that the windows cannot tell.
    """
    if of not in windows.names:
        raise IdentificationError(f'these windows have no "{of}"; they have {" and ".join(windows.names)}')
    if degree is not None and degree not in range(4):
        raise IdentificationError(f"the degree of a map is 0, 1, 2 or 3, got {degree}")
    at = windows.names.index(of)
    values, std = windows.values[:, at], windows.std[:, at]
    if windows.drive_name and values.size > 1 and np.ptp(windows.drive) == 0.0 and degree != 0:
        raise IdentificationError(
            f'the drive signal "{windows.drive_name}" is {windows.drive[0]:g} in all {values.size} windows, so that no '
            "map can depend on it; leave it out of the signals or add tests at another value"
        )
    std = np.maximum(std, EXACT * max(float(np.abs(values).max()), np.finfo(float).tiny))
    wanted = range(4) if degree is None else (degree,)
    candidates = [_fitted(windows, of, values, std, d) for d in wanted if _enough(windows, of, d, degree)]
    least, spread = min((error, spread) for _, error, spread in candidates)
    # The mean of N squared normal numbers has that error, which few windows may hide.
    margin = max(spread, least * float(np.sqrt(2.0 / values.size)))
    return next(made for made, error, _ in candidates if error <= least + margin)


def _enough(windows: MaxwellWindows, of: str, degree: int, asked: int | None) -> bool:
    count = COUNTS[degree] if windows.drive_name else degree + 1
    if count <= windows.drive.size:
        return True
    if asked is None:
        return False
    raise IdentificationError(
        f"a map of {of} of degree {degree} has {count} coefficients, but there are {windows.drive.size} windows; add "
        "tests or take a lower degree"
    )


def _fitted(
    windows: MaxwellWindows, of: str, values: Array, std: Array, degree: int
) -> tuple[MaxwellMap, float, float]:
    u, s, weights = windows.drive, windows.length, 1.0 / std
    whole = Basis.around(u, s)
    asked = [term for term in range(COUNTS[degree]) if windows.drive_name or POWERS[term][0] == 0]
    basis, dropped = Basis(whole.centre, whole.scale, tuple(asked)).independent(u, s, weights)
    columns = basis.columns(u, s)
    weighted = weights[:, None] * columns
    solution, *_ = np.linalg.lstsq(weighted, weights * values, rcond=None)
    rest = values - columns @ solution
    freedom = values.size - len(basis.terms)
    spread = float(np.sum((weights * rest) ** 2))
    # A polynomial that misses the windows by more than their own errors is uncertain by that misfit too.
    excess = max(1.0, spread / freedom) if freedom > 0 else 1.0
    plain = basis.to_plain()
    covariance = excess * plain @ np.linalg.inv(weighted.T @ weighted) @ plain.T
    notes = (_collinear(of, dropped, values.size),) if dropped else ()
    made = MaxwellMap(
        of,
        plain @ solution,
        covariance,
        degree,
        float(np.sqrt(np.mean(rest**2))),
        values.size,
        basis.centre,
        basis.scale,
        basis.terms,
        notes,
    )
    leverage = np.einsum("ij,ji->i", weighted, np.linalg.pinv(weighted))
    if leverage.max() > 1.0 - EXACT:  # a window that alone decides a coefficient is predicted by no other
        return made, float("inf"), 0.0
    left_out = (weights * rest) / (1.0 - leverage)
    # Errors below what each window knows are no merit; without that floor exact data would ask for the highest degree.
    squares = np.maximum(left_out**2, 1.0)
    return made, float(squares.mean()), float(squares.std() / np.sqrt(squares.size))


def _collinear(of: str, dropped: tuple[int, ...], count: int) -> str:
    names = ", ".join(POWER_NAMES[term] for term in dropped)
    return (
        f"in the map of {of}, {names} cannot be told from the terms before over these {count} windows and "
        f"{'is' if len(dropped) == 1 else 'are'} left out; add tests at other values"
    )
