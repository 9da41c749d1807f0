"""Closed-loop predictions of two models, compared where the inverse-dynamics residual leaves two answers open.

The residual covers a few hertz along a filtered, noisy motion. Where a joint sticks, one reversal may outweigh all
else. A closed-loop prediction is compared at every frequency with the noise that is left there
(`vpm.discrepancy.confirmation.whittle_likelihood`). Two models with nearly the same residual may differ by tens of
standard deviations in their predictions. Training and validation records give the share of that difference that they
support: zero if the first model is right, one if its rival is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vpm.discrepancy.confirmation.confirmation import Data, Judged
from vpm.discrepancy.confirmation.friction_near_rest import LEAST_SUPPORT, gain_of_predictions
from vpm.discrepancy.confirmation.low_frequency import has_impacts
from vpm.discrepancy.confirmation.refusal import MODEST_FACTOR, Thresholds
from vpm.discrepancy.confirmation.whittle_likelihood import ClosedLoopPrediction, fit_prediction, misfit, predict
from vpm.errors import VpmError
from vpm.identify import Gain
from vpm.identify.response_along_motion import bends, has_own_drives
from vpm.model import Model

#: Log likelihood ratio of the training records, for two models fitted to the residual, from which on both are fitted to
#: the records in closed loop.
WORTH_A_FIT = 10.0


@dataclass(frozen=True)
class Comparison:
    """What records say of the change from one run of a model to another.

    Attributes
    ----------
    training, validation : Gain
        Of what the first run leaves, relative to the noise at each frequency.
    run : ClosedLoopPrediction
        The second one, along the training records.
    better : float
        Logarithm of how many times as likely the validation records are with the second one.
    """

    training: Gain
    validation: Gain
    run: ClosedLoopPrediction
    better: float

    def sure(self, thresholds: Thresholds) -> bool:
        """Whether both sets of records support all of the change, beyond chance and what models leave out."""
        return self.better > 0.0 and all(
            LEAST_SUPPORT <= gained.weight <= 1.0 / LEAST_SUPPORT
            and gained.score >= MODEST_FACTOR * thresholds.score(gained.pieces)
            for gained in (self.training, self.validation)
        )


def can_predict(model: Model, data: Data) -> bool:
    """Whether a model can be asked: in closed loop, with nothing in it that takes long or falls into chaos."""
    closed = data.simulation is not None and data.simulation.mode == "closed_loop"
    return closed and not bends(model) and not has_own_drives(model) and not has_impacts(model)


def predicted(judged: Judged, data: Data) -> ClosedLoopPrediction | None:
    """A fitted model as it is, run along the training records; None if it cannot follow its references."""
    if data.simulation is None or not can_predict(judged.model, data):
        return None
    try:
        return predict(judged.model, judged.free, data.training.experiments, data.simulation.setup)
    except VpmError:
        return None


def fitted_prediction(run: ClosedLoopPrediction, data: Data) -> ClosedLoopPrediction | None:
    """A run with the parameters that suit the training records best."""
    if data.simulation is None:
        return None
    try:
        return fit_prediction(run.model, run.free, data.training.experiments, data.simulation.setup)
    except VpmError:
        return None


def compared(first: ClosedLoopPrediction, second: ClosedLoopPrediction, data: Data) -> Comparison | None:
    """Support of all records for the change from one run to another; None where one of them diverges."""
    if data.simulation is None:
        return None
    try:
        validation = [
            predict(run.model, run.free, data.validation.experiments, data.simulation.setup) for run in (first, second)
        ]
    except VpmError:
        return None
    better = misfit(validation[0]) - misfit(validation[1])
    return Comparison(gain_of_predictions(first, second), gain_of_predictions(*validation), second, better)


def criterion(run: ClosedLoopPrediction) -> float:
    """Information criterion of a run: minus the logarithm of its likelihood, and what each fitted number costs."""
    return misfit(run) + 0.5 * len(run.free) * float(np.log(max(run.left.size, 2)))
