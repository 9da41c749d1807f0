"""The element from records: stages after each other, then all coefficients together where that is better."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from vpm.compare import autocorrelation
from vpm.errors import DivergedError, IdentificationError
from vpm.narx.maxwell import MaxwellNarx
from vpm.narx.maxwell_maps import COUNTS, Basis, MaxwellMap, fit_maxwell_map
from vpm.narx.maxwell_motion import LEAST, descend_motion, element_values, motion_covariance
from vpm.narx.maxwell_problem import OutputErrors, Parameters
from vpm.narx.maxwell_records import MaxwellSignals, Samples, element_samples, smoothed
from vpm.narx.maxwell_recursion import POWER_NAMES, POWERS, Scheme
from vpm.narx.maxwell_windows import static_windows
from vpm.narx.records import RecordLike, as_list
from vpm.narx.run import inside
from vpm.results import Result

Array = NDArray[np.float64]
Records: TypeAlias = "RecordLike | Sequence[RecordLike]"

#: A combination of parameters that moves the force by less than this share of what each of them does is not seen.
UNSEEN = 1e-7
#: Share by which a refinement has to be better, beyond rounding.
BETTER = 1e-9
#: A constant of k0 that is known to no better share leaves k0 and s0 hardly apart.
HARDLY = 0.2


@dataclass(frozen=True, repr=False, eq=False)
class MaxwellFit(Result):
    """An element from records, with what is known of its coefficients.

    Attributes
    ----------
    element : MaxwellNarx
        The better of both on the training records.
    staged : MaxwellNarx
        From windows at rest, maps through them, then k1 and c1.
    refined : bool
        Whether `element` is the refined one.
    staged_rmse, refined_rmse : float
        Of free runs over all training records, N; infinite where one diverges.
    k0_std, s0_std : ndarray, shape (10,)
        Standard errors of the element's coefficients; zero where a term is not used.
    k1_std, c1_std : float
    drive_range, length_range : tuple of two floats
        Of the training records, beyond which the maps are guesses.
    evaluations : int
        Of the refinement.
    notes : tuple of str
        What was chosen and why, and what the records cannot tell.
    """

    element: MaxwellNarx
    staged: MaxwellNarx
    refined: bool
    staged_rmse: float
    refined_rmse: float
    k0_std: Array
    s0_std: Array
    k1_std: float
    c1_std: float
    drive_range: tuple[float, float]
    length_range: tuple[float, float]
    evaluations: int
    notes: tuple[str, ...]

    def _headline(self) -> Mapping[str, object]:
        return {
            "element": self.element,
            "refined": self.refined,
            "staged_rmse": self.staged_rmse,
            "refined_rmse": self.refined_rmse,
        }

    def _frame_columns(self) -> Mapping[str, object]:
        e = self.element
        names = [f"{of}[{power}]" for of in ("k0", "s0") for power in POWER_NAMES] + ["k1", "c1"]
        values = np.concatenate([e.k0, e.s0, [e.k1, e.c1]])
        std = np.concatenate([self.k0_std, self.s0_std, [self.k1_std, self.c1_std]])
        return {"coefficient": names, "value": values, "std": std}


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
    moving = [smoothed(one, cutoff) for one in moving]
    windows = static_windows(static, signals, width=width, settle=settle, step=step)
    degrees = degree if isinstance(degree, Mapping) else {"k0": degree, "s0": degree}
    k0, s0 = (fit_maxwell_map(windows, of, degrees.get(of)) for of in ("k0", "s0"))
    staged, k1_std, c1_std = _staged(moving, k0, s0, scheme)
    notes = (*windows.notes, *k0.notes, *s0.notes)
    skip = round(settle / at_rest[0].step)
    kept = [_after(one, skip) for one in at_rest]
    begun = _fit(staged, kept + moving, (k0.std, s0.std, k1_std, c1_std), notes)
    if not refine:
        return begun
    return _refined(begun, kept + moving, (k0.basis, s0.basis), signals, refined_degree)


def refine_maxwell(
    element: MaxwellNarx, records: Records, signals: MaxwellSignals | None = None, *, degree: int | None = None
) -> MaxwellFit:
    """All coefficients of an element together, by least squares of its free runs over records.

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
    whole = _basis(samples)
    bases = tuple(
        Basis(whole.centre, whole.scale, tuple(int(t) for t in np.flatnonzero(c)) or (0,))
        for c in (element.k0, element.s0)
    )
    nothing = np.full(10, np.nan)
    begun = _fit(element, samples, (nothing, nothing, np.nan, np.nan), ())
    return _refined(begun, samples, (bases[0], bases[1]), signals, degree)


def _after(one: Samples, skip: int) -> Samples:
    arrays = (one.force[skip:], one.length[skip:], one.drive[skip:])
    return Samples(one.name, one.unit, one.time[skip:], one.step, *arrays)


