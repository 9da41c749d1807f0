"""All coefficients of an element together, from one that is near: kept where that is better."""

from collections.abc import Sequence

import numpy as np

from vpm.compare import autocorrelation
from vpm.errors import IdentificationError
from vpm.narx.maxwell import MaxwellNarx
from vpm.narx.maxwell_basis import COUNTS, Basis
from vpm.narx.maxwell_problem import OutputErrors, Parameters
from vpm.narx.maxwell_records import MaxwellSignals, Samples, element_samples
from vpm.narx.maxwell_recursion import POWER_NAMES, POWERS
from vpm.narx.maxwell_result import MaxwellFit, training_rmse, unrefined
from vpm.narx.records import RecordLike
from vpm.narx.run import inside
from vpm.numbers import Array

Records = RecordLike | Sequence[RecordLike]

#: Fewest samples of a record or window in motion.
LEAST = 20
#: Share by which a refinement has to be better, beyond rounding.
BETTER = 1e-9
#: Relative distance of tau from what records can show that counts as none.
NEAR = 1e-3

#: A combination of parameters that moves the force by less than this share of what each of them does is not seen.
UNSEEN = 1e-7
#: A constant of k0 that is known to no better share leaves k0 and s0 strongly correlated.
HARDLY = 0.2


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
    return refined(begun, samples, (bases[0], bases[1]), signals, degree)


def refined(
    begun: MaxwellFit,
    samples: list[Samples],
    bases: tuple[Basis, Basis],
    signals: MaxwellSignals,
    degree: int | None,
) -> MaxwellFit:
    """Fit of all coefficients over wider bases where it is better than the one it begins from.

    - ``bases``: of k0 and s0, with the terms to fit
    - ``degree``: of both maps; by default the terms of the bases
    """
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


def basis_around(samples: list[Samples]) -> Basis:
    """Basis over the range of all records, for identifiability."""
    return Basis.around(np.concatenate([one.drive for one in samples]), np.concatenate([one.length for one in samples]))


def widened(
    samples: list[Samples], bases: tuple[Basis, Basis], signals: MaxwellSignals, degree: int | None
) -> tuple[tuple[Basis, Basis], list[str]]:
    """Widened bases over all training records, and terms that are not identifiable in them."""
    whole = basis_around(samples)
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
                f"in the map of {of}, {names} cannot be told from the terms before over the training records and is "
                "left out; add tests at other values"
            )
        made.append(kept)
    return (made[0], made[1]), notes


def start_vector(e: MaxwellNarx, bases: tuple[Basis, Basis]) -> Array:
    """Coefficients of a Maxwell element over identifiable bases, k1 and the logarithm of tau."""
    return Parameters(bases[0].from_plain(e.k0), bases[1].from_plain(e.s0), e.k1, e.relaxation_time).to_vector()


def coefficient_names(bases: tuple[Basis, Basis]) -> list[str]:
    """Names of identifiable coefficients, for example ``"k0[u^2]"``."""
    maps = zip(("k0", "s0"), bases, strict=True)
    return [f"{of}[{POWER_NAMES[term]}]" for of, basis in maps for term in basis.terms] + ["k1", "tau"]


def identifiable_bases(
    e: MaxwellNarx, samples: list[Samples], bases: tuple[Basis, Basis]
) -> tuple[tuple[Basis, Basis], list[str]]:
    """Bases without the terms of s0 in s that k0 and k1 can stand for.

    ``k0 (s - s0)`` stays what it is if k0 grows by c and s0 becomes ``s - k0 (s - s0) / (k0 + c)``, and so does
    ``k0 + k1`` if k1 falls by c: where that is a polynomial of the map, the records cannot discriminate these.
    """
    notes: list[str] = []
    while True:
        jacobian = OutputErrors(samples, e.scheme, *bases).jacobian(start_vector(e, bases))
        sizes = np.linalg.norm(jacobian, axis=0)
        _, values, rows = np.linalg.svd(jacobian / np.where(sizes > 0.0, sizes, 1.0), full_matrices=False)
        terms, first = bases[1].terms, len(bases[0].terms)
        share = np.abs(rows[-1][first:-2])
        doubtful = [t for t, x in zip(terms, share, strict=True) if x > 0.01 and POWERS[t][1] > 0]
        if values[-1] > UNSEEN * values[0] or not doubtful:
            return bases, notes
        names = [n for n, x in zip(coefficient_names(bases), np.abs(rows[-1]), strict=True) if x > 0.01]
        out = f"s0[{POWER_NAMES[doubtful[-1]]}]"
        others = ", ".join(name for name in names if name != out)
        higher = any(t > doubtful[-1] for t in terms)
        where = " about the middle of the records" if higher else ""
        notes.append(f"{out}{where} is left out: no record can tell it from {others}, which can stand for it")
        bases = bases[0], Basis(bases[1].centre, bases[1].scale, tuple(t for t in terms if t != doubtful[-1]))


def standard_errors(
    problem: OutputErrors, x: Array, bases: tuple[Basis, Basis]
) -> tuple[tuple[Array, Array, float, float], list[str]]:
    """Standard errors of identifiable plain coefficients, and what the records do not tell."""
    jacobian, rest = problem.jacobian(x), problem.residual(x)
    sizes = np.linalg.norm(jacobian, axis=0)
    sizes[sizes == 0.0] = 1.0
    _, values, rows = np.linalg.svd(jacobian / sizes, full_matrices=False)
    seen = values > UNSEEN * values[0]
    names = coefficient_names(bases)
    notes = [
        "the records determine only a combination of "
        + ", ".join(names[i] for i in np.flatnonzero(np.abs(row) > 0.1))
        + "; the force is right, these values are one choice of many: take lower degrees"
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
            "k0 and s0 are strongly correlated in these records: they determine the force k0 (s - s0), but not its "
            "single coefficients; take lower degrees where these are wanted"
        )
    exact = np.sqrt(sigma2) < 1e-9 * max(float(np.abs(one.force).max()) for one in problem.records)
    if not exact and not inside(autocorrelation(rest, pieces, problem.records[0].step, "F")):
        notes.append(
            "the residual of the free runs is not white, so that more than the noise of the force is left in it and "
            "the standard errors are too small"
        )
    return (std[:10], std[10:20], float(std[20]), float(std[21])), notes
