"""Pictures of numbers: parameters, gaps, candidates, ladders and step times."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from vpm.numbers import percent, short
from vpm.plot.style import BLUE, GREEN, INK, LINE, ORANGE, SOFT, legend_above, panels, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from vpm.climb.result import Level
    from vpm.discrepancy.diagnosis import ChannelGap, RankedCandidate


#: Candidates that are drawn.
MOST_CANDIDATES = 16


@styled
def plot_parameters(
    names: Sequence[str], values: ArrayLike, std: ArrayLike, start: ArrayLike, units: Sequence[str]
) -> Figure:
    """Draw bars of parameters relative to their start, with 95 % intervals and numbers.

    ``values``, ``std``, ``start``: shape (p,), SI. Where a start is zero, the axis shows the value over its own size.
    """
    value, sigma, begin = (np.asarray(each, dtype=np.float64) for each in (values, std, start))
    scale = np.where(begin == 0.0, np.where(value == 0.0, 1.0, np.abs(value)), np.abs(begin))
    figure, ((axis,),) = panels(1, height=0.6 + 0.34 * len(names))
    rows = np.arange(len(names))
    axis.plot(begin / scale, rows, "|", color=SOFT, markersize=13, markeredgewidth=2, label="start")
    error = np.where(np.isfinite(sigma), 1.96 * sigma / scale, 0.0)
    axis.errorbar(value / scale, rows, xerr=error, fmt="o", color=BLUE, capsize=3, markersize=5, label="fit, 95 %")
    for row, (number, spread, unit) in enumerate(zip(value, sigma, units, strict=True)):
        text = f"{short(number)} ± {spread:.2g} {unit if unit != '1' else ''}"
        axis.annotate(text, (1.01, row), xycoords=("axes fraction", "data"), va="center", fontsize=8.5, color=INK)
    _name_rows(axis, names)
    axis.set_xlabel("value / size of the start")
    axis.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, borderaxespad=0.2)
    return figure


@styled
def plot_gap(gaps: Mapping[str, ChannelGap]) -> Figure:
    """Draw bars of each channel's error at each stage as a share of the signal, with the noise floor."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    figure, ((axis,),) = panels(1, height=0.5 + 0.85 * max(1, len(gaps)))
    stages = (("before", SOFT), ("recalibrated", ORANGE), ("after", BLUE))
    largest = 0.0
    for row, gap in enumerate(gaps.values()):
        if not gap.signal > 0.0:
            axis.annotate("no signal", (0.0, row), xytext=(4, 0), textcoords="offset points", va="center", color=SOFT)
            continue
        for shift, (stage, color) in enumerate(stages):
            share = 100.0 * float(getattr(gap, stage)) / gap.signal
            largest = max(largest, share)
            place = row + 0.27 * (shift - 1)
            axis.barh(place, share, height=0.24, color=color)
            axis.annotate(
                percent(share / 100.0), (share, place), xytext=(4, 0), textcoords="offset points", va="center"
            )
        if np.isfinite(gap.noise_floor):
            floor = 100.0 * gap.noise_floor / gap.signal
            axis.plot([floor, floor], [row - 0.42, row + 0.42], "--", color=INK, linewidth=1.1)
    axis.set_xlim(0.0, 1.13 * largest if largest > 0.0 else 1.0)
    _name_rows(axis, list(gaps))
    axis.set_xlabel("root mean square gap / measured signal [%]")
    kinds = [Patch(color=color, label=stage) for stage, color in stages]
    floor_line = Line2D([], [], linestyle="--", color=INK, linewidth=1.1, label="noise floor")
    legend_above(axis, 4, [*kinds, floor_line] if any(np.isfinite(g.noise_floor) for g in gaps.values()) else kinds)
    return figure


@styled
def plot_candidates(candidates: Sequence[RankedCandidate]) -> Figure:
    """Draw bars of what candidates of the first round would explain, and did after a refit.

    ``candidates``: the best sixteen are drawn; an accepted one in whichever round it was.
    """
    from matplotlib.patches import Patch

    chosen = drawn_candidates(candidates)
    figure, ((axis,),) = panels(1, height=0.5 + 0.36 * max(1, len(chosen)))
    for row, each in enumerate(chosen):
        axis.barh(row + 0.17, 100.0 * np.nan_to_num(each.screened), height=0.3, color=LINE)
        axis.barh(row - 0.17, 100.0 * np.nan_to_num(each.unseen), height=0.3, color=GREEN if each.accepted else ORANGE)
        if not np.isfinite(each.unseen):
            axis.annotate(
                "not refitted",
                (0.0, row - 0.17),
                xytext=(4, 0),
                textcoords="offset points",
                va="center",
                fontsize=7.5,
                color=SOFT,
            )
    axis.axvline(0.0, color=INK, linewidth=0.8)
    _name_rows(axis, [f"{c.name.replace('_', ' ')} at {c.site}" for c in chosen])
    axis.set_xlabel("share of the residual's mean square that goes [%]")
    kinds = {"screened, training data": LINE, "accepted, validation data": GREEN, "refused, validation data": ORANGE}
    legend_above(axis, 4, [Patch(color=color, label=text) for text, color in kinds.items()])
    return figure


