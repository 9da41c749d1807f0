"""Shift of all commands within one sampling interval: what it explains of a residual is no missing physics.

A logged command may hold from its sample on, until its sample, or as the mean over the interval; the log does not tell.
"""

from dataclasses import replace

import numpy as np

from vpm.discrepancy.judged_model import Data, Judged
from vpm.discrepancy.settings import LEAST_GAIN
from vpm.identify import gain, segments
from vpm.identify.identifiability import least_step
from vpm.numbers import power


def in_time(judged: Judged, data: Data) -> Judged:
    """Judged model with the residuals that the best shift of commands leaves, to first order.

    Free parameters move with the shift. Where it does not matter, the judged model stays as it is.
    """
    model, own = judged.model, judged.fit.residual
    later, _ = data.training.later().evaluate(model, model.theta)
    change, known = later - own, judged.fit.jacobian
    # Free parameters give way to the shift and do nothing else: one that its bounds hold has to stay where it is.
    step = least_step(known, change)
    rest = change + known @ step
    if power(rest) <= 1e-20 * power(change):
        return judged
    shift = float(np.clip(-(rest @ own) / power(rest), -1.0, 1.0))
    fitted = own + shift * rest
    if gain(own, fitted, segments(data.training)).relative < LEAST_GAIN:
        return judged
    columns = [model.index(name) for name in judged.free]
    own_validation, slopes = data.validation.evaluate(model, model.theta, columns)
    later_validation, _ = data.validation.later().evaluate(model, model.theta)
    validation = own_validation + shift * (later_validation - own_validation + slopes @ step)
    if gain(own_validation, validation, segments(data.validation)).relative < LEAST_GAIN:
        return judged
    return replace(judged, fit=replace(judged.fit, residual=fitted), validation=validation)
