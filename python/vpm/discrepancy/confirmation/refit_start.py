"""Start values for the refit with a candidate: the recalibrated parameters, or those of the model file.

A drive with states integrates its command. Without an effect of that command, a recalibration can only weaken the
drive. It softens the oil and closes the valve, up to the prior's bounds. From there the true values lie behind a ridge
once the effect is present, while the values of the file are near.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vpm.errors import DivergedError
from vpm.identify import InverseDynamicsProblem
from vpm.identify.parts import moves_drives
from vpm.identify.response_along_motion import has_hidden, has_own_drives
from vpm.model import Model


def nearer_start(start: Model, added: Sequence[str], known: Sequence[str], data: InverseDynamicsProblem) -> Model:
    """Start of a refit: recalibrated, or with the ``known`` parameters of the model file if that fits better.

    Where nothing of the drives changes, or they have no states, a fit is linear enough to end at one place from both.

    Parameters
    ----------
    start : Model
        With the candidate at its estimated values, and what is known as it was fitted without it.
    added : sequence of str
        Dotted names of the candidate's own parameters.
    known : sequence of str
        Free parameters of the model without the candidate.
    data : InverseDynamicsProblem
    """
    if not has_own_drives(start) or any(has_hidden(start, m.joints) for m in data.motions):
        return start
    shared = {name: data.nominal.parameters[name].value for name in known if name in data.nominal.parameters}
    if not shared or not any(moves_drives(start, name) for name in added):
        return start
    stated = start.with_parameters(shared)
    return min((start, stated), key=lambda model: _left(model, data))


def _left(model: Model, data: InverseDynamicsProblem) -> float:
    """Sum of squares at a start of the refit; infinite where the model cannot follow the motion."""
    try:
        residual, _ = data.evaluate(model, model.theta)
    except DivergedError:
        return np.inf
    return float(residual @ residual)
