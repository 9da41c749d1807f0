"""Parameters from data: bounded least squares on any problem, with honest uncertainty."""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from functools import partial

import numpy as np

from vpm.errors import IdentificationError
from vpm.experiment import Experiment, as_records
from vpm.identify.between_records import changed_between
from vpm.identify.closed_loop_prediction import Own
from vpm.identify.comparison import comparison, followed
from vpm.identify.diagnostics import (
    constant_channels,
    contradictions,
    joints_not_compared,
    lost_channels,
    remarks,
    resting,
)
from vpm.identify.engine import Found, fit_problem
from vpm.identify.estimation import Estimate, Progress, blinded, estimate, limits
from vpm.identify.fit_result import Fit, fit_of
from vpm.identify.identifiability import column_lengths
from vpm.identify.inverse_dynamics import InverseDynamicsProblem
from vpm.identify.missing import missing_effects, whiteness
from vpm.identify.moments import on_the_border
from vpm.identify.output_error import offset_blocks, taken_by_offsets, with_offsets
from vpm.identify.prediction_error import PredictionErrorProblem
from vpm.identify.problem import Problem, check_ties, untied
from vpm.identify.refitting import (
    UNSETTLED,
    beside_first_states,
    beside_own,
    expected,
    from_anywhere,
    unknown,
    with_first_states,
    with_noise,
)
from vpm.identify.response_along_motion import has_own_drives
from vpm.identify.settings import Checks, Fitting
from vpm.identify.shooting import ShootingProblem
from vpm.identify.statistics import freedom, record_groups, sandwich
from vpm.model import Model
from vpm.numbers import Array
from vpm.one_thread import in_one_thread
from vpm.simulate import AUTOMATIC, HOLDS, Setup, with_running_lengths
from vpm.simulate.setup import READ_BACK

