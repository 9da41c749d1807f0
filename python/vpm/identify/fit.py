"""Parameters from data: bounded least squares on any problem, with honest uncertainty."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri, stdtrit

from vpm.errors import IdentificationError, VpmError
from vpm.experiment import Experiment, as_records, joints_from_shafts
from vpm.identify.balance import InverseDynamicsProblem
from vpm.identify.beginning import BegunAnywhere, begun_likeliest, matters
from vpm.identify.comparison import comparison
from vpm.identify.engine import Found, fit_problem
from vpm.identify.estimation import Estimate, Progress, blinded, estimate, limits
from vpm.identify.identifiability import RANK_TOLERANCE, Combination, column_lengths
from vpm.identify.missing import missing_effects, whiteness
from vpm.identify.moments import on_the_border
from vpm.identify.noise_left import Noise, noisy
from vpm.identify.objective import AnyProblem
from vpm.identify.own_simulation import Own, own_residual
from vpm.identify.prediction_error import PredictionErrorProblem
from vpm.identify.problem import gaps
from vpm.identify.remarks import constant_channels, contradictions, lost_channels, remarks, resting, touching
from vpm.identify.sandwich import freedom, pooled, record_groups, sandwich
from vpm.identify.settings import Checks, Fitting, OwnSimulation
from vpm.identify.shooting import ShootingProblem
from vpm.identify.ties import check_ties, tied, untied
from vpm.identify.whiteness import Whiteness
from vpm.model import Model
from vpm.one_thread import in_one_thread
from vpm.results import Result
from vpm.simulate import Setup

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

AnyEstimate = TypeVar("AnyEstimate", bound=Estimate)

#: Modes in which the model follows the measured motion of its joints.
FOLLOWING = frozenset({"inverse_dynamics", "prescribed_motion", "input_error"})
#: Times that an observer gets gains of the values that it led to, and the move (in deviations) after which it need not.
RENEWALS, SETTLED = 4, 0.1
#: Times that a fit beside unknown first states is begun again with what these do at its values, unless it has settled.
ROUNDS = 8
#: What `Fit.first_states` says where no log says them, and where they still moved in the last round.
UNKNOWN, UNSETTLED = "unknown", "unsettled"


@dataclass(frozen=True, repr=False, eq=False)
class Fit(Result):
    """Identified parameters.

    Attributes
    ----------
    mode : str
        Mode of comparison the residual came from.
    names, units : tuple of str
    start, values, std : ndarray, shape (p,)
        Before, after, and one standard deviation (robust against autocorrelated and unequal residuals).
    correlation : ndarray, shape (p, p)
    before, after : dict
        ``{channel: (root mean square, share of the measured signal, unit)}`` on the fitted data.
    unidentifiable : tuple of Combination
        Combinations of parameters that the data cannot see; they stayed where they were.
    at_bounds : tuple of str
        Estimates that rest on a bound: widen it or question the model.
    model : Model
        The model with the identified values.
    warnings : tuple of str
        What to know before the numbers are trusted, one sentence each: residuals that repeat with the motion, estimates
        that contradict the model file, rest on a bound, are still at their start, not identifiable, or collinear; too
        few samples; constant channels; a fit that Ctrl-C ended.
    whiteness : tuple of Whiteness
        What is left of each channel of each record, and how much of that the motion explains.
    freedom : ndarray, shape (p,), or float
        Degrees of freedom of Student's t in the intervals: fewer than samples, because neighbours resemble each other,
        and fewer still where a few moments of the records decide.
    noise : dict
        ``{channel: standard deviation}`` that residuals were divided by, SI; empty where it was the signal's spread.
    states, states_std : dict
        Fitted first states, ``{"record, 0 s: axis.position": value}``, and their standard deviations, SI.
    costs : ndarray, shape (starts,)
        Sum of squares that each start reached, the model's own values first.
    agreeing : int
        Starts that came within 1 % of the least sum of squares.
    evaluations : int
        Simulations of all records with derivatives.
    ended : str
        ``"converged"``, ``"evaluations"`` or ``"interrupted"``; empty for a fit without `Fitting`.
    first_states : str
        ``"unknown"`` where nobody measured them, as those of joints without an encoder in a balance of effort, or where
        those that the log suggests contradict the rest of it: the fit leaves them open. ``"unsettled"`` where it did
        not find them. Empty where they hold or are fitted.
    departures : ndarray, shape (records, states)
        By how much unknown first states are likeliest to differ from those that the log suggests; in a balance of
        effort those of coordinates, then rates, from a rest. Empty where none are unknown.
    expected : ndarray, shape (n,)
        What a balance of effort leaves of the model's own simulation, which was taken off. Empty where no simulation
        stays by the records: intervals then know nothing of what filters do where friction turns round.
    setup, fitting, ties
        How it was done, for `profile_intervals` and `bootstrap`.
    """

    mode: str
    experiments: tuple[str, ...]
    names: tuple[str, ...]
    units: tuple[str, ...]
    start: Array
    values: Array
    std: Array
    correlation: Array
    before: dict[str, tuple[float, float, str]]
    after: dict[str, tuple[float, float, str]]
    unidentifiable: tuple[Combination, ...]
    at_bounds: tuple[str, ...]
    model: Model
    warnings: tuple[str, ...] = ()
    whiteness: tuple[Whiteness, ...] = ()
    freedom: Array | float = np.inf
    noise: dict[str, float] = field(default_factory=dict)
    states: dict[str, float] = field(default_factory=dict)
    states_std: dict[str, float] = field(default_factory=dict)
    costs: Array = field(default_factory=lambda: np.zeros(0))
    agreeing: int = 1
    evaluations: int = 0
    ended: str = ""
    first_states: str = ""
    departures: Array = field(default_factory=lambda: np.zeros((0, 0)))
    expected: Array = field(default_factory=lambda: np.zeros(0))
    setup: Setup | None = None
    fitting: Fitting | None = None
    ties: dict[str, str] = field(default_factory=dict)

    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C ended the fit; the values are the best until then."""
        return self.ended == "interrupted"

    @property
    def intervals(self) -> Array:
        """95 % intervals, shape (p, 2)."""
        known = np.isfinite(self.freedom)
        half = np.where(known, stdtrit(np.where(known, self.freedom, 1.0), 0.975), ndtri(0.975)) * self.std
        return np.column_stack([self.values - half, self.values + half])

    def __getitem__(self, name: str) -> float:
        """Identified value of one parameter, SI."""
        if name not in self.names:
            raise IdentificationError(f"'{name}' was not free in this fit; free were {', '.join(self.names)}")
        return float(self.values[self.names.index(name)])

    def _headline(self) -> Mapping[str, object]:
        worst = max((share for _, share, _ in self.after.values()), default=0.0)
        values = dict(zip(self.names, map(float, self.values), strict=True))
        return {"mode": self.mode, **values, "residual": f"{100.0 * worst:.2f} %"}

    def _html_rows(self) -> Mapping[str, object]:
        rows = zip(self.names, self.values, self.std, self.units, strict=True)
        values = {name: f"{value:.6g} ± {std:.2g} {unit}" for name, value, std, unit in rows}
        return {**values, **{f"warning {i}": sentence for i, sentence in enumerate(self.warnings, 1)}}

    def _frame_columns(self) -> Mapping[str, object]:
        return {
            "name": list(self.names),
            "start": self.start,
            "value": self.values,
            "std": self.std,
            "unit": list(self.units),
        }

    def plot(self) -> Figure:
        """Values with their intervals, relative to the start. Needs the extra ``plot``."""
        from vpm.plot import plot_parameters

        return plot_parameters(self.names, self.values, self.std, self.start, self.units)


