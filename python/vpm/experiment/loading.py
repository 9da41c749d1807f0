"""From a file or from arrays to a record: select, check, scale, convert, align, interpolate."""

from collections.abc import Mapping
from os import PathLike
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vpm.errors import ExperimentError, near_match
from vpm.experiment.draft import Draft, mapped_draft, plain_draft, understood
from vpm.experiment.grid import (
    GAP,
    INTERPOLATE,
    Source,
    check_finite,
    check_increasing,
    check_uniform,
    is_smooth,
    make_uniform,
    unrounded,
)
from vpm.experiment.merge import merge_clocks
from vpm.experiment.noise import FEWEST_SAMPLES, noise_std, quantisation_step
from vpm.experiment.readers.base import Log
from vpm.experiment.record import Experiment
from vpm.model import ChannelEntry, Model
from vpm.numbers import Array, array_of

R = TypeVar("R", bound=Experiment)


def record_of_log(
    make: type[R],
    log: Log,
    channels: Mapping[str, ChannelEntry] | str | PathLike[str] | None,
    model: Model | None,
    *,
    irregular: str,
    resample: float | None,
    name: str,
) -> R:
    """Load the record in a log; see `Experiment.load`."""
    table = channel_table(channels, model)
    interpolated = irregular == "interpolate"
    draft = (
        plain_draft(log, interpolated=interpolated)
        if table is None
        else mapped_draft(log, table, model, interpolated=interpolated)
    )
    return _finish(make, draft, name, irregular, resample)


def record_of_arrays(
    make: type[R],
    time: ArrayLike,
    values: Mapping[str, ArrayLike],
    units: Mapping[str, str],
    model: Model | None,
    *,
    irregular: str,
    resample: float | None,
    name: str,
) -> R:
    """Load a record from arrays; see `Experiment.from_arrays`."""
    clock = array_of(time, f"{name}: the time", ExperimentError)
    if clock.ndim != 1:
        raise ExperimentError(f"{name}: the time has shape {clock.shape}; give one number per sample")
    for channel in units:
        if channel not in values:
            raise ExperimentError(
                f'{name}: a unit is given for "{channel}", which has no values; {near_match(channel, values)}',
                channel=channel,
            )
    draft = Draft(Source(name), clock)
    draft.history.append(f"Taken from arrays of {clock.size} samples.")
    for channel, given in values.items():
        column = array_of(given, f'{name}: the channel "{channel}"', ExperimentError)
        if column.shape != clock.shape:
            raise ExperimentError(
                f'{name}: the channel "{channel}" has shape {column.shape} and the time {clock.shape}; '
                "give one value per sample",
                channel=channel,
            )
        unit = units.get(channel) or (model.channel_unit(channel) if model is not None else "1")
        own, draft.units[channel] = understood(unit, channel, model, name)
        if irregular == "interpolate":
            column = draft.numbers(channel, None, {"": column})[1][""]
        draft.columns[channel] = own.to_si(column)
        if not own.is_si:
            draft.history.append(f"{channel} was converted from {unit} to {draft.units[channel]}.")
    return _finish(make, draft.on_fullest_clock(), name, irregular, resample)


def channel_table(
    channels: Mapping[str, ChannelEntry] | str | PathLike[str] | None, model: Model | None
) -> Mapping[str, ChannelEntry] | None:
    """Loaded channel-table entries by name, the clock under "time"; None where nobody gave a table.

    ``model``: its own table counts where none is given.
    """
    if channels is None:
        return None if model is None or not model.channel_table else model.channel_table
    if isinstance(channels, str | PathLike):
        from vpm.model import load_channel_table

        return load_channel_table(channels)
    return channels


def _finish(make: type[R], draft: Draft, name: str, irregular: str, resample: float | None) -> R:
    """Finish loading: check the clock, make it uniform if asked to, move back what lags, and resample."""
    if irregular not in {"error", "interpolate"}:
        raise ExperimentError(f'irregular="{irregular}" is not known; choose "error" or "interpolate"')
    check_finite(draft.time, draft.time, "the time", draft.source, channel="time")
    if even := unrounded(draft.time):
        draft.time, count = even
        draft.history.append(
            f"The clock counts whole {count:g} s; the samples were taken as evenly spaced, as all stamps allow."
        )
    check_increasing(draft.time, draft.source)
    slower = _take_fresh(draft, irregular)
    read_at = {channel: own for channel, own in draft.clocks.items() if not is_smooth(channel)}
    if draft.clocks:
        slower |= {channel: 1.0 / float(np.median(np.diff(own))) for channel, own in draft.clocks.items()}
        draft.time, draft.columns, merged = merge_clocks(
            draft.time, draft.columns, draft.clocks, draft.source, irregular=irregular
        )
        draft.history += merged
    for channel, column in draft.columns.items():
        check_finite(column, draft.time, f'the channel "{channel}"', draft.source, channel=channel)
    channels = tuple(draft.columns)
    time, data = (
        draft.time,
        np.column_stack(list(draft.columns.values())) if channels else np.zeros((draft.time.size, 0)),
    )
    if irregular == "interpolate":
        time, data, sentence = make_uniform(time, data, channels, None, draft.source)
    else:
        sentence = check_uniform(time, draft.source)
    units = tuple(draft.units[channel] for channel in channels)
    step = float(np.median(np.diff(time)))
    slower = {channel: rate for channel, rate in slower.items() if rate * step * GAP < 1.0}
    read_at = {channel: own for channel, own in read_at.items() if channel in slower}
    told = (*draft.history, sentence)
    record = make(name, time, data, channels, units, told, draft.unused, slower, read_at=read_at)
    if draft.delays:
        record = record.align(draft.delays)
    if draft.moved:
        first, last = time[0] - min(0.0, *draft.moved), time[-1] - max(0.0, *draft.moved)
        record = record.trim(max(first, record.time[0]), min(last, record.time[-1]))
    return record if resample is None else record.resample(resample)


