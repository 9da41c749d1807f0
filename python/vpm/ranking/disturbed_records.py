"""Disturbed records: a model leaves many times the error of others."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from vpm.discrepancy.settings import ABOVE_WHITE, NEW
from vpm.ranking.fit import Fitted
from vpm.ranking.settings import Settings
from vpm.ranking.tracked_records import TrackedRecords

#: What is said of such a record.
DISTURBED = (
    "{record} leaves {times:.2g} times the error of {other} in {channel}: something may have acted there that no other "
    "record shows, such as wind or a hand; fit the others without it, or record it again"
)


def disturbed(tracked: TrackedRecords, fitted: Fitted, settings: Settings) -> Iterator[str]:
    """Notes on disturbed records: their error of a channel is structured and many times that of another record.

    No law is exact: an error within its share of the motion is none.
    """
    band, structure = fitted.tracker.band, fitted.structure
    told = tracked.structured(fitted.residual, band, tracked.parts, structure.model, structure.theta)
    noise = np.array([one.noise for one in told])
    errors, motions = (
        np.array([np.sqrt(np.mean(signal[rows] ** 2, axis=0)) for rows in tracked.rows])
        for signal in (fitted.residual, tracked.motion)
    )
    least = np.maximum(np.min(errors, axis=0), noise)
    clear = errors > np.maximum(np.maximum(ABOVE_WHITE * noise, NEW * least), settings.slight * motions)
    for record, (log, apart) in enumerate(zip(tracked.experiments, clear, strict=True)):
        if np.any(apart):
            place = int(np.argmax(np.where(apart, errors[record] / least, 0.0)))
            other = tracked.experiments[int(np.argmin(errors[:, place]))].name
            channel, times = tracked.records[record].channels[place], errors[record, place] / least[place]
            yield DISTURBED.format(record=log.name, times=times, other=other, channel=channel)