@in_one_thread
def identify(
    model: Model,
    experiments: Experiment | Sequence[Experiment],
    free: Sequence[str] | None = None,
    *,
    mode: str = "inverse_dynamics",
    cutoff: float | None = None,
    setup: Setup | None = None,
    ties: Mapping[str, str] | None = None,
    tolerance: float = 1e-8,
    progress: Progress | None = None,
    fitting: Fitting | None = None,
    checks: Checks | None = None,
    executor: Executor | Callable[[], Executor] | None = None,
) -> Fit:
    """Fit parameters of ``model`` to one or several experiments at once.

    Parameters
    ----------
    model : Model
    experiments : Experiment or sequence of Experiment
    free : sequence of str, optional
        Dotted names; by default every parameter that the model file gives an uncertainty.
    mode : str
        ``inverse_dynamics``, ``free_run``, ``restarts``, ``closed_loop``, ``prescribed_motion``, ``input_error`` or
        ``prediction_error``.
        Inverse dynamics is the linear regression of effort on motion; input error compares the logged commands with
        those that lead to what was measured; prediction error follows the log with an observer and compares each
        reading with what those before it say; the others are output-error fits through the simulation. Sensitivities
        are exact to rounding, those of input error near the truth.
    cutoff : float, optional
        Cut-off frequency of the motion filter, Hz.
    setup : Setup, optional
        Integrator, substeps and horizon of the simulated modes.
    ties : mapping of str to str, optional
        Parameters that take the value of another: ``{"gauge_2.gain.value": "gauge_1.gain.value"}`` fits one gain for
        two gauges. The other may be free or not; the fitted model holds the common value in both.
    tolerance : float
        Relative change of parameters or of the sum of squares at which to stop.
    progress : callable, optional
        Called with the number of evaluations and the weighted residual; with several starts, from their threads.
    fitting : Fitting, optional
        Weights, losses, priors, bounds, several starts, unknown first states, pieces.
    checks : Checks, optional
        When `Fit.warnings` says that the fit may be wrong.
    executor : Executor or callable, optional
        Does the fits from several starts of ``fitting``, one task each, see `vpm.tasks.Tasks`; the fit is the same.
        ``progress`` is then called after each of them.

    Returns
    -------
    Fit

    Raises
    ------
    ExecutorError
        The executor takes no work, or no start could be fitted there.
    IdentificationError
        Nothing is free, a name is unknown, a channel that the mode needs is missing, or a tie has no single meaning.
    """
    records = as_records(experiments)
    names = tuple(free) if free is not None else model.adjustable
    if not names:
        raise IdentificationError(
            f"{model.name}: no parameter is free; give some an uncertainty in the model file or name them in free="
        )
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise IdentificationError(f'"{twice[0]}" is named {names.count(twice[0])} times in free=; name it once')
    if mode in FOLLOWING:
        records = [joints_from_shafts(record, model, free=names) for record in records]
    data = comparison(model, records, mode, cutoff=cutoff, setup=setup, ties=ties, fitting=fitting, free=names)
    check_ties(model, ties or {}, names)
    data = _with_own_gains(model, data, names, tolerance)
    before, _ = data.evaluate(model, model.theta)
    data = beside_first_states(model, data, ties or {})
    if fitting is None:
        best = estimate(model, data, names, tolerance=tolerance, progress=progress, feasible=True)

        def onward(fitted: Model, less: AnyProblem, _: Estimate) -> Estimate:
            return estimate(fitted, less, names, tolerance=tolerance, feasible=True)

        data, best, settled = _from_anywhere(model, data, best, onward, ties or {}, checks or Checks())
        data, best, own = _beside_own(model, data, best, onward, ties or {})
        result = _with_intervals(data, best)
        weights = np.ones(len(result.residual))
        whole = replace(result, residual=result.residual + _expected(data))
        fit = fit_of(model, data, whole, before, [e.name for e in records], ties or {})
        fit = replace(fit, evaluations=result.evaluations, ended="interrupted" if result.interrupted else "")
    else:
        check_bounds(names, fitting)
        engine = partial(_by_engine, model, names, limits(model, names, fitting.bounds), fitting, tolerance)
        first = engine(data, progress=progress, executor=executor)

        def again(_: Model, less: AnyProblem, near: _Engineered) -> _Engineered:
            return engine(less, near=near)

        data, found, settled = _from_anywhere(model, data, first, again, ties or {})
        data, found, own = _beside_own(model, data, found, again, ties or {})
        result, weights = found, found.found.weights
        whole = replace(result, residual=result.residual + _expected(data))
        fit = fit_of(model, data, whole, before, [e.name for e in records], ties or {})
        fit = _with_details(fit, data, found.found)
    expected = _expected(data)
    fit = replace(fit, expected=expected if isinstance(expected, np.ndarray) else np.zeros(0))
    judged = whiteness(fit.model, records, data, result.residual, result.jacobian, checks or Checks())
    fit = replace(fit, setup=setup, fitting=fitting, ties=dict(ties or {}), whiteness=judged)
    slopes = result.jacobian[: data.blocks[-1].samples.stop]
    lengths = column_lengths(slopes)
    decided = freedom(slopes / lengths, data.blocks, len(names) + len(fit.states) + _unknown(data))[: len(names)]
    alike = own is None or own.alike
    fit = replace(_with_first_states(fit, data, settled and alike), freedom=decided)
    # What is known beforehand no noise of records moves.
    if own is not None and own.alike and not (fitting and fitting.priors):
        fit = _with_noise(fit, data, slopes / lengths, lengths, own.noise, weights[: len(slopes)])
    return replace(fit, warnings=_told(model, records, data, fit, checks or Checks()))


