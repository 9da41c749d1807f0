"""Tracker residual: the error that a tracker leaves of records, as a fit problem for all stages of a model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vpm.discrepancy.diagnosis import OBSERVED
from vpm.identify.problem import Block
from vpm.model import Model
from vpm.numbers import Array
from vpm.ranking.tracked_records import TrackedRecords, Tracker


class TrackerResidual:
    """Tracker residual: readings minus outputs of a tracked model, after its first state is forgotten.

    Parameters
    ----------
    tracked : TrackedRecords
    band : float
        Bandwidth of the tracker, Hz.
    """

    def __init__(self, tracked: TrackedRecords, band: float) -> None:
        self.mode: str = OBSERVED
        self.tracked, self._tracker = tracked, Tracker(band)
        self._rows = tracked.rows
        sizes = np.sqrt(np.mean(np.concatenate([tracked.motion[rows] for rows in self._rows]) ** 2, axis=0))
        self._weights = 1.0 / np.where(sizes > 0.0, sizes, 1.0)
        self.blocks: tuple[Block, ...] = tuple(self._blocks(sizes))

    def evaluate(self, model: Model, theta: Array, columns: Sequence[int] = ()) -> tuple[Array, Array]:
        """Tracker residual, shape (n,), and its derivative by the named parameters, shape (n, len(columns))."""
        residual, slopes = self.tracked.follow(model, theta, self._tracker, list(columns))
        return self._stacked(residual), self._stacked(slopes)

    def _stacked(self, values: Array) -> Array:
        """Channels (N, m, ...) of the tracker residual, stacked and weighted."""
        channels = range(values.shape[1])
        return np.concatenate([values[rows, place] * self._weights[place] for rows in self._rows for place in channels])

    def _blocks(self, sizes: Array) -> list[Block]:
        found: list[Block] = []
        begin, before = 0, 0
        for rows, record in zip(self._rows, self.tracked.records, strict=True):
            time = record.time[rows.start - before : rows.stop - before]
            before += len(record.time)
            for name, size, weight in zip(record.channels, sizes, self._weights, strict=True):
                samples, begin = slice(begin, begin + len(time)), begin + len(time)
                unit, moving = self.tracked.model.channel_unit(name), np.ones(len(time))
                found.append(Block(record.name, name, unit, samples, time, float(size), float(weight), moving))
        return found