#: Times that an observer gets gains of the values that it led to, and the move (in deviations) after which it need not.
RENEWALS, SETTLED = 4, 0.1
#: A first estimate, and what gives another one of other data from a model at an estimate.
_Ways = tuple[Estimate, Callable[[Model, Problem, Estimate], Estimate]]


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
        Integrator, substeps and horizon of the simulated modes, and the hold of commands. Where that is ``auto``,
        inverse dynamics also tries commands that were read back, if an effect seems to be missing.
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

    Raises
    ------
    ExecutorError
        The executor takes no work, or no start could be fitted there.
    IdentificationError
        Nothing is free, a name is unknown, a channel that the mode needs is missing, or a tie has no single meaning.
    """
    records, names, checks = as_records(experiments), _names(model, free), checks or Checks()
    setup = setup or Setup()
    if mode != "closed_loop":
        records, setup = with_running_lengths(model, records, setup)
    records = followed(model, records, mode, names)
    fitted = partial(
        _fitted, model, records, names, mode, cutoff, dict(ties or {}), tolerance, progress, fitting, checks, executor
    )
    fit = fitted(setup)
    # Held for a sample, commands that were read back come half a sample late: no effect is missing then.
    held = setup.hold == AUTOMATIC and mode == InverseDynamicsProblem.mode and not has_own_drives(model)
    if not held or fit.interrupted or not {*missing_effects(fit.whiteness, checks)} & {*fit.warnings}:
        return fit
    best = min((fit, *(fitted(replace(setup, hold=hold)) for hold in HOLDS[1:])), key=_left)
    if _left(best) > (1.0 - checks.read_back) * _left(fit):
        return fit
    return replace(best, warnings=(READ_BACK.format(hold=(best.setup or setup).hold), *best.warnings))


def _left(fit: Fit) -> float:
    """Mean square that a fit leaves, as a share of each signal, summed over channels."""
    return sum(share**2 for _, share, _ in fit.after.values())


def _fitted(
    model: Model,
    records: Sequence[Experiment],
    names: tuple[str, ...],
    mode: str,
    cutoff: float | None,
    ties: dict[str, str],
    tolerance: float,
    progress: Progress | None,
    fitting: Fitting | None,
    checks: Checks,
    executor: Executor | Callable[[], Executor] | None,
    setup: Setup,
) -> Fit:
    """Fit with a given setup."""
    data = comparison(model, records, mode, cutoff=cutoff, setup=setup, ties=ties, fitting=fitting, free=names)
    check_ties(model, ties, names)
    data = _with_own_gains(model, data, names, tolerance)
    before, _ = data.evaluate(model, model.theta)
    data = beside_first_states(model, data, ties)
    if fitting is None:
        first, again = _plainly(model, data, names, tolerance, progress)
    else:
        first, again = _by_engine(model, data, names, fitting, tolerance, progress, executor)
    data, found, settled = from_anywhere(model, data, first, again, ties, checks if fitting is None else None)
    data, found, own = beside_own(model, data, found, again, ties)
    fit = _dressed(model, data, found, before, [e.name for e in records], ties)
    fit = replace(fit, setup=setup, fitting=fitting, ties=ties)
    if isinstance(found, Found):
        fit = with_offsets(fit, data, found.weights)
    fit = _judged(fit, data, found, records, checks, settled, own)
    blind = {name for combination in fit.unidentifiable for name in combination.names}
    changed = changed_between(
        fit.names, fit.values, found.residual, found.jacobian, data.blocks, fit.units, blind, checks
    )
    # What such a record leaves repeats with its motion, too, and no effect is missing.
    told = _told(model, records, data, fit, checks, effects=not changed)
    return replace(fit, warnings=(*changed, *told))


def _names(model: Model, free: Sequence[str] | None) -> tuple[str, ...]:
    """Names of the parameters to fit: those of ``free=``, or all that the model file leaves open."""
    names = tuple(free) if free is not None else model.adjustable
    if not names:
        raise IdentificationError(
            f"{model.name}: no parameter is free; give some an uncertainty in the model file or name them in free="
        )
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise IdentificationError(f'"{twice[0]}" is named {names.count(twice[0])} times in free=; name it once')
    return names


def _plainly(model: Model, data: Problem, names: tuple[str, ...], tolerance: float, progress: Progress | None) -> _Ways:
    """Fit by least squares from the model's own values."""

    def again(fitted: Model, less: Problem, _: Estimate) -> Estimate:
        return estimate(fitted, less, names, tolerance=tolerance, nearest=True)

    return estimate(model, data, names, tolerance=tolerance, progress=progress, nearest=True), again


def _by_engine(
    model: Model,
    data: Problem,
    names: tuple[str, ...],
    fitting: Fitting,
    tolerance: float,
    progress: Progress | None,
    executor: Executor | Callable[[], Executor] | None,
) -> _Ways:
    """A fit by the engine from all its starts; later ones begin where the last one ended."""
    check_bounds(names, fitting)
    engine = partial(fit_problem, model, free=names, fitting=fitting, tolerance=tolerance)

    def again(_: Model, less: Problem, near: Estimate) -> Estimate:
        found = engine(less, begin=near.values)
        found = replace(found, evaluations=near.evaluations + found.evaluations)
        # What the starts reached, the first fit knows.
        return replace(found, costs=near.costs, agreeing=near.agreeing) if isinstance(near, Found) else found

    return engine(data, progress=progress, executor=executor), again


def _dressed(
    model: Model, data: Problem, found: Estimate, before: Array, records: Sequence[str], ties: Mapping[str, str]
) -> Fit:
    """Fit result of an estimate, with the covariance of a final one."""
    result = found if isinstance(found, Found) else _with_intervals(data, found)
    fit = fit_of(model, data, replace(result, residual=result.residual + expected(data)), before, records, ties)
    if isinstance(found, Found):
        return _with_details(fit, data, found)
    return replace(fit, evaluations=found.evaluations, ended="interrupted" if found.interrupted else "")