def _basis(samples: list[Samples]) -> Basis:
    return Basis.around(np.concatenate([one.drive for one in samples]), np.concatenate([one.length for one in samples]))


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
    if not (np.isfinite(k1) and k1 != 0.0 and np.isfinite(c1)):
        raise IdentificationError(
            f"the tests in motion give k1 = {k1:g} N/m and c1 = {c1:g} N s/m, which is no element; give tests with more "
            "and faster motion"
        )
    covariance = motion_covariance(problem, x, problem.jacobian(x), (k0, s0))
    std = np.sqrt(np.diag(covariance))
    element = MaxwellNarx(k0.coefficients, s0.coefficients, float(k1), float(c1), moving[0].step, scheme)
    return element, float(std[0]), float(std[1])


def _training_rmse(element: MaxwellNarx, samples: list[Samples]) -> float:
    total, count = 0.0, 0
    for one in samples:
        bound = 1e3 * float(np.abs(one.force).max()) or np.inf
        try:
            run = element.simulate_free_run(one.length, (one.force[0], one.force[1]), one.drive, limit=bound)
        except DivergedError:
            return float("inf")
        total += float(np.sum((run - one.force)[2:] ** 2))
        count += one.force.size - 2
    return float(np.sqrt(total / count))


def _fit(
    element: MaxwellNarx, samples: list[Samples], std: tuple[Array, Array, float, float], notes: tuple[str, ...]
) -> MaxwellFit:
    drive, length = (np.concatenate([getattr(one, name) for one in samples]) for name in ("drive", "length"))
    ranges = [(float(x.min()), float(x.max())) for x in (drive, length)]
    rmse = _training_rmse(element, samples)
    return MaxwellFit(element, element, False, rmse, float("nan"), *std, ranges[0], ranges[1], 0, notes)


def _refined(
    begun: MaxwellFit,
    samples: list[Samples],
    bases: tuple[Basis, Basis],
    signals: MaxwellSignals,
    degree: int | None,
) -> MaxwellFit:
    wide, dropped = _widened(samples, bases, signals, degree)
    wide, more_dropped = _told_apart(begun.staged, samples, wide)
    dropped += more_dropped
    problem = OutputErrors(samples, begun.element.scheme, *wide)
    if problem.freedom < 2 * problem.count:
        raise IdentificationError(
            f"{problem.freedom} samples are too few for {problem.count} coefficients; give longer records or a lower degree"
        )
    e = begun.staged
    first = _vector(e, wide)
    found = least_squares(
        problem.residual, first, problem.jacobian, method="lm", x_scale="jac", xtol=1e-12, ftol=1e-12, gtol=1e-14, max_nfev=200
    )
    end = Parameters.from_vector(np.asarray(found.x), problem.terms)
    maps = wide[0].to_plain() @ end.k0, wide[1].to_plain() @ end.s0
    try:
        element = MaxwellNarx(*maps, end.k1, end.k1 * end.tau, e.step, e.scheme)
        rmse = _training_rmse(element, samples)
    except (IdentificationError, FloatingPointError):
        element, rmse = e, float("inf")
    notes = (*begun.notes, *dropped)
    parts = begun.drive_range, begun.length_range, int(found.nfev)
    if not rmse < (1.0 - BETTER) * begun.staged_rmse:
        words = f"the refinement is refused: {rmse:.4g} N in free run over the training records, {begun.staged_rmse:.4g} N without"
        own = begun.k0_std, begun.s0_std, begun.k1_std, begun.c1_std
        return MaxwellFit(e, e, False, begun.staged_rmse, rmse, *own, *parts, (*notes, words))
    words = f"the refinement is kept: {rmse:.4g} N in free run over the training records, {begun.staged_rmse:.4g} N without"
    std, more = _errors(problem, np.asarray(found.x), wide)
    return MaxwellFit(element, e, True, begun.staged_rmse, rmse, *std, *parts, (*notes, words, *more))


def _widened(
    samples: list[Samples], bases: tuple[Basis, Basis], signals: MaxwellSignals, degree: int | None
) -> tuple[tuple[Basis, Basis], list[str]]:
    """Bases of the refinement over the range of all training records, and terms that these cannot tell."""
    whole = _basis(samples)
    drive, length = (np.concatenate([getattr(one, name) for one in samples]) for name in ("drive", "length"))
    made, notes = [], []
    for of, basis in zip(("k0", "s0"), bases, strict=True):
        asked = list(basis.terms) if degree is None else list(range(COUNTS[degree]))
        # A polynomial over other centres needs every lower power of the terms that it has.
        closed = {
            at
            for at, (i, j) in enumerate(POWERS)
            if any(i <= POWERS[t][0] and j <= POWERS[t][1] for t in asked) and (signals.drive or i == 0)
        }
        start = Basis(whole.centre, whole.scale, tuple(sorted(closed)))
        kept, dropped = start.independent(drive, length, np.ones(drive.size))
        if dropped:
            names = ", ".join(POWER_NAMES[term] for term in dropped)
            notes.append(
                f"in the map of {of}, {names} cannot be told from the terms before over the training records and is left "
                "out; add tests at other values"
            )
        made.append(kept)
    return (made[0], made[1]), notes


