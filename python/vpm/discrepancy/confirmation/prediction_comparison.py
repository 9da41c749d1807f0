"""Comparison of closed-loop predictions of two models where the inverse-dynamics residual leaves two answers open.

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
    """Comparison of two closed-loop predictions: support of training and validation records for the change.

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
        """Whether both sets of records support the change between two predictions beyond chance and model errors."""
        return self.better > 0.0 and all(
            LEAST_SUPPORT <= gained.weight <= 1.0 / LEAST_SUPPORT
            and gained.score >= MODEST_FACTOR * thresholds.score(gained.pieces)
            for gained in (self.training, self.validation)
        )


def can_predict(model: Model, data: Data) -> bool:
    """Whether a model can be compared by closed-loop prediction: in closed loop, fast enough, not chaotic."""
    closed = data.simulation is not None and data.simulation.mode == "closed_loop"
    return closed and not bends(model) and not has_own_drives(model) and not has_impacts(model)


def predicted(judged: Judged, data: Data) -> ClosedLoopPrediction | None:
    """Closed-loop prediction of training records by a fitted model as it is; None if it cannot follow."""
    if data.simulation is None or not can_predict(judged.model, data):
        return None
    try:
        return predict(judged.model, judged.free, data.training.experiments, data.simulation.setup)
    except VpmError:
        return None


def fitted_prediction(run: ClosedLoopPrediction, data: Data) -> ClosedLoopPrediction | None:
    """Closed-loop prediction with the parameters that fit the training records best, for a comparison."""
    if data.simulation is None:
        return None
    try:
        return fit_prediction(run.model, run.free, data.training.experiments, data.simulation.setup)
    except VpmError:
        return None


def compared(first: ClosedLoopPrediction, second: ClosedLoopPrediction, data: Data) -> Comparison | None:
    """Comparison of two predictions on all records; None where one of them diverges."""
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
    """Information criterion of a prediction: negative log-likelihood, and a cost for each fitted number."""
    return misfit(run) + 0.5 * len(run.free) * float(np.log(max(run.left.size, 2)))
