"""Pictures of signals: over time, over the state, over frequency, over lags."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from textwrap import fill
from typing import TYPE_CHECKING

import numpy as np

from vpm.numbers import Array, stretches
from vpm.plot.style import BLUE, INK, ORANGE, SOFT, STAGES, label, legend_above, panels, styled, thinned

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from vpm.simulate.run import Run


#: Bins of the running mean over a state, and samples that one has in the mean where there are fewer bins.
MEAN_BINS, TYPICAL_IN_BIN = 40, 10

#: Share of the samples that a bin needs before its mean is drawn.
LEAST_IN_BIN = 0.0005


@styled
def plot_channels(
    time: Array,
    data: Array,
    channels: Sequence[str],
    units: Sequence[str],
    *,
    title: str = "",
    std: Array | None = None,
) -> Figure:
    """Draw signals: each channel over time in a panel of its own.

    ``time``: shape (N,), s; ``data``: shape (N, C); ``std``: shape (N, C), draws bounds that should hold 95 % about 0.
    """
    figure, axes = panels(max(1, len(channels)), height=1.6, share_x=True)
    for at, (channel, unit) in enumerate(zip(channels, units, strict=True)):
        axis = axes[at][0]
        axis.plot(*thinned(time, data[:, at]), color=BLUE)
        if std is not None:
            for side in (-1.96, 1.96):
                axis.plot(*thinned(time, side * std[:, at]), color=ORANGE)
        axis.set(ylabel=label("", unit).strip(), title=channel)
    _finish_time(figure, axes[-1][0], title)
    return figure


@styled
def plot_run(run: Run) -> Figure:
    """Draw simulated over measured signals, a panel per channel.

    Commands that were only copied do not count as measured. Where nothing was, all channels are drawn but what never
    moves: places and turns of markers out of a machine's plane. Notes of the run stand below.
    """
    measured = [bool(np.isfinite(column).all()) for column in run.measured.T]
    copied = [name.endswith(".command") for name in run.channels]
    shown = [at for at in range(len(run.channels)) if measured[at] and not copied[at]]
    shown = shown or [at for at, values in enumerate(run.values.T) if np.ptp(values) > 1e-12 * abs(values).max()]
    shown = shown or list(range(len(run.channels)))
    figure, axes = panels(len(shown), height=1.9, share_x=True)
    for row, at in enumerate(shown):
        axis = axes[row][0]
        real = run.measured[:, at] if measured[at] else None
        draw_overlay(axis, run.time, real, run.values[:, at], [int(start) for start in run.starts])
        axis.set(ylabel=label("", run.units[at]).strip(), title=run.channels[at])
    legend_above(axes[0][0], 2)
    _finish_time(figure, axes[-1][0], f"{run.model_name} on {run.experiment_name}, {run.mode.replace('_', ' ')}")
    if run.notes:
        figure.supxlabel("\n".join(fill("note: " + note, 110) for note in run.notes), fontsize=8, color=ORANGE)
    return figure


def amplitude_density(values: Array, rate: float, most: int | None = None) -> tuple[Array, Array]:
    """Frequencies (Hz) above zero and amplitude density of a signal, by Welch's method.

    Segments are an eighth of the longest stretch, but at least 256 samples where it has as many, and ``most`` at most.
    """
    from scipy.signal import welch

    found = stretches(np.isfinite(values))
    longest = max((part.stop - part.start for part in found), default=0)
    length = min(longest, max(256, longest // 8), most or longest)
    total, weight = np.zeros(length // 2 + 1), 0.0
    frequency = np.fft.rfftfreq(max(length, 1), 1.0 / rate)
    for part in found:
        size = part.stop - part.start
        if size >= max(length, 2):
            frequency, power = welch(values[part], rate, nperseg=length, detrend="constant")
            total, weight = total + size * power, weight + size
    density: Array = np.sqrt(total[1:] / max(weight, 1.0))
    return np.asarray(frequency[1:], dtype=np.float64), density


@styled
def plot_correlation(lags: Array, values: Array, band: float, name: str) -> Figure:
    """Draw a signal's correlation over lags with its 95 % band.

    ``lags``: shape (L,), s; ``values``: shape (L,); ``name``: what is correlated.
    """
    figure, axes = panels(1, height=2.4)
    draw_correlation(axes[0][0], lags, values, band, name)
    return figure


def draw_correlation(axis: Axes, lags: Array, values: Array, band: float | Array, name: str) -> None:
    """Draw a signal's correlation into axes, see `plot_correlation`."""
    wide = np.broadcast_to(band, lags.shape)
    axis.fill_between(lags, -wide, wide, color=SOFT, alpha=0.18, linewidth=0, label="95 % if independent")
    # One line with gaps: as many small ones would be most of a page.
    ends = np.stack([np.zeros_like(values), values, np.full_like(values, np.nan)], axis=1)
    axis.plot(np.repeat(lags, 3), ends.ravel(), color=BLUE, linewidth=1.0)
    if lags.size <= MOST_ENDS:
        axis.plot(lags, values, "o", color=BLUE, markersize=2.5)
    axis.axhline(0.0, color=INK, linewidth=0.8)
    axis.set_ylim(min(-0.25, 1.1 * float(values.min())), max(0.25, 1.1 * float(values.max())))
    axis.set(xlabel="lag [s]", ylabel="correlation", title=name)
    axis.legend(loc="upper right")