def _vector(e: MaxwellNarx, bases: tuple[Basis, Basis]) -> Array:
    return Parameters(bases[0].from_plain(e.k0), bases[1].from_plain(e.s0), e.k1, e.relaxation_time).to_vector()


def _names(bases: tuple[Basis, Basis]) -> list[str]:
    return [f"{of}[{POWER_NAMES[t]}]" for of, b in zip(("k0", "s0"), bases, strict=True) for t in b.terms] + ["k1", "tau"]


def _told_apart(
    e: MaxwellNarx, samples: list[Samples], bases: tuple[Basis, Basis]
) -> tuple[tuple[Basis, Basis], list[str]]:
    """Bases without the terms of s0 in s that k0 and k1 can stand for.

    ``k0 (s - s0)`` stays what it is if k0 grows by c and s0 becomes ``s - k0 (s - s0) / (k0 + c)``, and so does
    ``k0 + k1`` if k1 falls by c: where that is a polynomial of the map, the records cannot tell these apart.
    """
    notes = []
    while True:
        jacobian = OutputErrors(samples, e.scheme, *bases).jacobian(_vector(e, bases))
        sizes = np.linalg.norm(jacobian, axis=0)
        _, values, rows = np.linalg.svd(jacobian / np.where(sizes > 0.0, sizes, 1.0), full_matrices=False)
        terms, first = bases[1].terms, len(bases[0].terms)
        share = np.abs(rows[-1][first:-2])
        doubtful = [t for t, x in zip(terms, share, strict=True) if x > 0.01 and POWERS[t][1] > 0]
        if values[-1] > UNSEEN * values[0] or not doubtful:
            return bases, notes
        names = [n for n, x in zip(_names(bases), np.abs(rows[-1]), strict=True) if x > 0.01]
        out = f"s0[{POWER_NAMES[doubtful[-1]]}]"
        others = ", ".join(name for name in names if name != out)
        notes.append(f"{out} is left out: no record can tell it from {others}, which can stand for it")
        bases = bases[0], Basis(bases[1].centre, bases[1].scale, tuple(t for t in terms if t != doubtful[-1]))


def _errors(
    problem: OutputErrors, x: Array, bases: tuple[Basis, Basis]
) -> tuple[tuple[Array, Array, float, float], list[str]]:
    """Standard errors of the plain coefficients, and what the records do not tell."""
    jacobian, rest = problem.jacobian(x), problem.residual(x)
    sizes = np.linalg.norm(jacobian, axis=0)
    sizes[sizes == 0.0] = 1.0
    _, values, rows = np.linalg.svd(jacobian / sizes, full_matrices=False)
    seen = values > UNSEEN * values[0]
    names = _names(bases)
    notes = [
        "the records do not tell "
        + ", ".join(names[i] for i in np.flatnonzero(np.abs(row) > 0.1))
        + " apart; the force is right, these values are one choice of many: take lower degrees"
        for row in rows[~seen]
    ]
    sigma2 = float(rest @ rest) / max(problem.freedom - problem.count, 1)
    inverse = (rows[seen].T / values[seen] ** 2) @ rows[seen] / np.outer(sizes, sizes)
    x_k1, tau = float(x[-2]), float(np.exp(x[-1]))
    turn = np.zeros((22, problem.count))
    turn[:10, : problem.terms], turn[10:20, problem.terms : -2] = bases[0].to_plain(), bases[1].to_plain()
    turn[20, -2], turn[21, -2:] = 1.0, (tau, x_k1 * tau)
    std = np.sqrt(np.maximum(np.diag(sigma2 * turn @ inverse @ turn.T), 0.0))
    pieces, at = [], 0
    for one in problem.records:
        pieces.append(slice(at, at + one.force.size))
        at += one.force.size
    if std[0] > HARDLY * abs(float(bases[0].to_plain()[0] @ x[: problem.terms])):
        notes.append(
            "k0 and s0 are hardly told apart by these records: the force k0 (s - s0) is known, single coefficients are not; "
            "take lower degrees where these are wanted"
        )
    exact = np.sqrt(sigma2) < 1e-9 * max(float(np.abs(one.force).max()) for one in problem.records)
    if not exact and not inside(autocorrelation(rest, pieces, problem.records[0].step, "F")):
        notes.append(
            "the residual of the free runs is not white, so that more than the noise of the force is left in it and the "
            "standard errors are too small"
        )
    return (std[:10], std[10:20], float(std[20]), float(std[21])), notes
