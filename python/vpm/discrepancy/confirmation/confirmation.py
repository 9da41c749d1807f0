"""Confirmation of a short-listed effect: refit the model with it, then predict validation records."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from vpm.discrepancy.screening.candidates import acts_on
from vpm.discrepancy.screening.compliance_and_stop_start import ends_apart
from vpm.discrepancy.screening.probe import Alias, Probe, size_is_clear
from vpm.discrepancy.settings import (
    FEW_EVALUATIONS,
    LEAST_GAIN,
    TOLERANCE,
)
from vpm.errors import DivergedError
from vpm.identify import (
    Estimate,
    Gain,
    InverseDynamicsProblem,
    OutputErrorProblem,
    estimate,
    gain,
    gaps,
    segments,
)
from vpm.identify.estimation import MOST_EVALUATIONS, standing
from vpm.identify.identifiability import least_step
from vpm.identify.response_along_motion import bends
from vpm.identify.tangent import estimate_on_tangent, has_tangent
from vpm.model import Model
from vpm.numbers import Array, power


@dataclass(frozen=True)
class Data:
    """Records of a diagnosis as problems for refits and their confirmation, set up once."""

    #: Inverse-dynamics residual on the records that are fitted and on those that are not.
    training: InverseDynamicsProblem
    validation: InverseDynamicsProblem
    simulation: OutputErrorProblem | None  #: Simulation of the validation records, the second criterion.


@dataclass(frozen=True)
class Judged:
    """Fitted model with its residuals on training and validation data, and bounds of its shapes."""

    model: Model
    free: tuple[str, ...]
    fit: Estimate
    validation: Array
    simulated: Array | None
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def kept_in(self, model: Model) -> tuple[tuple[str, ...], dict[str, tuple[float, float]]]:
        """Free parameters of a judged model that another model has too, and their bounds."""
        free = tuple(name for name in self.free if name in model.parameters)
        return free, {name: pair for name, pair in self.bounds.items() if name in free}


@dataclass(frozen=True)
class Trial:
    """Trial of a candidate: its refit, and its gain on training and validation records."""

    probe: Probe
    judged: Judged
    parameters: tuple[str, ...]  #: The effect's own fitted parameters.
    held: tuple[Alias, ...]
    #: Gains against the model without the effect; by simulation only where there is one.
    training: Gain
    validation: Gain
    simulated: Gain | None
    diverged: str  #: Why the simulation of the validation records stopped, or "".
    clear: bool  #: Whether the effect's size differs from zero on the training data.
    error: float = 0.0  #: Largest share of its signal that the model without the effect leaves of a validation channel.
    size: float = np.inf  #: Largest amplitude that the effect takes of a validation channel, as a share of its signal.
    here: Gain | None = None  #: The validation gain at the joint where the effect acts, if nothing is lost elsewhere.

    @property
    def there(self) -> Gain:
        """Validation gain of a confirmation trial on the joint where the effect acts most."""
        return self.validation if self.here is None else max(self.validation, self.here, key=lambda one: one.relative)


def judge(model: Model, free: tuple[str, ...], data: Data, bounds: dict[str, tuple[float, float]]) -> Judged:
    """Confirmation's judgement: fit ``free`` on training records, predict validation records.

    Where links bend and nothing else is worked out, their tangent at the start is taken.

    Raises DivergedError: the fitted model cannot simulate the validation records.

    Raises KeyboardInterrupt: Ctrl-C ended the fit: its values say nothing of a candidate.
    """
    bounds = ends_apart(model, free, bounds)
    if has_tangent(model, data.training):
        fit = estimate_on_tangent(model, data.training, free, model.theta, bounds=bounds, tolerance=TOLERANCE)
    else:
        most = FEW_EVALUATIONS if bends(model) and model.added_joints else MOST_EVALUATIONS
        fit = estimate(model, data.training, free, bounds=bounds, tolerance=TOLERANCE, most_evaluations=most)
    if fit.interrupted:
        raise KeyboardInterrupt
    fitted = model.with_parameters(dict(zip(free, map(float, fit.values), strict=True)))
    validation, _ = data.validation.evaluate(fitted, fitted.theta)
    simulated = None if data.simulation is None else data.simulation.evaluate(fitted, fitted.theta)[0]
    return Judged(fitted, free, fit, validation, simulated, bounds)


def unmoved(
    model: Model, free: tuple[str, ...], data: Data, bounds: dict[str, tuple[float, float]]
) -> tuple[Judged, str]:
    """Confirmation's judgement without a fit: parameter uncertainty, and why it cannot simulate, or ""."""
    fit = standing(model, data.training, free)
    validation, _ = data.validation.evaluate(model, model.theta)
    simulated, stopped = None, ""
    try:
        simulated = None if data.simulation is None else data.simulation.evaluate(model, model.theta)[0]
    except DivergedError as error:
        stopped = str(error)
    return Judged(model, free, fit, validation, simulated, bounds), stopped


