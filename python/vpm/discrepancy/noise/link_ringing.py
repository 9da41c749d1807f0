"""Ringing of flexible links by noise of the measured motion: not white in the residual, and no missing physics.

Its size follows from simulations of the model with noise like that of the records; see
`vpm.discrepancy.noise.noise_floor`.
"""

from __future__ import annotations

import numpy as np

from vpm.discrepancy.confirmation.confirmation import Data, Judged, Trial
from vpm.discrepancy.confirmation.refusal import refuse_ringing
from vpm.discrepancy.noise.noise_floor import noise_floor
from vpm.identify import gaps
from vpm.identify.response_along_motion import bends
from vpm.model import Model
from vpm.numbers import Array

#: Ratio of a residual to the noise in it up to which it is noise alone.
NOISE_ONLY = 1.2


def noise_alone(model: Model, data: Data, validation: Array) -> bool:
    """Whether the ``validation`` residual of flexible links is no more than ringing by noise."""
    if not bends(model) or data.simulation is None:
        return False
    allowed = _ringing(model, data)
    return all(gap <= NOISE_ONLY * allowed[name] for name, (gap, _, _) in gaps(data.validation, validation).items())


def only_ringing(current: Judged, data: Data, trial: Trial) -> str:
    """Why a trial only damps the ringing of links by noise, or ""."""
    if data.simulation is None or not bends(current.model) or not trial.probe.candidate.effect.damps:
        return ""
    before, after = _ringing(current.model, data), _ringing(trial.judged.model, data)
    weights = {block.channel: block.weight**2 for block in data.validation.blocks}
    alone = [sum(weight * ringing[name] ** 2 for name, weight in weights.items()) for ringing in (before, after)]
    # One record of noise that rings in a narrow band may be twice as large as another: only its share is known.
    return refuse_ringing(1.0 - alone[1] / alone[0], trial)


def _ringing(model: Model, data: Data) -> dict[str, float]:
    """Root mean square ringing by noise of the records in a model's own simulation, by channel."""
    if data.simulation is None:
        return {}
    nothing = np.zeros(data.validation.blocks[-1].samples.stop)
    return noise_floor(model, data.validation, nothing, data.simulation.mode, data.simulation.setup)