def drawn_candidates(candidates: Sequence[RankedCandidate]) -> list[RankedCandidate]:
    """Candidates among the bars of `plot_candidates`, accepted ones above."""
    first = min((c.round for c in candidates), default=1)
    chosen = [c for c in candidates if c.round == first or c.accepted]
    chosen.sort(key=lambda c: (not c.accepted, c.round if c.accepted else 0, -np.nan_to_num(c.screened)))
    return chosen[:MOST_CANDIDATES]


@styled
def plot_ladder(
    seconds: Sequence[float],
    errors: Sequence[float],
    chosen: int,
    front: Sequence[int] = (),
    allowed: float = np.inf,
    limit: float = np.inf,
) -> Figure:
    """Draw errors over step times of a simplification, the chosen model marked, logarithmically.

    - ``seconds``: s per step
    - ``errors``: shares of the signal
    - ``chosen``: index of the rung to take
    - ``front``: indices of those that no other one beats
    - ``allowed``: share of the period that a step may take, s
    - ``limit``: largest error that is allowed
    """
    figure, ((axis,),) = panels(1, height=3.0)
    times, gaps = 1e6 * np.asarray(seconds), 100.0 * np.asarray(errors)
    axis.plot(times, gaps, "o", color=SOFT, alpha=0.7, markersize=5, label="tried")
    if len(front):
        places = list(front)
        axis.step(times[places], gaps[places], where="post", color=BLUE, linewidth=1.2, label="nothing beats these")
    if np.isfinite(allowed):
        axis.axvline(1e6 * allowed, color=SOFT, linestyle="--", linewidth=1.0, label="allowed share of the period")
    if np.isfinite(limit):
        axis.axhline(100.0 * limit, color=SOFT, linestyle=":", linewidth=1.0, label="allowed error")
    axis.set(xscale="log", yscale="log")
    axis.plot(times[chosen], gaps[chosen], "D", color=BLUE, markersize=8, label="chosen")
    axis.set(xlabel="time of one step [µs]", ylabel="error / signal [%]")
    axis.legend(loc="upper right")
    return figure


@styled
def plot_step_cost(quantiles: Mapping[str, float], period: float) -> Figure:
    """Draw bars of step-time quantiles against the period, on a logarithmic axis.

    ``quantiles``: name of the quantile to seconds; ``period``: s.
    """
    figure, ((axis,),) = panels(1, height=0.5 + 0.4 * max(1, len(quantiles)))
    times = 1e6 * np.array(list(quantiles.values()))
    late = times > 1e6 * period
    low = 0.5 * min(float(times.min()), 1e6 * period)
    for row, (time, is_late) in enumerate(zip(times, late, strict=True)):
        axis.barh(row, time - low, left=low, height=0.55, color=ORANGE if is_late else BLUE)
        text = f"{time:.4g} µs, {100e-6 * time / period:.3g} %"
        axis.annotate(text, (1.02, row), xycoords=("axes fraction", "data"), va="center", fontsize=8.5)
    axis.axvline(1e6 * period, color=INK, linewidth=1.4, linestyle="--")
    axis.annotate("period, 100 %", (1e6 * period, 1.0), xycoords=("data", "axes fraction"), ha="center", va="bottom")
    axis.set_xscale("log")
    axis.set_xlim(low, 2.0 * max(1e6 * period, float(times.max())))
    _name_rows(axis, list(quantiles))
    axis.set_xlabel("time of one step [µs]")
    return figure


def _name_rows(axis: Axes, names: Sequence[str]) -> None:
    axis.set_yticks(np.arange(len(names)), names)
    axis.set_ylim(len(names) - 0.4, -0.6)
    axis.grid(visible=False, axis="y")
    axis.tick_params(axis="y", length=0, labelcolor=INK)


@styled
def plot_climb(levels: Sequence[Level], top: str) -> Figure:
    """Draw bars of validation errors over the level of detail, and below how each parameter moved.

    ``levels``: simplest first; ``top``: name of the level at which detail stops to pay.
    """
    figure, ((above,), (below,)) = panels(2, height=2.4, share_x=True)
    places, errors = np.arange(len(levels)), np.array([100.0 * level.error for level in levels])
    above.plot(places, errors, color=SOFT, linewidth=1.2)
    for place, (error, level) in enumerate(zip(errors, levels, strict=True)):
        marker, size = ("D", 8) if level.name == top else ("o", 6)
        above.plot(place, error, marker, color=BLUE if level.pays else SOFT, markersize=size)
    above.set(yscale="log", ylabel="error on validation\ndata [%]")
    last = next(level for level in levels if level.name == top)
    for name, value in last.values.items():
        held = [k for k, level in enumerate(levels) if name in level.values]
        scale = abs(value) or 1.0
        std = [levels[k].std[name] / scale for k in held]
        bars = [each if np.isfinite(each) else 0.0 for each in std]
        below.errorbar(
            held, [levels[k].values[name] / scale for k in held], 1.96 * np.array(bars), fmt="o-", capsize=3, label=name
        )
    below.set_ylabel("parameter / its value\nat the chosen level")
    below.set_xticks(places, [level.name for level in levels], rotation=20, ha="right")
    if last.values:
        below.legend(loc="best", fontsize=7.5)
    return figure
