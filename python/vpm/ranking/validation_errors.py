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
    parts = _whole(held_out)
    before, recalibrated, after = (_left(held_out, model, model.theta, band, parts) for model in stages)
    found = stages[-1]
    bare = _left(held_out, found, without_sizes(found, found.theta, approximate(found)), band, parts)
    signals = (before, recalibrated, after, held_out.motion, bare)
    levels = np.array([np.sqrt(np.mean(np.concatenate([one[part] for part in parts]) ** 2, axis=0)) for one in signals])
    unknown = np.full(after.shape[1], np.nan)
    shares, noise = unknown, unknown
    if np.all(np.isfinite(recalibrated)):
        # Drives that are faster than their log read currents that are held: the errors show whether one was exact.
        filters = held_out.structured(recalibrated, band, parts, stages[1], held=True)
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


def powers(held_out: TrackedRecords, model: Model, band: float) -> Array:
    """Mean square of validation errors by channel (m,) under a tracker of this bandwidth (Hz); NaN if it diverges."""
    parts = _whole(held_out)
    residual = _left(held_out, model, model.theta, band, parts)
    return np.asarray(np.mean(np.concatenate([residual[part] for part in parts]) ** 2, axis=0))


def _whole(held_out: TrackedRecords) -> list[slice]:
    """Validation samples that count: nothing is held back of them."""
    return [slice(part.start, held.stop) for part, held in zip(held_out.parts, held_out.held_back, strict=True)]


def _left(tracked: TrackedRecords, model: Model, theta: Array, band: float, parts: Parts) -> Array:
    """Residual of validation records by channel (N, m); NaN where the model diverges."""
    try:
        return _from_likely_start(tracked, model, theta, Tracker(band), parts)
    except ASTRAY:
        return np.full_like(tracked.motion, np.nan)


def _from_likely_start(tracked: TrackedRecords, model: Model, theta: Array, tracker: Tracker, parts: Parts) -> Array:
    """Residual of validation records (N, m) from their most likely unmeasured first states, as fits have them.

    Where a machine began unseen is no error of its model: a shaft may ring long after its record has begun.
    """
    firsts = tracked.firsts
    own, sizes = len(theta), np.tile(firsts.sizes, firsts.records)
    start, unseen = np.append(theta, np.zeros(len(sizes))), list(range(own, own + len(sizes)))
    residual, slopes = tracked.follow(model, start, tracker, unseen)
    if not unseen:
        return residual
    rows = np.concatenate([np.arange(part.start, part.stop) for part in parts])
    weights = 1.0 / np.maximum(np.sqrt(np.mean(residual[rows] ** 2, axis=0)), 1e-300)
    columns = (slopes[rows] * weights[:, None]).reshape(-1, len(sizes)) * sizes
    normal = columns.T @ columns + np.eye(len(sizes))
    move = -np.linalg.solve(normal, columns.T @ (residual[rows] * weights).ravel()) * sizes
    moved, _ = tracked.follow(model, np.append(theta, move), tracker)
    return min(residual, moved, key=lambda one: float(np.sum((one[rows] * weights) ** 2)))


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