@dataclass(frozen=True, kw_only=True)
class _Engineered(Estimate):
    """An estimate of the engine, with all that this found."""

    found: Found


def _by_engine(
    model: Model,
    names: tuple[str, ...],
    box: tuple[Array, Array],
    fitting: Fitting,
    tolerance: float,
    data: AnyProblem,
    progress: Progress | None = None,
    near: _Engineered | None = None,
    executor: Executor | Callable[[], Executor] | None = None,
) -> _Engineered:
    """A fit by the engine, from all its starts or from ``near``; of these it then knows what their fits reached."""
    begin = near.values if near else None
    found = fit_problem(
        model, data, names, box, fitting, tolerance=tolerance, progress=progress, begin=begin, executor=executor
    )
    if near:
        evaluations = near.evaluations + found.evaluations
        found = replace(found, costs=near.found.costs, agreeing=near.found.agreeing, evaluations=evaluations)
    interrupted, at = found.ended == "interrupted", touching(names, found.values, *box)
    what = (found.residual, found.jacobian, found.covariance, found.unseen, at, found.evaluations, interrupted)
    return _Engineered(names, found.values, *what, found=found)


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


def _unknown(data: AnyProblem) -> int:
    """How many unknown first states a fit is beside."""
    plain = untied(data)
    return plain.unknown if isinstance(plain, BegunAnywhere) else 0