def measured(
    current: Judged,
    data: Data,
    probe: Probe,
    judged: Judged,
    own: tuple[str, ...],
    held: tuple[Alias, ...],
    diverged: str,
) -> Trial:
    """Confirmed gain of a refit on all data."""
    fitted = judged.fit.residual * shrinkage(data.training, current, judged)
    validation = judged.validation * shrinkage(data.validation, current, judged)
    before, after = (
        [share for _, share, _ in gaps(data.validation, residual).values()]
        for residual in (current.validation, judged.validation)
    )
    return Trial(
        probe,
        judged,
        own,
        held,
        gain(current.fit.residual, fitted, segments(data.training)),
        gain(current.validation, validation, segments(data.validation)),
        simulated_gain(current, judged, data),
        diverged,
        is_clear(judged, own),
        error=max(before),
        size=max(float(np.sqrt(max(one**2 - other**2, 0.0))) for one, other in zip(before, after, strict=True)),
        here=_where_it_acts(current, validation, data.validation, probe.candidate.site),
    )


def judged_anyhow(
    start: Model, free: tuple[str, ...], data: Data, bounds: dict[str, tuple[float, float]]
) -> tuple[Judged, str]:
    """Confirmation's judgement by the residual alone where a fit cannot simulate, with the reason."""
    try:
        return judge(start, free, data, bounds), ""
    except DivergedError as error:
        return judge(start, free, replace(data, simulation=None), bounds), str(error)


def weaker(problem: InverseDynamicsProblem, current: Judged, judged: Judged) -> Array:
    """Factors, at least 1, by which a confirmation refit weakened the actuators of each joint (joints,).

    An effect that suppresses the command, or a gain that shrinks, leaves a small difference of two small efforts. So
    errors are compared relative to the effort. One drive may do so where others are stronger.
    """
    after, before = (problem.strengths(one.model) for one in (judged, current))
    return np.asarray(np.maximum(1.0, before / np.maximum(after, np.maximum(1e-6 * before, 1e-300))))


def shrinkage(problem: InverseDynamicsProblem, current: Judged, judged: Judged) -> Array:
    """Factor by which a confirmation refit weakened the actuators behind each residual, see `weaker` (n,)."""
    factors_of_joints = weaker(problem, current, judged)
    # What else is logged is shown by the machine as a whole.
    factors = np.full(max(block.samples.stop for block in problem.blocks), np.max(factors_of_joints))
    for record in range(len(problem.motions)):
        for block, factor in zip(problem.efforts(record), factors_of_joints, strict=True):
            factors[block.samples] = factor
    return factors


def _where_it_acts(current: Judged, validation: Array, problem: InverseDynamicsProblem, site: str) -> Gain | None:
    """Confirmed gain in the effort at the joint where the effect acts, or of all joints for a body; None without one.

    Where nothing but one effort is compared, it is the whole gain.
    """
    lost = power(validation) > power(current.validation)
    if len(problem.blocks) == len(problem.motions) or lost:
        return None
    return gain_at(current.model, problem, site, current.validation, validation)


def gain_at(model: Model, problem: InverseDynamicsProblem, site: str, before: Array, after: Array) -> Gain | None:
    """Confirmed gain between two residuals (n,) in efforts of the joint at a site; None where no effort is compared."""
    here = acts_on(model, problem, site)
    return gain(here * before, here * after, segments(problem)) if np.any(here) else None


