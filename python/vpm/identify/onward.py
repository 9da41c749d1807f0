"""Fits that go on from one another: beside first states that nobody measured, and less what a balance always leaves."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from vpm.errors import VpmError
from vpm.identify.balance import InverseDynamicsProblem
from vpm.identify.beginning import BegunAnywhere, begun_likeliest, matters
from vpm.identify.estimation import Estimate
from vpm.identify.fitted import Fit
from vpm.identify.identifiability import RANK_TOLERANCE
from vpm.identify.noise_left import Noise, noisy
from vpm.identify.objective import AnyProblem
from vpm.identify.own_simulation import Own, own_residual
from vpm.identify.sandwich import pooled
from vpm.identify.settings import Checks, OwnSimulation
from vpm.identify.ties import tied, untied
from vpm.model import Model

Array = NDArray[np.float64]

AnyEstimate = TypeVar("AnyEstimate", bound=Estimate)

#: Times that a fit beside unknown first states is begun again with what these do at its values, and the move (in
#: deviations) after which it has settled.
ROUNDS, SETTLED = 8, 0.1
#: What `Fit.first_states` says where no log says them, and where they still moved in the last round.
UNKNOWN, UNSETTLED = "unknown", "unsettled"


def beside_first_states(model: Model, data: AnyProblem, ties: Mapping[str, str]) -> AnyProblem:
    """A balance beside the first states of what moves along the motion that nobody measured; others as they are.

    Parameters
    ----------
    model : Model
        At whose values these are the likeliest.
    data : problem
    ties : mapping of str to str
    """
    plain = untied(data)
    if not isinstance(plain, InverseDynamicsProblem) or not np.any(plain.open_states(model)[0]):
        return data
    return tied(begun_likeliest(model, plain), ties)


def unknown(data: AnyProblem) -> int:
    """How many unknown first states a fit is beside."""
    plain = untied(data)
    return plain.unknown if isinstance(plain, BegunAnywhere) else 0


def with_first_states(fit: Fit, data: AnyProblem, settled: bool) -> Fit:
    """The same with what it knows of unknown first states."""
    plain = untied(data)
    if not isinstance(plain, BegunAnywhere) or plain.departures is None:
        return fit
    return replace(fit, first_states=UNKNOWN if settled else UNSETTLED, departures=plain.departures)


def from_anywhere(
    model: Model,
    data: AnyProblem,
    best: AnyEstimate,
    onward: Callable[[Model, AnyProblem, AnyEstimate], AnyEstimate],
    ties: Mapping[str, str],
    checks: Checks | None = None,
) -> tuple[AnyProblem, AnyEstimate, bool]:
    """The fit beside unknown first states, begun again where they are likeliest at its values, and whether it settled.

    Where logs suggest them, they are unknown if ``checks`` find them wrong.
    """
    plain, fitted = untied(data), _moved(model, best, ties)
    if best.interrupted or not isinstance(plain, BegunAnywhere):
        return data, best, True
    if not plain.unknown and not (checks and matters(fitted, plain, best.residual, best.jacobian, checks)):
        return data, best, True
    for _ in range(ROUNDS):
        before, plain = best.values, begun_likeliest(fitted, plain)
        data = tied(plain, ties)
        best = onward(fitted, data, best)
        fitted, seen = _moved(model, best, ties), np.isfinite(best.std)
        if best.interrupted or np.all(np.abs(best.values - before)[seen] <= SETTLED * best.std[seen]):
            return data, best, True
    return data, best, False


def beside_own(
    model: Model,
    data: AnyProblem,
    best: AnyEstimate,
    onward: Callable[[Model, AnyProblem, AnyEstimate], AnyEstimate],
    ties: Mapping[str, str],
) -> tuple[AnyProblem, AnyEstimate, Own | None]:
    """The fit of a balance of effort less what it leaves of the model's own simulation, where that can be told.

    It goes ``onward`` from the fitted model and its estimate.
    What the records do not show a correction would move without end. With it comes the last simulation, or one that is
    not like the records.
    """
    plain = untied(data)
    last: Own | None = None
    if best.interrupted or not isinstance(plain, InverseDynamicsProblem):
        return data, best, None
    for _ in range(OwnSimulation().rounds):
        fitted = _moved(model, best, ties)
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


def with_noise(fit: Fit, data: AnyProblem, jacobian: Array, lengths: Array, noise: Noise, weights: Array) -> Fit:
    """The same with deviations that know how far the noise of the records moves the estimates.

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


def expected(data: AnyProblem) -> Array | float:
    """What was taken off the residual."""
    plain = untied(data)
    return plain.expected if isinstance(plain, InverseDynamicsProblem) else 0.0


def _moved(model: Model, best: Estimate, ties: Mapping[str, str]) -> Model:
    """The model at estimates, and at those of what follows them."""
    values = dict(zip(best.names, map(float, best.values), strict=True))
    followers = {follower: values[leader] for follower, leader in ties.items() if leader in values}
    return model.with_parameters({**values, **followers})
