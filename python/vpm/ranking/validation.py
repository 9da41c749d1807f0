"""Errors of a model on validation records."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vpm.model import Model
from vpm.ranking.fit import ASTRAY
from vpm.ranking.observed import Observed, Observer
from vpm.ranking.result import Gap

Array = NDArray[np.float64]


def gaps(held_out: Observed, stages: tuple[Model, Model, Model], band: float) -> dict[str, Gap]:
    """By channel what an observer of this bandwidth (Hz) leaves of validation records, of three stages of a model.

    Parameters
    ----------
    held_out : Observed
    stages : tuple of Model
        As the user wrote it, with its parameters fitted, with what was found.
    band : float
    """
    if not held_out.records:
        return {}
    left = np.transpose([_left(held_out, model, band) for model in stages])
    units = map(stages[0].channel_unit, held_out.records[0].channels)
    return {
        channel: Gap(float(before), float(recalibrated), float(after), unit)
        for channel, unit, (before, recalibrated, after) in zip(held_out.records[0].channels, units, left, strict=True)
    }


def _left(observed: Observed, model: Model, band: float) -> Array:
    """Root mean square of what is left of each channel (m,); NaN where the model runs away."""
    try:
        residual, _ = observed.follow(model, model.theta, Observer(band))
    except ASTRAY:
        return np.full(len(observed.records[0].channels), np.nan)
    told = np.concatenate([residual[part] for part in (*observed.parts, *observed.held_back)])
    level: Array = np.sqrt(np.mean(told**2, axis=0))
    return level
