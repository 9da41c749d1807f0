"""Columns of different clocks on one grid."""

from collections.abc import Mapping

import numpy as np

from vpm.errors import ExperimentError
from vpm.experiment.grid import (
    FEWEST_SAMPLES,
    INTERPOLATE,
    MOST_GROWTH,
    Source,
    check_finite,
    check_grid,
    check_increasing,
    is_smooth,
    make_uniform,
    usual_step,
)
from vpm.experiment.signal import anti_alias, interpolate
from vpm.numbers import Array


def merge_clocks(
    time: Array, columns: Mapping[str, Array], clocks: Mapping[str, Array], source: Source, *, irregular: str
) -> tuple[Array, dict[str, Array], list[str]]:
    """Bring columns that have clocks of their own to the grid of the record.

    - ``time``: shape (N,), clock of the record, s
    - ``columns``: each as long as its clock
    - ``clocks``: own clocks of some channels, s, counted from the same instant; equal ones change nothing
    - ``irregular``: one of "error", "interpolate", whether interpolation is allowed

    - result ``time``: shape (M,), with interpolation, uniform at the mean step of the clock, over the time that all
      columns share
    - result ``columns``: each of shape (M,)
    - result ``sentences``: for the history
    """
    others = [channel for channel, own in clocks.items() if not np.array_equal(own, time)]
    if not others:
        return time, dict(columns), []
    if irregular != "interpolate":
        first = clocks[others[0]]
        lost = np.flatnonzero(~np.isin(time, first))
        if first.size + lost.size == time.size:
            raise source.error(
                f'{source.at(int(lost[0]))}: "{others[0]}" has no number, as in {lost.size} of {time.size} rows; '
                f"fill these cells, or {INTERPOLATE}",
                channel=others[0],
                time=float(time[lost[0]]),
            )
        raise ExperimentError(
            f'{source.name}: "{others[0]}" has {first.size} samples on a clock of its own and the clock of the record '
            f"{time.size}; {INTERPOLATE}, which brings all channels to one grid, or map channels "
            "of one topic or group only",
            path=source.path,
            channel=others[0],
        )
    every = {channel: clocks.get(channel, time) for channel in columns}
    for channel, own in every.items():
        check_increasing(own, Source(f"{source.name}, {channel}", None, source.path))
        check_finite(columns[channel], own, f'the channel "{channel}"', source, channel=channel)
    start = max(own[0] for own in every.values())
    stop = min(own[-1] for own in every.values())
    step = usual_step(time)
    if stop - start < FEWEST_SAMPLES * step:
        late = max(every, key=lambda channel: float(every[channel][0]))
        early = min(every, key=lambda channel: float(every[channel][-1]))
        raise ExperimentError(
            f'{source.name}: the channels share {max(stop - start, 0.0):.6g} s, because "{late}" begins at {start:.6g} '
            f's and "{early}" ends at {stop:.6g} s; map channels that were recorded together, and one kind of time',
            path=source.path,
            channel=late,
        )
    check_grid(time, step, MOST_GROWTH, Source(source.name, None, source.path))
    # What has the record's clock stays as it was read: between readings there is less noise, and no command holds.
    start = np.float64(time[np.searchsorted(time, start)])
    grid = start + step * np.arange(int((stop - start) / step + 1e-6) + 1)
    merged, sentences = {}, []
    for channel, own in every.items():
        merged[channel], how = _onto(grid, step, own, columns[channel], channel, source)
        if channel in others:
            sentences.append(how)
    sentences.append(
        f"All channels were brought to one grid of {grid.size} samples, {step:.9g} s apart, over the time that they "
        f"share, {start:.6g} s ... {grid[-1]:.6g} s."
    )
    return grid, merged, sentences


def _onto(grid: Array, step: float, own: Array, values: Array, channel: str, source: Source) -> tuple[Array, str]:
    """Values merged onto the grid; faster ones pass a filter first, as in `Experiment.resample`."""
    steps = np.diff(own)
    usual = float(np.median(steps))
    smooth = is_smooth(channel)
    words = f"{channel} came every {usual:.6g} s (the longest step {steps.max():.6g} s) and was interpolated by "
    words += "cubic splines" if smooth else "straight lines"
    if step > 1.05 * usual:
        own, data, _ = make_uniform(own, values[:, None], (channel,), None, source)
        values = anti_alias(data, step / usual)[:, 0]
        words += f", behind a filter at {0.4 / step:.6g} Hz"
    return interpolate(own, values, np.clip(grid, own[0], own[-1]), smooth=smooth), f"{words}."
