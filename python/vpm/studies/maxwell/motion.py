"""Windows of tests in motion: k1 and c1, with the noise of the measured force where it belongs."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from vpm.errors import IdentificationError
from vpm.narx.maxwell_problem import OutputErrors, Parameters
from vpm.narx.maxwell_records import MaxwellSignals, Samples, element_samples
from vpm.narx.maxwell_recursion import WEIGHTS, Recursion, Scheme, seen, stretch
from vpm.narx.maxwell_refinement import LEAST
from vpm.narx.records import RecordLike
from vpm.numbers import Array
from vpm.studies.maxwell.maps import MaxwellMap
from vpm.studies.maxwell.smoothing import smoothed
from vpm.studies.maxwell.windows import MaxwellWindows

Method = Literal["output_error", "instrumental", "least_squares"]

#: Relaxation times that a descent may start from, in samples.
GRID = np.geomspace(0.6, 300.0, 16)


def dynamic_windows(
    records: RecordLike | Sequence[RecordLike],
    k0: MaxwellMap,
    s0: MaxwellMap,
    signals: MaxwellSignals | None = None,
    *,
    width: float | None = None,
    method: Method = "output_error",
    scheme: Scheme = "trapezoidal",
    cutoff: float | None = None,
    step: float | None = None,
) -> MaxwellWindows:
    """k1 and c1 from tests in motion, over windows that follow each other, with the maps of k0 and s0 given.

    Parameters
    ----------
    records : Experiment, or mapping of str to array-like, shape (N,), or a sequence of them
    k0, s0 : MaxwellMap
        From tests at rest; their covariance counts in that of k1 and c1.
    width : float, optional
        Of a window, s; by default a window is a record.
    method : {"output_error", "instrumental", "least_squares"}
        ``"output_error"``: free run within the window, noise on the measured force. ``"instrumental"``: the equation
        with simulated instead of measured forces as instruments (P. Young, *Recursive Estimation*, 2011, chapter 6).
        ``"least_squares"``: the plain regression, in which the noise of the force makes tau too small.
    scheme : {"trapezoidal", "printed", "central_mean"}
    cutoff : float, optional
        Of a low-pass filter for the length, Hz, well above the motion; by default none. Noise of the length makes k1
        too small.
    step : float, optional
        Time between samples of records without a clock, s.

    Returns
    -------
    MaxwellWindows
        Windows whose motion does not tell k1 and c1 are left out and named in `notes`.

    Raises
    ------
    IdentificationError
        No window tells k1 and c1, windows too short, records that do not fit.
    """
    signals = signals or MaxwellSignals()
    choices = ("output_error", "instrumental", "least_squares")
    if method not in choices:
        raise IdentificationError(f'there is no method "{method}"; the choices are {", ".join(choices)}')
    found, notes = [], []
    for one in _cut([smoothed(one, cutoff) for one in element_samples(records, signals, step, LEAST)], width):
        problem = OutputErrors([one], scheme, k0.basis, s0.basis)
        values, covariance = _window(problem, k0, s0, method)
        if not (np.all(np.isfinite(values)) and values[0] * values[1] > 0.0 and np.all(np.isfinite(covariance))):
            notes.append(f"{one.name} does not tell k1 and c1 and is left out; give it more and faster motion")
            continue
        found.append((one.name, float(one.drive.mean()), float(one.length.mean()), values, covariance, one.force.size))
    if not found:
        raise IdentificationError(f"no window tells k1 and c1: {notes[0]}")
    tests, drive, length, values_, covariances, samples = zip(*found, strict=True)
    columns = np.array(drive), np.array(length), np.array(values_), np.array(covariances), np.array(samples)
    return MaxwellWindows(("k1", "c1"), method, signals.drive or "", tests, *columns, tuple(notes))


def _cut(records: list[Samples], width: float | None) -> list[Samples]:
    if width is None:
        return records
    count = round(width / records[0].step)
    if count < LEAST:
        raise IdentificationError(
            f"a window of {width:g} s has {count} samples, but k1 and c1 need {LEAST} at least; take a wider one"
        )
    pieces = []
    for one in records:
        for at in range(0, one.force.size - count + 1, count):
            part = slice(at, at + count)
            arrays = {name: getattr(one, name)[part] for name in ("time", "force", "length", "drive")}
            pieces.append(replace(one, name=f"{one.name} from {one.time[at]:g} s", **arrays))
    if not pieces:
        raise IdentificationError(f"no record is as long as a window of {width:g} s; take a narrower one")
    return pieces


def _window(problem: OutputErrors, k0: MaxwellMap, s0: MaxwellMap, method: Method) -> tuple[Array, Array]:
    """Maxwell k1 and c1 from one window in motion, and their covariance."""
    one = problem.records[0]
    if np.ptp(one.length) == 0.0:
        return np.full(2, np.nan), np.full((2, 2), np.nan)
    maps = np.concatenate([k0.basis.from_plain(k0.coefficients), s0.basis.from_plain(s0.coefficients)])
    x = descend_motion(problem, np.concatenate([maps, [0.0, 0.0]]))
    if method == "output_error":
        jacobian = problem.jacobian(x)
        return element_values(x), motion_covariance(problem, x, jacobian, (k0, s0))
    values, covariance = _regression(problem, x, method == "instrumental")
    return values, covariance


def descend_motion(problem: OutputErrors, x: Array) -> Array:
    """Maxwell k1 and tau of least output error in motion, with the maps as they are."""
    from scipy.optimize import least_squares

    size = min(one.force.size for one in problem.records)
    start = problem.search(x, GRID[size / 3.0 >= GRID])
    scale = np.array([max(abs(start[-2]), 1e-6), 1.0])

    def whole(part: Array) -> Array:
        return np.concatenate([x[:-2], part * scale])

    def errors(part: Array) -> Array:
        return problem.residual(whole(part))

    def derivatives(part: Array) -> Array:
        return np.asarray(problem.jacobian(whole(part))[:, -2:] * scale)

    found = least_squares(
        errors,
        start[-2:] / scale,
        derivatives,
        bounds=([-np.inf, problem.limits[0]], [np.inf, problem.limits[1]]),
        x_scale="jac",
        xtol=1e-14,
        ftol=1e-14,
        gtol=1e-14,
        max_nfev=100,
    )
    return whole(np.asarray(found.x))


def element_values(x: Array) -> Array:
    """Maxwell k1 and c1 in motion from a vector of parameters."""
    return np.array([x[-2], x[-2] * np.exp(x[-1])])


def motion_covariance(
    problem: OutputErrors, x: Array, jacobian: Array, maps: tuple[MaxwellMap, MaxwellMap] | None
) -> Array:
    """Covariance of Maxwell k1 and c1 in motion: from the noise of force and maps."""
    own, rest = jacobian[:, -2:], problem.residual(x)
    sigma2 = float(rest @ rest) / max(problem.freedom - 2, 1)
    sizes = np.linalg.norm(own, axis=0)
    if sizes.min() == 0.0 or np.linalg.cond(own / sizes) > 1e10:
        return np.full((2, 2), np.inf)
    inverse = np.linalg.inv((own / sizes).T @ (own / sizes)) / np.outer(sizes, sizes)
    covariance = sigma2 * inverse
    if maps is not None:
        moved = inverse @ (own.T @ jacobian[:, :-2])
        at = 0
        for one in maps:
            back = np.array([one.basis.from_plain(column) for column in one.covariance.T])
            back = np.array([one.basis.from_plain(column) for column in back.T])
            part = moved[:, at : at + len(one.terms)]
            covariance = covariance + part @ back @ part.T
            at += len(one.terms)
    k1, tau = float(x[-2]), float(np.exp(x[-1]))
    turn = np.array([[1.0, 0.0], [tau, k1 * tau]])
    return np.asarray(turn @ covariance @ turn.T)


def _regression(problem: OutputErrors, x: Array, instruments: bool) -> tuple[Array, Array]:
    """Regression of Maxwell motion for ``r`` and ``r k1``: ``alpha F - gamma F_lag - E = r (K ds - ...) + r k1 ds``."""
    one, scheme = problem.records[0], problem.scheme
    w = WEIGHTS[scheme]
    p = Parameters.from_vector(x, problem.terms)
    columns_k, columns_s = problem.columns(0)
    stiffness = columns_k @ p.k0
    elastic = seen(scheme, stiffness * (one.length - columns_s @ p.s0))
    ds = stretch(scheme, one.length)

    def regressors(force: Array) -> Array:
        lagged = Recursion(scheme, 1.0).lagged(force)
        rows = np.column_stack([seen(scheme, stiffness) * ds + w.delta * lagged - w.beta * force, ds])
        return rows[w.lag :]

    plain = regressors(one.force)
    right = (w.alpha * one.force - w.gamma * Recursion(scheme, 1.0).lagged(one.force) - elastic)[w.lag :]
    chosen = regressors(problem.record(0, x)[1]) if instruments else plain
    matrix = chosen.T @ plain
    if np.linalg.cond(matrix / np.sqrt(np.outer(np.diag(chosen.T @ chosen), np.diag(plain.T @ plain)))) > 1e12:
        return np.full(2, np.nan), np.full((2, 2), np.nan)
    inverse = np.linalg.inv(matrix)
    theta = inverse @ (chosen.T @ right)
    rest = right - plain @ theta
    # The equation's error is a moving average of the force's noise: neighbours at the lag are correlated.
    middle = float(np.mean(rest**2)) * chosen.T @ chosen
    if instruments:
        product = chosen[w.lag :].T @ chosen[: -w.lag]
        middle = middle + float(np.mean(rest[w.lag :] * rest[: -w.lag])) * (product + product.T)
    both = inverse @ middle @ inverse.T
    k1 = float(theta[1] / theta[0])
    turn = np.array([[-k1 / theta[0], 1.0 / theta[0]], [0.0, one.step]])
    return np.array([k1, theta[1] * one.step]), turn @ both @ turn.T
