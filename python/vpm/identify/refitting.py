"""Fits that begin from one another: beside first states, less the model's own residual, on other records."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from vpm.errors import VpmError
from vpm.experiment import Experiment, as_records
from vpm.identify.closed_loop_prediction import Noise, Own, noisy, own_residual
from vpm.identify.comparison import comparison, followed
from vpm.identify.estimation import Estimate
from vpm.identify.first_states import BegunAnywhere, begun_likeliest, matters
from vpm.identify.fit_result import Fit
from vpm.identify.identifiability import RANK_TOLERANCE
from vpm.identify.inverse_dynamics import InverseDynamicsProblem
from vpm.identify.problem import Gaps, Problem, gaps, tied, untied
from vpm.identify.settings import Checks, OwnSimulation
from vpm.identify.statistics import pooled
from vpm.model import Model
from vpm.numbers import Array

AnyEstimate = TypeVar("AnyEstimate", bound=Estimate)

#: Times that a fit beside unknown first states is begun again with what these do at its values, and the move (in
#: deviations) after which it has settled.
ROUNDS, SETTLED = 8, 0.1
#: What `Fit.first_states` says where no log says them, and where they still moved in the last round.
UNKNOWN, UNSETTLED = "unknown", "unsettled"


def beside_first_states(model: Model, data: Problem, ties: Mapping[str, str]) -> Problem:
    """Problem to refit beside first states of unmeasured motion; others as they are.

    ``model``: at whose values these are the likeliest.
    """
    plain = untied(data)
    if not isinstance(plain, InverseDynamicsProblem) or not np.any(plain.open_states(model)[0]):
        return data
    return tied(begun_likeliest(model, plain), ties)


def unknown(data: Problem) -> int:
    """Number of unknown first states beside which a fit is refitted."""
    plain = untied(data)
    return plain.unknown if isinstance(plain, BegunAnywhere) else 0


def with_first_states(fit: Fit, data: Problem, settled: bool) -> Fit:
    """Refit with the unknown first states of its records, as its problem knows them."""
    plain = untied(data)
    if not isinstance(plain, BegunAnywhere) or plain.departures is None:
        return fit
    return replace(fit, first_states=UNKNOWN if settled else UNSETTLED, departures=plain.departures)


def from_anywhere(
    model: Model,
    data: Problem,
    best: AnyEstimate,
    onward: Callable[[Model, Problem, AnyEstimate], AnyEstimate],
    ties: Mapping[str, str],
    checks: Checks | None = None,
) -> tuple[Problem, AnyEstimate, bool]:
    """Refit beside unknown first states, begun where they are likeliest, and whether it settled.

    Where logs suggest them, they are unknown if ``checks`` find them wrong.
    """
    plain, fitted = untied(data), best.on(model, ties)
    if best.interrupted or not isinstance(plain, BegunAnywhere):
        return data, best, True
    if not plain.unknown and not (checks and matters(fitted, plain, best.residual, best.jacobian, checks)):
        return data, best, True
    for _ in range(ROUNDS):
        before, plain = best.values, begun_likeliest(fitted, plain)
        data = tied(plain, ties)
        best = onward(fitted, data, best)
        fitted, seen = best.on(model, ties), np.isfinite(best.std)
        if best.interrupted or np.all(np.abs(best.values - before)[seen] <= SETTLED * best.std[seen]):
            return data, best, True
    return data, best, False


def beside_own(
    model: Model,
    data: Problem,
    best: AnyEstimate,
    onward: Callable[[Model, Problem, AnyEstimate], AnyEstimate],
    ties: Mapping[str, str],
) -> tuple[Problem, AnyEstimate, Own | None]:
    """Refit of an inverse-dynamics residual less that of the model's own simulation, if any.

    It goes ``onward`` from the fitted model and its estimate.
    What the records do not show a correction would move without end. With it comes the last simulation, or one that is
    not like the records.
    """
    plain = untied(data)
    last: Own | None = None
    if best.interrupted or not isinstance(plain, InverseDynamicsProblem):
        return data, best, None
    for _ in range(OwnSimulation().rounds):
        fitted = best.on(model, ties)
        own = own_residual(fitted, plain)
        if own is None or not own.alike:
            last = last or own
            break
        last, before = own, best.values
        data = tied(plain.less(own.expected), ties)
        best = onward(fitted, data, best)
        seen = np.isfinite(best.std)
        if best.interrupted or np.all(np.abs(best.values - before)[seen] <= best.std[seen]):
            break
    return data, best, last


def with_noise(fit: Fit, data: Problem, jacobian: Array, lengths: Array, noise: Noise, weights: Array) -> Fit:
    """Refit whose deviations contain how far record noise moves the estimates.

    Columns of the jacobian are divided by their ``lengths``; rows went into the fit with their ``weights``.
    """
    plain = untied(data)
    if not isinstance(plain, InverseDynamicsProblem):
        return fit
    how, fitted = OwnSimulation(), fit.model
    try:
        without = plain.on(plain.experiments).evaluate(fitted, fitted.theta)[0]
        drawn = noisy(fitted, plain, noise, np.random.default_rng(0), how.draws) - without
    except (VpmError, ArithmeticError, np.linalg.LinAlgError):
        return fit  # with noise the model does not stay by its records
    errors = (weights * drawn) @ np.linalg.pinv(weights[:, None] * jacobian, RANK_TOLERANCE).T / lengths
    variance, decided = pooled(fit.std**2, np.asarray(fit.freedom), errors, how.contradicted)
    return replace(fit, std=np.sqrt(variance), freedom=decided)


def expected(data: Problem) -> Array | float:
    """Expected residual (n,) that was taken off a refitted problem; 0 without one."""
    plain = untied(data)
    return plain.expected if isinstance(plain, InverseDynamicsProblem) else 0.0


def judged_on(
    fit: Fit, model: Model, experiments: Experiment | Sequence[Experiment], *, cutoff: float | None = None
) -> tuple[Gaps, Gaps]:
    """Errors of model and validation records before and after a refit, in the fit's own mode.

    First states that the fit found belong to its own records; here they begin as for any simulation of a log, but for
    those that are known, and for those that nobody measures along a motion: a residual is beside these.

    Parameters
    ----------
    model : Model
        As it was before the fit.
    cutoff : float, optional
        As for the fit.

    Returns
    -------
    before, after : dict
        ``{channel: (root mean square, share of the measured signal, unit)}``.

    Raises
    ------
    DivergedError
        The simulation leaves the finite numbers.
    """
    records = followed(model, as_records(experiments), fit.mode)
    fitting = fit.fitting and replace(fit.fitting, states=())
    result = []
    for machine in (model, fit.model):
        data = comparison(machine, records, fit.mode, cutoff=cutoff, setup=fit.setup, fitting=fitting)
        data = beside_first_states(machine, data, {})
        result.append(gaps(data, data.evaluate(machine, machine.theta)[0]))
    return result[0], result[1]
