"""Delays of drives and instruments on a machine that sticks, estimated from closed-loop predictions.

Where a joint sticks, the inverse-dynamics residual along the measured motion shows a late break-away, with or without a
delay. The estimated delay comes out too long, and the transition of friction too wide. In closed loop a machine sticks
when its model sticks, so a closed-loop prediction (`vpm.discrepancy.confirmation.whittle_likelihood`) separates both.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from vpm.discrepancy.confirmation.delay_in_motion import WITHIN, Timed, timed_in_motion
from vpm.discrepancy.confirmation.whittle_likelihood import ClosedLoopPrediction, fit_prediction
from vpm.errors import VpmError
from vpm.identify import Gain, InverseDynamicsProblem, OutputErrorProblem, gain, segments
from vpm.model import Model

#: Drop of the validation mean square in motion from which on a delay gets a prediction, which takes seconds.
WORTH_A_RUN = 0.1


def timed_in_closed_loop(
    current: tuple[Model, Sequence[str]],
    late: tuple[Model, Sequence[str]],
    training: InverseDynamicsProblem,
    validation: InverseDynamicsProblem,
    simulation: OutputErrorProblem | None,
    bounds: Mapping[str, tuple[float, float]],
) -> tuple[Timed | None, ClosedLoopPrediction | None]:
    """Delay fitted in motion, narrowed by the interval of a closed-loop prediction of training records.

    Parameters
    ----------
    current, late : (Model, sequence of str)
        Without the effect and with it, each with its free parameters; those that only ``late`` has are the effect's.
    training, validation : InverseDynamicsProblem
    simulation : OutputErrorProblem or None
        How the validation records are simulated; only a closed loop is predicted.
    bounds : mapping
        Bounds of free parameters that replace those of the models.

    Returns
    -------
    timed : Timed or None
        None where too few samples are in motion.
    run : ClosedLoopPrediction or None
        None where the effect has no predicted gain in motion, or there is no prediction.
    """
    timed = timed_in_motion(current, late, training, validation, bounds)
    if timed is None or timed.validation.relative < WORTH_A_RUN:
        return timed, None
    if simulation is None or simulation.mode != "closed_loop":
        return timed, None
    try:
        run = fit_prediction(*late, training.experiments, simulation.setup)
    except VpmError:
        return timed, None
    near = dict(bounds)
    for name in (name for name in late[1] if name not in current[1]):
        value, std = run.estimated(name)
        near[name] = max(late[0].parameters[name].minimum, value - WITHIN * std), value + WITHIN * std
    return timed_in_motion(current, late, training, validation, near), run


def gain_in_closed_loop(
    model: Model, free: Sequence[str], late: ClosedLoopPrediction, simulation: OutputErrorProblem
) -> Gain | None:
    """Validation gain of a delay in closed-loop simulations, each model with the parameters of its own prediction.

    A transition of friction that is too wide imitates the delay in a simulation without it, and doubles it with it.
    None where the model without it has no prediction.
    """
    try:
        before = fit_prediction(model, free, late.problem.experiments, simulation.setup)
        left = [simulation.evaluate(run.model, run.model.theta)[0] for run in (before, late)]
    except VpmError:
        return None
    return gain(left[0], left[1], segments(simulation))
