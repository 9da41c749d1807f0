"""Errors of a model on validation records, as a tracker leaves them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vpm.model import Model
from vpm.numbers import Array
from vpm.ranking.fit import ASTRAY
from vpm.ranking.model_structure import approximate, without_sizes
from vpm.ranking.noise_model import Parts, Structured
from vpm.ranking.result import Gap
from vpm.ranking.tracked_records import TrackedRecords, Tracker


def gaps(held_out: TrackedRecords, stages: tuple[Model, Model, Model], band: float) -> dict[str, Gap]:
    """Validation errors by channel under a tracker of this bandwidth (Hz), at three stages of a model.

    Parameters
    ----------
    held_out : TrackedRecords
    stages : tuple of Model
        As the user wrote it, with its parameters fitted, with what was found.
    band : float
    """
    if not held_out.records:
        return {}
    parts = [slice(part.start, held.stop) for part, held in zip(held_out.parts, held_out.held_back, strict=True)]
    before, recalibrated, after = (_left(held_out, model, model.theta, band) for model in stages)
    found = stages[-1]
    bare = _left(held_out, found, without_sizes(found, found.theta, approximate(found)), band)
    signals = (before, recalibrated, after, held_out.motion, bare)
    levels = np.array([np.sqrt(np.mean(np.concatenate([one[part] for part in parts]) ** 2, axis=0)) for one in signals])
    unknown = np.full(after.shape[1], np.nan)
    shares, noise = unknown, unknown
    if np.all(np.isfinite(recalibrated)):
        filters = held_out.structured(recalibrated, band, parts)
        shares, noise = _shares((recalibrated, held_out.drawn(band)), after, parts, filters)
    names = held_out.records[0].channels
    units = map(stages[0].channel_unit, names)
    return {
        name: Gap(
            before=float(level[0]),
            recalibrated=float(level[1]),
            after=float(level[2]),
            unit=unit,
            left=float(share),
            noise=float(floor),
            signal=float(level[3]),
            explained=float(np.fmin(level[4], level[3])),
        )
        for name, unit, level, share, floor in zip(names, units, levels.T, shares, noise, strict=True)
    }


def _left(tracked: TrackedRecords, model: Model, theta: Array, band: float) -> Array:
    """Residual of validation records by channel (N, m); NaN where the model diverges."""
    try:
        residual, _ = tracked.follow(model, theta, Tracker(band))
    except ASTRAY:
        return np.full_like(tracked.motion, np.nan)
    return residual


def _shares(
    rivals: tuple[Array, Array], after: Array, parts: Parts, filters: Sequence[Structured]
) -> tuple[Array, Array]:
    """Share of validation error power above noise by channel (m,), and the noise.

    Of what the better one of two rivals leaves: the model without effects, and masses on which nothing acts. What does
    no better than these, which follow the record because a tracker draws them along, explains no motion.
    """

    def power(one: Structured, channel: Array) -> float:
        return sum(float(np.sum(one.part_of(channel[part]) ** 2)) for part in parts)

    shares = np.full(after.shape[1], np.nan)
    for place, one in enumerate(filters):
        powers = [power(one, rival[:, place]) for rival in rivals if np.any(rival[:, place])]
        if (whole := min(powers, default=0.0)) > 0.0:
            shares[place] = power(one, after[:, place]) / whole
    return shares, np.array([one.noise for one in filters])
