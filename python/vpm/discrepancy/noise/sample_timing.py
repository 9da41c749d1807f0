"""Timing of samples is uncertain: commands may hold up to one sampling interval earlier or later than stated.

A logged command may hold from its sample on, until its sample, or as the mean over the interval; the log does not tell.
What a shift within one interval explains is therefore no missing physics.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vpm.discrepancy.confirmation.confirmation import Data, Judged
from vpm.discrepancy.settings import LEAST_GAIN
from vpm.identify import gain, segments
from vpm.identify.identifiability import least_step
from vpm.numbers import Array


@dataclass(frozen=True)
class InTime:
    """Residuals of a fitted model with the best shift in the timing of all commands, within one interval."""

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
    power = float(rest @ rest)
    if power <= 1e-20 * float(change @ change):
        return predict
    shift = float(np.clip(-(rest @ own) / power, -1.0, 1.0))
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
