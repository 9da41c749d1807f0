"""Channels that were computed from another channel of their record, as a velocity from an encoder's readings."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence

import numpy as np

from vpm.experiment.noise import noise_std
from vpm.experiment.record import Experiment
from vpm.numbers import Array

#: Samples ahead and behind that a controller's differences reach, and earlier results that its filter takes.
AHEAD, BEHIND, EARLIER = 8, 16, 3
#: Samples for each number of the filter, below which it would fit noise.
SAMPLES_EACH = 10
#: Share of its noise that a channel has for itself, below which it was computed.
OWN = 0.5
#: Kinds of channels that controllers compute from positions.
RATES = ("velocity", "acceleration")


def derived_channels(records: Sequence[Experiment]) -> dict[str, str]:
    """Channels that were computed from another one in all records that hold them, with that one.

    A sensor of its own has noise of its own. What a controller computes from readings has their noise: a linear filter
    of them leaves next to nothing (L. Ljung, *System Identification*, 1999, section 4.2). It tells nothing more, and
    differences tell it late.
    """
    held = {channel: source for record in records for channel, source in _rates(record)}
    return {
        channel: source
        for channel, source in held.items()
        if all(_is_computed(record, channel, source) for record in records if channel in record)
    }


def without_derived(records: Sequence[Experiment], derived: Collection[str]) -> list[Experiment]:
    """Records without the derived channels that were computed from others."""
    return [record.select([name for name in record.channels if name not in derived]) for record in records]


def _rates(record: Experiment) -> Iterator[tuple[str, str]]:
    """Channels of a record that could be derived from a position, with that."""
    for channel in record.channels:
        place, _, kind = channel.rpartition(".")
        if kind in RATES and f"{place}.position" in record:
            yield channel, f"{place}.position"


def _is_computed(record: Experiment, channel: str, source: str) -> bool:
    """Whether a derived channel has next to no noise but that of its source."""
    if source not in record or min(record.read_rate(channel), record.read_rate(source)) < record.rate:
        return False
    left = _left_by_filter(record[source], record[channel])
    return bool(left < OWN * noise_std(record[channel]))


def _left_by_filter(source: Array, values: Array) -> float:
    """Deviation of a derived channel from the best linear filter of its source; infinite if the record is too short."""
    now = np.arange(BEHIND, len(values) - AHEAD)
    reached = [place for place in range(-AHEAD, BEHIND + 1) if place != 0]
    columns = [source[now - place] - source[now] for place in reached]
    columns += [values[now - place] for place in range(1, EARLIER + 1)]
    columns += [source[now] - np.mean(source), np.ones(len(now))]
    free = len(now) - len(columns)
    if len(now) < SAMPLES_EACH * len(columns):
        return np.inf
    matrix = np.column_stack(columns)
    matrix /= np.maximum(np.sqrt(np.sum(matrix**2, axis=0)), 1e-300)
    error = values[now] - matrix @ np.linalg.lstsq(matrix, values[now], rcond=1e-12)[0]
    return float(np.sqrt(np.sum(error**2) / free))