def _with_intervals(data: Problem, found: Estimate) -> Estimate:
    """Estimate with the covariance of a final fit, which takes longer than that of a search."""
    covariance = sandwich(found.jacobian, found.residual, record_groups(data.blocks))
    return replace(found, covariance=blinded(covariance, found.unseen, found.names))


def _judged(
    fit: Fit,
    data: Problem,
    found: Estimate,
    records: Sequence[Experiment],
    checks: Checks,
    settled: bool,
    own: Own | None,
) -> Fit:
    """Fit with the whiteness of its residual, and deviations that know of first states and noise of the records."""
    off = expected(data)
    fit = replace(fit, expected=off if isinstance(off, np.ndarray) else np.zeros(0))
    fit = replace(fit, whiteness=whiteness(fit.model, records, data, found.residual, found.jacobian, checks))
    slopes = found.jacobian[: data.blocks[-1].samples.stop]
    lengths = column_lengths(slopes)
    count = len(fit.names)
    others = len(fit.states) + unknown(data) + len(offset_blocks(data))
    decided = freedom(slopes / lengths, data.blocks, count + others)[:count]
    alike = own is None or own.alike
    fit = replace(with_first_states(fit, data, settled and alike), freedom=decided)
    # What is known beforehand no noise of records moves.
    if own is None or not own.alike or (fit.fitting and fit.fitting.priors):
        return fit
    weights = found.weights if isinstance(found, Found) else np.ones(len(found.residual))
    return with_noise(fit, data, slopes / lengths, lengths, own.noise, weights[: len(slopes)])


def _with_own_gains(model: Model, data: Problem, names: tuple[str, ...], tolerance: float) -> Problem:
    """Fit of an observer with the gains and noise of its own values; other problems as they are."""
    if not isinstance(data, PredictionErrorProblem):
        return data
    columns = [model.index(name) for name in names]
    fitted = model
    for _ in range(RENEWALS):
        found = estimate(fitted, data, names, tolerance=tolerance)
        moved = np.abs(found.values - fitted.theta[columns])
        fitted = found.on(fitted)
        data = data.renewed(fitted)
        if np.all(moved[np.isfinite(found.std)] <= SETTLED * found.std[np.isfinite(found.std)]):
            break
    return data


def check_bounds(free: Sequence[str], fitting: Fitting) -> None:
    """Refuse bounds of a fit that cannot be meant."""
    for name, (low, high) in fitting.bounds.items():
        if name not in free:
            raise IdentificationError(f'bounds: "{name}" is not free; free are {", ".join(free)}')
        if not low < high:
            raise IdentificationError(f'bounds of "{name}" are {low:g} and {high:g}; give the lower one first')


def _with_details(fit: Fit, data: Problem, found: Found) -> Fit:
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


def _told(
    model: Model, records: Sequence[Experiment], data: Problem, fit: Fit, checks: Checks, *, effects: bool
) -> tuple[str, ...]:
    """Diagnostics of a fit, and where ``effects``, of effects that may be missing."""
    replaced = (fit.fitting or Fitting()).bounds
    box = dict(zip(fit.names, zip(*limits(model, fit.names, replaced), strict=True), strict=True))
    border = on_the_border(fit.model, fit.names)
    held = {name: box[name] for name in resting(fit, box) if not any(name in names for names, _ in border)}
    told = missing_effects(fit.whiteness, checks) if effects else []
    if fit.fitting is None or not fit.fitting.log or fit.fitting.priors:  # logarithms are for starts wrong by decades
        told += contradictions(model, fit, checks)
    others = len(fit.states) + len(offset_blocks(data))
    told += remarks(fit, held, data.blocks, others, taken_by_offsets(fit, data))
    told += joints_not_compared(fit, model, records, data.blocks)
    told += [sentence for _, sentence in border]
    told += constant_channels(model, records, data.blocks)
    told += lost_channels(fit)
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