def simulated_gain(current: Judged, judged: Judged, data: Data) -> Gain | None:
    """Confirmed gain by simulation of the validation records; None where a model cannot simulate them."""
    if data.simulation is None or current.simulated is None or judged.simulated is None:
        return None
    return gain(current.simulated, judged.simulated, segments(data.simulation))


def _as_stated(judged: Judged) -> Array:
    """Covariance of a confirmed estimate beside stated uncertainties, which are measurements of their own.

    The update of a Kalman filter (G. Welch and G. Bishop, *An Introduction to the Kalman Filter*, 1995, equation 1.11).
    """
    full = judged.fit.covariance.copy()
    spread = np.array([judged.model.parameters[name].uncertainty or np.inf for name in judged.free])
    seen = np.isfinite(np.diag(full))
    stated = seen & np.isfinite(spread)
    across = full[np.ix_(seen, stated)]
    both = full[np.ix_(stated, stated)] + np.diag(spread[stated] ** 2)
    full[np.ix_(seen, seen)] -= across @ np.linalg.solve(both, across.T)
    return full


def is_clear(judged: Judged, own: tuple[str, ...]) -> bool:
    """Whether the size of a confirmed effect differs from zero: a Wald test of its linear parameters together.

    Size and shape of a law often compensate each other, such as a higher friction close to rest that fades sooner. A
    law without size has no uncertain shape. The size of a backlash is its width, however hard its contacts are. Of
    nearly rigid contacts no data bound the stiffness from above. Parameters are no less certain than the file states:
    where a drive's constant and all masses may grow together, a payload's mass is known as well as that constant.
    """
    widths = {effect.parameter_names["gap"] for effect in judged.model.effects if effect.type.has_play}
    size = [n for n in own if n in widths]
    size = size or [n for n in own if judged.model.parameters[n].kind == "linear"] or list(own)
    shape = [judged.free.index(name) for name in own if name not in size]
    index = [judged.free.index(name) for name in size]
    full = _as_stated(judged)
    covariance = full[np.ix_(index, index)]
    if shape and np.all(np.isfinite(full[np.ix_(index + shape, index + shape)])):
        across = full[np.ix_(index, shape)]
        covariance = covariance - across @ np.linalg.pinv(full[np.ix_(shape, shape)], hermitian=True) @ across.T
    return size_is_clear(size, judged.fit.values[index], covariance)


@dataclass(frozen=True)
class InTime:
    """Residuals of a fitted model with the best shift in the timing of all commands, within one interval.

    A logged command may hold from its sample on, until its sample, or as the mean over the interval; the log does not
    tell. What a shift within one interval explains is therefore no missing physics.
    """

    #: Residuals on training and validation records.
    fitted: Array
    validation: Array
    shift: float  #: How much later the commands hold, in sampling intervals; 0 where a shift does not matter.


def in_time(judged: Judged, data: Data) -> InTime:
    """Residuals after the best shift of command timing, to first order; free parameters move with it."""
    predict = InTime(judged.fit.residual, judged.validation, 0.0)
    model = judged.model
    later, _ = data.training.later().evaluate(model, model.theta)
    own = judged.fit.residual
    change, known = later - own, judged.fit.jacobian
    # Free parameters give way to the shift and do nothing else: one that its bounds hold has to stay where it is.
    step = least_step(known, change)
    rest = change + known @ step
    if power(rest) <= 1e-20 * power(change):
        return predict
    shift = float(np.clip(-(rest @ own) / power(rest), -1.0, 1.0))
    fitted = own + shift * rest
    if gain(own, fitted, segments(data.training)).relative < LEAST_GAIN:
        return predict
    columns = [model.index(name) for name in judged.free]
    own_validation, slopes = data.validation.evaluate(model, model.theta, columns)
    later_validation, _ = data.validation.later().evaluate(model, model.theta)
    validation = own_validation + shift * (later_validation - own_validation + slopes @ step)
    if gain(own_validation, validation, segments(data.validation)).relative < LEAST_GAIN:
        return predict
    return InTime(fitted, validation, shift)
