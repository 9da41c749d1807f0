"""All coefficients of an element together, from one that is near: kept where that is better."""

from collections.abc import Sequence

import numpy as np

from vpm.errors import IdentificationError
from vpm.narx.maxwell import MaxwellNarx
from vpm.narx.maxwell_basis import Basis
from vpm.narx.maxwell_identifiability import basis_around, identifiable_bases, standard_errors, start_vector, widened
from vpm.narx.maxwell_problem import OutputErrors, Parameters
from vpm.narx.maxwell_records import MaxwellSignals, Samples, element_samples
from vpm.narx.maxwell_result import MaxwellFit, training_rmse, unrefined
from vpm.narx.records import RecordLike

Records = RecordLike | Sequence[RecordLike]

#: Fewest samples of a record or window in motion.
LEAST = 20
#: Share by which a refinement has to be better, beyond rounding.
BETTER = 1e-9
#: Relative distance of tau from what records can show that counts as none.
NEAR = 1e-3


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

    Parameters
    ----------
    samples : list of Samples
        Training records.
    bases : tuple of two Basis
        Of k0 and s0, with the terms to fit.
    degree : int, optional
        Of both maps; by default the terms of the bases.

    Raises
    ------
    IdentificationError
        Fewer than two samples for each coefficient.
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