def _with_first_states(fit: Fit, data: AnyProblem, settled: bool) -> Fit:
    """The same with what it knows of unknown first states."""
    plain = untied(data)
    if not isinstance(plain, BegunAnywhere) or plain.departures is None:
        return fit
    return replace(fit, first_states=UNKNOWN if settled else UNSETTLED, departures=plain.departures)


def _from_anywhere(
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


def _beside_own(
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


def _with_noise(fit: Fit, data: AnyProblem, jacobian: Array, lengths: Array, noise: Noise, weights: Array) -> Fit:
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


def _expected(data: AnyProblem) -> Array | float:
    """What was taken off the residual."""
    plain = untied(data)
    return plain.expected if isinstance(plain, InverseDynamicsProblem) else 0.0


def _moved(model: Model, best: Estimate, ties: Mapping[str, str]) -> Model:
    """The model at estimates, and at those of what follows them."""
    values = dict(zip(best.names, map(float, best.values), strict=True))
    followers = {follower: values[leader] for follower, leader in ties.items() if leader in values}
    return model.with_parameters({**values, **followers})


def _with_intervals(data: AnyProblem, found: Estimate) -> Estimate:
    """The same with the covariance of a final estimate, which takes longer than that of a search."""
    lengths = column_lengths(found.jacobian)
    covariance = sandwich(found.jacobian / lengths, found.residual, record_groups(data.blocks))
    return replace(found, covariance=blinded(covariance / np.outer(lengths, lengths), found.unseen, found.names))


def _with_own_gains(model: Model, data: AnyProblem, names: tuple[str, ...], tolerance: float) -> AnyProblem:
    """An observer with the gains and the noise of the values that it leads to; other problems as they are."""
    if not isinstance(data, PredictionErrorProblem):
        return data
    columns = [model.index(name) for name in names]
    fitted = model
    for _ in range(RENEWALS):
        found = estimate(fitted, data, names, tolerance=tolerance)
        moved = np.abs(found.values - fitted.theta[columns])
        fitted = fitted.with_parameters(dict(zip(names, map(float, found.values), strict=True)))
        data = data.renewed(fitted)
        if np.all(moved[np.isfinite(found.std)] <= SETTLED * found.std[np.isfinite(found.std)]):
            break
    return data


def check_bounds(free: Sequence[str], fitting: Fitting) -> None:
    """Complain about bounds that cannot be meant.

    Raises
    ------
    IdentificationError
        Bounds of a parameter that is not free, or in the wrong order.
    """
    for name, (low, high) in fitting.bounds.items():
        if name not in free:
            raise IdentificationError(f'bounds: "{name}" is not free; free are {", ".join(free)}')
        if not low < high:
            raise IdentificationError(f'bounds of "{name}" are {low:g} and {high:g}; give the lower one first')


def _with_details(fit: Fit, data: AnyProblem, found: Found) -> Fit:
    shooting = untied(data)
    labels = shooting.labels if isinstance(shooting, ShootingProblem) else ()
    return replace(
        fit,
        noise=found.noise,
        states=dict(zip(labels, map(float, found.states), strict=True)),
        states_std=dict(zip(labels, map(float, found.states_std), strict=True)),
        costs=found.costs,
        agreeing=found.agreeing,
        evaluations=found.evaluations,
        ended=found.ended,
    )


def _told(model: Model, records: Sequence[Experiment], data: AnyProblem, fit: Fit, checks: Checks) -> tuple[str, ...]:
    replaced = (fit.fitting or Fitting()).bounds
    box = dict(zip(fit.names, zip(*limits(model, fit.names, replaced), strict=True), strict=True))
    border = on_the_border(fit.model, fit.names)
    held = {name: box[name] for name in resting(fit, box) if not any(name in names for names, _ in border)}
    told = missing_effects(fit.whiteness, checks)
    if fit.fitting is None or not fit.fitting.log or fit.fitting.priors:  # logarithms are for starts wrong by decades
        told += contradictions(model, fit, checks)
    told += remarks(
        fit.names,
        fit.start,
        fit.values,
        fit.std,
        fit.correlation,
        fit.unidentifiable,
        held,
        data.blocks,
        len(fit.states),
    )
    told += [sentence for _, sentence in border]
    told += constant_channels(model, records, data.blocks)
    told += lost_channels(fit.mode, fit.names, fit.after)
    if fit.first_states == UNSETTLED:
        told.insert(
            0,
            "first states that nobody measured were not found, or an effect is missing: begin with better values, give "
            "shorter records, or run `vpm diagnose`",
        )
    if fit.ended == "interrupted":
        told.insert(0, f"stopped by Ctrl-C after {fit.evaluations} evaluations: the values are the best until then")
    elif fit.ended == "evaluations":
        told.insert(0, f"not converged after {fit.evaluations} evaluations: allow more with most_evaluations")
    if fit.costs.size > 1 and 2 * fit.agreeing <= fit.costs.size:
        told.append(f"only {fit.agreeing} of {fit.costs.size} starts agree: the best may not be the least")
    return tuple(told)


def fit_of(
    model: Model,
    data: AnyProblem,
    result: Estimate,
    before: Array,
    experiments: Sequence[str],
    ties: Mapping[str, str] | None = None,
) -> Fit:
    """Dress an estimate as a result.

    Parameters
    ----------
    model : Model
        The model at the start values.
    data : problem
        What was fitted.
    result : Estimate
    before : ndarray
        Residual of the model that the fit is to be compared with.
    experiments : sequence of str
        Names of the records.
    ties : mapping of str to str, optional
        Parameters that take the value of another.
    """
    values = dict(zip(result.names, map(float, result.values), strict=True))
    shared = {follower: values.get(leader, model.parameters[leader].value) for follower, leader in (ties or {}).items()}
    fitted = model.with_parameters({**values, **shared})
    seen = np.isfinite(result.std)
    std = np.where(seen & (result.std > 0.0), result.std, 1.0)
    correlation = np.where(np.outer(seen, seen), result.covariance / np.outer(std, std), 0.0)
    np.fill_diagonal(correlation, 1.0)
    return Fit(
        data.mode,
        tuple(experiments),
        result.names,
        tuple(model.parameters[name].unit for name in result.names),
        model.theta[[model.index(name) for name in result.names]],
        result.values,
        result.std,
        correlation,
        gaps(data, before),
        gaps(data, result.residual),
        result.unseen,
        result.at_bounds,
        fitted,
    )
