"""The element from records: stages after each other, then all coefficients together where that is better."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from vpm.errors import IdentificationError
from vpm.narx.maxwell import MaxwellNarx
from vpm.narx.maxwell_identifiability import basis_around, identifiable_bases, standard_errors, start_vector, widened
from vpm.narx.maxwell_maps import Basis, MaxwellMap, fit_maxwell_map
from vpm.narx.maxwell_motion import LEAST, descend_motion, element_values, motion_covariance
from vpm.narx.maxwell_problem import OutputErrors, Parameters
from vpm.narx.maxwell_records import MaxwellSignals, Samples, element_samples, smoothed
from vpm.narx.maxwell_recursion import Scheme
from vpm.narx.maxwell_result import MaxwellFit, training_rmse, unrefined
from vpm.narx.maxwell_windows import static_windows
from vpm.narx.records import RecordLike

Array = NDArray[np.float64]
Records: TypeAlias = "RecordLike | Sequence[RecordLike]"

#: Share by which a refinement has to be better, beyond rounding.
BETTER = 1e-9
#: Relative distance of tau from what records can show that counts as none.
NEAR = 1e-3


def identify_maxwell(
    static: Records,
    dynamic: Records,
    signals: MaxwellSignals | None = None,
    *,
    degree: int | Mapping[str, int] | None = None,
    refined_degree: int | None = None,
    width: int = 3,
    settle: float = 0.0,
    scheme: Scheme = "trapezoidal",
    cutoff: float | None = None,
    step: float | None = None,
    refine: bool = True,
) -> MaxwellFit:
    """Element with maps of k0 and s0 from tests at rest and in motion.

    First k0 and s0 in windows of poses (`static_windows`), maps through them (`fit_maxwell_map`), k1 and c1 by output
    error over the tests in motion; then all of them together (`refine_maxwell`), kept if better on the same records.

    Parameters
    ----------
    static, dynamic : Experiment, or mapping of str to array-like, shape (N,), or a sequence of them
        One record for each pose at rest; tests in motion. Keep other tests to judge the result by.
    signals : MaxwellSignals, optional
    degree : int or mapping of "k0" and "s0" to int, optional
        Of the maps; by default as many as windows left out ask for.
    refined_degree : int, optional
        Of both maps in the refinement; by default the terms of the staged ones.
    width : int
        Poses in a window.
    settle : float
        Start of each test at rest that is left out, s.
    scheme : {"trapezoidal", "printed", "central_mean"}
    cutoff : float, optional
        Of a low-pass filter for the length of the tests in motion, Hz, well above the motion; by default none. Noise of
        the length makes k1 too small.
    step : float, optional
        Time between samples of records without a clock, s.
    refine : bool

    Returns
    -------
    MaxwellFit

    Raises
    ------
    IdentificationError
        The records do not tell the element: by name and number.
    """
    signals = signals or MaxwellSignals()
    at_rest, moving = (element_samples(each, signals, step) for each in (static, dynamic))
    if abs(at_rest[0].step - moving[0].step) > 1e-6 * moving[0].step:
        raise IdentificationError(
            f"the tests at rest are sampled every {at_rest[0].step:g} s, those in motion every {moving[0].step:g} s; a "
            "difference equation has one step: resample one of them"
        )
    moving = [smoothed(one, cutoff) for one in moving]
    windows = static_windows(static, signals, width=width, settle=settle, step=step)
    degrees = degree if isinstance(degree, Mapping) else {"k0": degree, "s0": degree}
    k0, s0 = (fit_maxwell_map(windows, of, degrees.get(of)) for of in ("k0", "s0"))
    staged, k1_std, c1_std = _staged(moving, k0, s0, scheme)
    notes = (*windows.notes, *k0.notes, *s0.notes)
    skip = round(settle / at_rest[0].step)
    kept = [_after(one, skip) for one in at_rest]
    begun = unrefined(staged, kept + moving, (k0.std, s0.std, k1_std, c1_std), notes)
    if not refine:
        return begun
    return _refined(begun, kept + moving, (k0.basis, s0.basis), signals, refined_degree)


def refine_maxwell(
    element: MaxwellNarx, records: Records, signals: MaxwellSignals | None = None, *, degree: int | None = None
) -> MaxwellFit:
    """Fit all coefficients of a Maxwell element together, by least squares of its free runs over records.

    Parameters
    ----------
    element : MaxwellNarx
        Where to start.
    records : Experiment, or mapping of str to array-like, shape (N,), or a sequence of them
        Training records, at rest and in motion.
    signals : MaxwellSignals, optional
    degree : int, optional
        Of both maps; by default the terms that the element has.

    Returns
    -------
    MaxwellFit
        Of which `element` is the given one if the fit is no better on the records.

    Raises
    ------
    IdentificationError
        Too few samples, a drive signal or length that does not move, records that do not fit.
    """
    signals = signals or MaxwellSignals()
    samples = element_samples(records, signals, element.step, LEAST)
    whole = basis_around(samples)
    bases = tuple(
        Basis(whole.centre, whole.scale, tuple(int(t) for t in np.flatnonzero(c)) or (0,))
        for c in (element.k0, element.s0)
    )
    nothing = np.full(10, np.nan)
    begun = unrefined(element, samples, (nothing, nothing, np.nan, np.nan), ())
    return _refined(begun, samples, (bases[0], bases[1]), signals, degree)


def _after(one: Samples, skip: int) -> Samples:
    # At rest the length is one number: its noise would count as motion, and make k1 too small.
    rest = np.full(one.length.size - skip, one.length[skip:].mean())
    arrays = (one.force[skip:], rest, one.drive[skip:])
    return Samples(one.name, one.unit, one.time[skip:], one.step, *arrays)


def _staged(moving: list[Samples], k0: MaxwellMap, s0: MaxwellMap, scheme: Scheme) -> tuple[MaxwellNarx, float, float]:
    still = [one.name for one in moving if np.ptp(one.length) == 0.0]
    if len(still) == len(moving):
        raise IdentificationError(
            f"the length does not move in test {still[0]}, nor in any other of the tests in motion, so that k1 and c1 "
            "cannot be told; give a test with motion"
        )
    short = next((one for one in moving if one.force.size < LEAST), None)
    if short is not None:
        raise IdentificationError(
            f"test {short.name} has {short.force.size} samples, but k1 and c1 need {LEAST} at least; give a longer test"
        )
    problem = OutputErrors(moving, scheme, k0.basis, s0.basis)
    maps = [one.basis.from_plain(one.coefficients) for one in (k0, s0)]
    x = descend_motion(problem, np.concatenate([*maps, [0.0, 0.0]]))
    k1, c1 = element_values(x)
    if not (np.isfinite(k1) and k1 != 0.0 and np.isfinite(c1) and x[-1] < problem.limits[1] - NEAR):
        raise IdentificationError(
            f"the tests in motion ask for k1 = {k1:.3g} N/m and c1 = {c1:.3g} N s/m, whose relaxation time no record "
            f"in steps of {moving[0].step:g} s can show; give tests with more and faster motion, or check the force"
        )
    covariance = motion_covariance(problem, x, problem.jacobian(x), (k0, s0))
    std = np.sqrt(np.diag(covariance))
    element = MaxwellNarx(k0.coefficients, s0.coefficients, float(k1), float(c1), moving[0].step, scheme)
    return element, float(std[0]), float(std[1])


def _refined(
    begun: MaxwellFit,
    samples: list[Samples],
    bases: tuple[Basis, Basis],
    signals: MaxwellSignals,
    degree: int | None,
) -> MaxwellFit:
    wide, dropped = widened(samples, bases, signals, degree)
    wide, more_dropped = identifiable_bases(begun.staged, samples, wide)
    dropped += more_dropped
    problem = OutputErrors(samples, begun.element.scheme, *wide)
    if problem.freedom < 2 * problem.count:
        raise IdentificationError(
            f"{problem.freedom} samples are too few for {problem.count} coefficients; give longer records or a lower "
            "degree"
        )
    from scipy.optimize import least_squares

    e = begun.staged
    low, high = np.full(problem.count, -np.inf), np.full(problem.count, np.inf)
    low[-1], high[-1] = problem.limits
    first = start_vector(e, wide)
    first[-1] = np.clip(first[-1], low[-1] + NEAR, high[-1] - NEAR)
    found = least_squares(
        problem.residual,
        first,
        problem.jacobian,
        bounds=(low, high),
        x_scale="jac",
        xtol=1e-12,
        ftol=1e-12,
        gtol=1e-14,
        max_nfev=200,
    )
    end = Parameters.from_vector(np.asarray(found.x), problem.terms)
    maps = wide[0].to_plain() @ end.k0, wide[1].to_plain() @ end.s0
    element, rmse = e, float("inf")
    if end.k1 != 0.0 and np.all(np.isfinite(found.x)) and found.x[-1] < high[-1] - NEAR:
        element = MaxwellNarx(*maps, end.k1, end.k1 * end.tau, e.step, e.scheme)
        rmse = training_rmse(element, samples)
    notes = (*begun.notes, *dropped)
    if found.status == 0:
        notes = (*notes, f"the refinement was stopped after {found.nfev} evaluations, before its steps were small")
    parts = begun.drive_range, begun.length_range, int(found.nfev)
    said = f"{rmse:.4g} N in free run over the training records, {begun.staged_rmse:.4g} N without"
    if not rmse < (1.0 - BETTER) * begun.staged_rmse:
        words = f"the refinement is refused: {said}"
        own = begun.k0_std, begun.s0_std, begun.k1_std, begun.c1_std
        return MaxwellFit(e, e, False, begun.staged_rmse, rmse, *own, *parts, (*notes, words))
    words = f"the refinement is kept: {said}"
    std, more = standard_errors(problem, np.asarray(found.x), wide)
    if found.x[-1] < low[-1] + NEAR:
        more.append(
            f"tau stands at half a step, {end.tau:g} s: the force relaxes faster than the samples show, so that c1 is "
            "known and k1 is a lower bound"
        )
    return MaxwellFit(element, e, True, begun.staged_rmse, rmse, *std, *parts, (*notes, words, *more))
