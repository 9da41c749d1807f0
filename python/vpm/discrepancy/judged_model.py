"""Judged model: one fitted to training records, with what it leaves of validation records."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from vpm.discrepancy.screening.compliance_and_stop_start import ends_apart
from vpm.discrepancy.settings import FEW_EVALUATIONS, TOLERANCE
from vpm.errors import DivergedError
from vpm.identify import Estimate, InverseDynamicsProblem, OutputErrorProblem, estimate
from vpm.identify.estimation import MOST_EVALUATIONS, standing
from vpm.identify.response_along_motion import bends
from vpm.identify.tangent import estimate_on_tangent, has_tangent
from vpm.model import Model
from vpm.numbers import Array


@dataclass(frozen=True)
class Data:
    """Records of a diagnosis as problems by which models are fitted and judged, set up once."""

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


def judged_anyhow(
    start: Model, free: tuple[str, ...], data: Data, bounds: dict[str, tuple[float, float]]
) -> tuple[Judged, str]:
    """Judged model after a fit of ``free``; by the residual alone where it cannot simulate, with the reason.

    Where links bend and nothing else is worked out, their tangent at the start is taken.

    Raises KeyboardInterrupt: Ctrl-C ended the fit: its values say nothing of an effect.
    """
    bounds = ends_apart(start, free, bounds)
    if has_tangent(start, data.training):
        fit = estimate_on_tangent(start, data.training, free, start.theta, bounds=bounds, tolerance=TOLERANCE)
    else:
        most = FEW_EVALUATIONS if bends(start) and start.added_joints else MOST_EVALUATIONS
        fit = estimate(start, data.training, free, bounds=bounds, tolerance=TOLERANCE, most_evaluations=most)
    if fit.interrupted:
        raise KeyboardInterrupt
    return _judged(fit.on(start), free, fit, data, bounds)


def unmoved(model: Model, free: tuple[str, ...], data: Data, bounds: dict[str, tuple[float, float]]) -> Judged:
    """Judged model without a fit: its values stand, with the uncertainty of ``free``."""
    return _judged(model, free, standing(model, data.training, free), data, bounds)[0]


def _judged(
    model: Model, free: tuple[str, ...], fit: Estimate, data: Data, bounds: dict[str, tuple[float, float]]
) -> tuple[Judged, str]:
    """Judged model at its values, and why it cannot simulate the validation records, or ""."""
    validation, _ = data.validation.evaluate(model, model.theta)
    simulated, stopped = None, ""
    try:
        simulated = None if data.simulation is None else data.simulation.evaluate(model, model.theta)[0]
    except DivergedError as error:
        stopped = str(error)
    return Judged(model, free, fit, validation, simulated, bounds), stopped


def weaker(problem: InverseDynamicsProblem, current: Judged, judged: Judged) -> Array:
    """Factors, at least 1, by which a judged model has weaker actuators of each joint than the current (joints,).

    An effect that suppresses the command, or a gain that shrinks, leaves a small difference of two small efforts. So
    errors are compared relative to the effort. One drive may do so where others are stronger.
    """
    after, before = (problem.strengths(one.model) for one in (judged, current))
    return np.asarray(np.maximum(1.0, before / np.maximum(after, np.maximum(1e-6 * before, 1e-300))))


def shrinkage(problem: InverseDynamicsProblem, current: Judged, judged: Judged) -> Array:
    """Factor by which a judged model weakened the actuators behind each residual, see `weaker` (n,)."""
    factors_of_joints = weaker(problem, current, judged)
    # What else is logged is shown by the machine as a whole.
    factors = np.full(max(block.samples.stop for block in problem.blocks), np.max(factors_of_joints))
    for record in range(len(problem.motions)):
        for block, factor in zip(problem.efforts(record), factors_of_joints, strict=True):
            factors[block.samples] = factor
    return factors