def _take_fresh(draft: Draft, irregular: str) -> dict[str, float]:
    """Take of motions in a loaded file what was read, where slower sensors had their values repeated.

    Without interpolation they stay as they are if that costs no more than the noise of the sensor. The rates of their
    readings come back, Hz.

    Raises `ExperimentError`: repeated values cost more.
    """
    slower: dict[str, float] = {}
    for channel, column in draft.columns.items():
        own = draft.clocks.get(channel, draft.time)
        # An acceleration may jump, as the force that a slower controller holds.
        steady = is_smooth(channel) and not channel.endswith(".acceleration")
        fresh = fresh_samples(own, column) if steady and np.all(np.isfinite(column)) else None
        if fresh is None:
            continue
        usual, step = (float(np.median(np.diff(time))) for time in (own[fresh], own))
        told = f"{channel} was read every {usual:.6g} s and repeated every {step:.6g} s in between"
        if irregular != "interpolate":
            cost, noise, unit = held_error(own, column, fresh), noise_std(column[fresh]), draft.units[channel]
            costs = f"held so long it is off by {cost:.3g} {unit} in the mean of squares"
            if cost > noise:
                raise draft.source.error(
                    f"{draft.source.name}: {told}; {costs}, more than its noise of {noise:.3g} {unit}; {INTERPOLATE}, "
                    "which takes what was read, or map a channel that was read in every sample",
                    channel=channel,
                )
            slower[channel] = 1.0 / usual
            draft.history.append(f"{told}; {costs}, no more than its noise of {noise:.3g} {unit}.")
            continue
        draft.columns[channel], draft.clocks[channel] = column[fresh], own[fresh]
        draft.history.append(f"{told}; the {fresh.size} values that were read count.")
    return slower


def fresh_samples(time: Array, values: Array) -> NDArray[np.int64] | None:
    """Samples at which a motion was read, where it was repeated until it was read again.

    Mass and oil move without jumps. A motion that is read in every sample and moves by several steps of its sensor in
    one of them does so in its neighbours, too. So values were repeated that jump, and never in two samples running.
    One lost row may bring two jumps together.

    - ``time``: shape (N,), increasing, s
    - ``values``: shape (N,), a position, velocity, length or pressure: what cannot jump
    - result: None where values were not repeated, or too few changed to tell. A stretch at rest is read as often as
      others.
    """
    moved = np.abs(np.diff(values))
    changes = np.flatnonzero(moved) + 1
    if changes.size < FEWEST_SAMPLES:
        return None
    step = quantisation_step(values) or 0.0
    if np.median(moved[changes - 1]) < 1.5 * step:  # steps of the sensor itself, in slow motion
        return None
    place = np.round((time - time[0]) / np.median(np.diff(time))).astype(np.int64)
    lost = np.flatnonzero(np.diff(place) > 1) + 1
    apart = np.diff(changes)
    if np.count_nonzero(apart == 1) > np.count_nonzero(np.isin(changes, lost)):
        return None
    period = int(np.median(apart))
    ends = np.append(changes[1:], values.size)
    stretches = [
        np.arange(start, max(start + 1, stop - period // 2), period) for start, stop in zip(changes, ends, strict=True)
    ]
    fresh = np.concatenate([np.arange(changes[0] - period, -1, -period)[::-1], *stretches])
    return fresh[~np.isin(fresh, lost)]  # behind a lost row nobody knows when it was read


def held_error(time: Array, values: Array, fresh: NDArray[np.int64]) -> float:
    """Error of a motion whose readings are repeated: speed times the time for which each is held, root mean square.

    Noise of two readings is in the way between them, too, and no part of the error.

    - ``time``: shape (N,), s
    - ``values``: shape (N,)
    - ``fresh``: samples at which the motion was read, see `fresh_samples`
    - result: unit of the values
    """
    held = time - time[np.maximum.accumulate(np.where(np.isin(np.arange(time.size), fresh), np.arange(time.size), 0))]
    speeds = np.diff(values[fresh]) / np.diff(time[fresh])
    noise = np.sqrt(2.0) * noise_std(values[fresh]) / np.median(np.diff(time[fresh]))
    return float(np.sqrt(max(np.mean(speeds**2) - noise**2, 0.0) * np.mean(held**2)))