def draw_overlay(axis: Axes, time: Array, measured: Array | None, simulated: Array, starts: Iterable[int]) -> None:
    """Draw measured signals pale and broad with simulated ones thin on them; pieces are not joined."""
    edges = [*starts, time.size]
    for number, (first, last) in enumerate(pairwise(edges)):
        piece = slice(first, last)
        names = ("measured", "simulated") if number == 0 else ("", "")
        if measured is not None:
            lines = thinned(time[piece], measured[piece], simulated[piece])
            axis.plot(lines[0], lines[1], color=SOFT, alpha=0.55, linewidth=2.6, label=names[0])
        else:
            lines = thinned(time[piece], simulated[piece])
        axis.plot(lines[0], lines[-1], color=ORANGE, linewidth=1.0, label=names[1])


def draw_residual_time(axis: Axes, time: Array, stages: Mapping[str, Array], unit: str) -> None:
    """Draw residual signals over time into axes, later stages on top."""
    for (name, residual), color in zip(stages.items(), _colors(len(stages)), strict=True):
        axis.plot(*thinned(time, residual), color=color, linewidth=0.9, label=name)
    axis.axhline(0.0, color=INK, linewidth=0.7)
    axis.set(xlabel="time [s]", ylabel=label("residual", unit))
    axis.margins(x=0.01)


def draw_residual_against(
    axis: Axes,
    values: Array,
    stages: Mapping[str, Array],
    axis_label: str,
    *,
    unit: str,
    velocity: Array | None = None,
) -> None:
    """Draw residual signals as pale points over a state, with running means forward and backward."""
    ways = {"o": np.ones(values.shape, np.bool_)} if velocity is None else {">": velocity > 0.0, "<": velocity < 0.0}
    step = -(-values.size // MOST_DOTS)
    bottom, top = 0.0, 0.0
    for (name, residual), color in zip(stages.items(), _colors(len(stages)), strict=True):
        axis.plot(
            values[::step],
            residual[::step],
            ".",
            color=color,
            alpha=0.35,
            markersize=3.2,
            markeredgewidth=0,
            rasterized=True,
        )
        title = f"{name}, mean" if name else "mean"
        for marker, way in ways.items():
            centers, means = running_mean(values[way], residual[way])
            axis.plot(centers, means, color="white", linewidth=3.4)
            axis.plot(centers, means, f"{marker}-", color=color, linewidth=1.9, markersize=3.6, label=title)
            title = ""
        if np.isfinite(residual).any():
            low, high = np.nanpercentile(residual, [0.2, 99.8])
            bottom, top = min(bottom, float(low)), max(top, float(high))
    if top > bottom:
        axis.set_ylim(bottom - 0.08 * (top - bottom), top + 0.08 * (top - bottom))
    axis.axhline(0.0, color=INK, linewidth=0.7)
    axis.set(xlabel=axis_label, ylabel=label("residual", unit))


#: Points that a cloud keeps.
MOST_DOTS = 1200
#: Lags of a correlation beyond which none has a dot at its end.
MOST_ENDS = 60


def running_mean(values: Array, residual: Array) -> tuple[Array, Array]:
    """Running mean of a residual signal in up to 40 bins of a state.

    - result ``centers``, ``means``: shape (M,), NaN between bins that are not neighbours, so that no line joins them;
      nothing without samples
    """
    counts = np.isfinite(residual)
    values, residual = values[counts], residual[counts]
    if not values.size:
        return np.zeros(0), np.zeros(0)
    bins = max(1, min(MEAN_BINS, values.size // TYPICAL_IN_BIN))
    edges = np.linspace(float(values.min()), float(values.max()), bins + 1)
    place = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, bins - 1)
    counts = np.bincount(place, minlength=bins)
    sums = np.bincount(place, weights=residual, minlength=bins)
    enough = counts >= max(3.0, LEAST_IN_BIN * values.size)
    means = np.where(enough, sums / np.maximum(counts, 1), np.nan)
    return 0.5 * (edges[:-1] + edges[1:]), means


def _colors(count: int) -> tuple[str, ...]:
    """Colours of stages: one alone is blue, of several the last is."""
    if count == 1:
        return (BLUE,)
    return (STAGES[:count] if count >= 3 else (ORANGE, BLUE)) if count <= len(STAGES) else STAGES * (count // 6 + 1)


def _finish_time(figure: Figure, bottom: Axes, title: str) -> None:
    bottom.set_xlabel("time [s]")
    bottom.margins(x=0.01)
    if title:
        figure.suptitle(title, fontsize=11, x=0.02, ha="left")
