"""Sensor prediction: sensor errors are judged by the predicted reading of the sensor itself.

Along a measured motion no load changes the output of a drive. A constant force and the offset of a pressure gauge may
therefore leave the same torque residual. The reading of the gauge itself follows from the commands and discriminates
the two.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vpm.discrepancy.confirmation.confirmation import Data, Trial
from vpm.discrepancy.confirmation.refusal import NORMAL_95_ONE_SIDED, WORTH_A_NAME
from vpm.identify import InverseDynamicsProblem, gain, segments
from vpm.numbers import Array


def preferred_sensor(chosen: Trial, equals: Sequence[Trial], data: Data) -> Trial:
    """Sensor error whose predicted reading supports it, of trials as good as ``chosen``; else ``chosen``.

    On training and validation records it has to predict its channel clearly better than ``chosen`` does, by as much as
    is worth a name. It may not leave more of all channels together.
    """
    if chosen.probe.candidate.effect.site == "sensor":
        return chosen
    supported = [t for t in equals if t.probe.candidate.effect.site == "sensor" and _is_supported(t, chosen, data)]
    return min(supported, key=lambda t: _power(t.judged.validation), default=chosen)


def _is_supported(trial: Trial, chosen: Trial, data: Data) -> bool:
    site, model = trial.probe.candidate.site, trial.judged.model
    channels = [channel for channel in data.validation.shown if model.sensor_of(channel) == site]
    pairs = (
        (data.training, chosen.judged.fit.residual, trial.judged.fit.residual),
        (data.validation, chosen.judged.validation, trial.judged.validation),
    )
    return bool(channels) and all(_better(problem, channels, before, after) for problem, before, after in pairs)


def _better(problem: InverseDynamicsProblem, channels: Sequence[str], before: Array, after: Array) -> bool:
    own = np.zeros(before.size)
    for block in problem.blocks:
        own[block.samples] = block.channel in channels
    gained = gain(before * own, after * own, segments(problem))
    sure = gained.relative >= WORTH_A_NAME and gained.score >= NORMAL_95_ONE_SIDED
    return sure and _power(after) <= _power(before)


def _power(residual: Array) -> float:
    return float(residual @ residual)
