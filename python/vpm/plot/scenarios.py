"""Pictures of scenarios: all runs in each panel."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, cycle
from math import inf
from textwrap import fill
from typing import TYPE_CHECKING, Literal

import numpy as np

from vpm.numbers import Array
from vpm.plot.style import BLUE, GREEN, INK, ORANGE, PURPLE, SKY, SOFT, label, panels, styled, thinned
from vpm.units import convert

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from vpm.scenario.outcome import ScenarioRun


#: Colours of runs and styles of the channels of a panel, each in the order of their use.
RUNS = (BLUE, ORANGE, GREEN, PURPLE, SKY, SOFT)
CHANNELS: tuple[Literal["-", "--", ":", "-."], ...] = ("-", "--", ":", "-.")

#: Units that people read, for values whose largest lies in a range (SI).
_READABLE: Mapping[str, tuple[tuple[str, float, float], ...]] = {
    "m": (("mm", 1e-6, 0.2),),
    "m/s": (("mm/s", 1e-6, 0.02),),
    "N": (("kN", 2e4, inf),),
    "Pa": (("bar", 1e4, inf),),
    "m^3/s": (("l/min", 1e-7, inf),),
    "A": (("mA", 1e-6, 0.2),),
}


@dataclass(frozen=True)
class _Row:
    """A panel of each column: channels, what the runs show of them, and the unit in which that is drawn.

    The range is that of the runs that did not fail, if there are any; None where nothing failed.
    """

    channels: Sequence[str]
    traces: Mapping[str, Mapping[str, tuple[Array, Array]]]
    unit: str
    factor: float
    largest: float
    limits: tuple[float, float] | None


@styled
def plot_scenario(result: ScenarioRun) -> Figure:
    """Draw all runs of a scenario: a colour for each run, a line style for each channel.

    Columns of the scenario stand side by side with common axes.
    """
    columns = result.columns or {"": tuple(result.runs)}
    width = 8.0 if len(columns) == 1 else 5.0 * len(columns)
    rows = max(1, len(result.panels))
    figure, axes = panels(rows, len(columns), height=1.6 + 1.2 / rows, width=width, share_x=True)
    colors = {name: RUNS[place % len(RUNS)] for place, name in enumerate(result.runs)}
    for row, channels in zip(axes, result.panels, strict=False):
        _draw_row(row, _row(result, channels), list(columns.values()), colors)
    for axis, heading in zip(axes[0], columns, strict=True):
        at, shift = (0.5, 1.0), (0.0, 20.0)
        axis.annotate(heading, at, shift, "axes fraction", "offset points", ha="center", fontsize=10)
    for axis in axes[-1]:
        axis.set_xlabel("time [s]")
    for axis in chain.from_iterable(axes):
        axis.margins(x=0.01)
    _finish(figure, result, colors, list(columns.values()))
    return figure


def _finish(figure: Figure, result: ScenarioRun, colors: Mapping[str, str], columns: Sequence[Sequence[str]]) -> None:
    """Finish a scenario's picture: title, names of the runs, and what failed."""
    from matplotlib.lines import Line2D

    figure.suptitle(result.name, fontsize=11, x=0.02, ha="left")
    shown = [name for name in dict.fromkeys(chain.from_iterable(columns)) if name in colors]
    if len(shown) > 1:
        handles = [Line2D([], [], color=colors[name], linewidth=2.0, label=name) for name in shown]
        # Columns of equal length stand in the legend as in the picture.
        alike = len(columns) > 1 and len({len(names) for names in columns}) == 1
        figure.legend(handles=handles, loc="outside upper right", ncols=len(columns) if alike else min(len(shown), 3))
    told = "\n".join(fill(f"{name} failed: {reason}", 110) for name, reason in result.failures.items())
    if told:
        figure.supxlabel(told, fontsize=8, color=ORANGE)


def _row(result: ScenarioRun, channels: Sequence[str]) -> _Row:
    traces = {channel: result.traces(channel) for channel in channels}
    pieces = [(name, values) for each in traces.values() for name, (_, values) in each.items() if values.size]
    sound = [values for name, values in pieces if name not in result.failures] or [values for _, values in pieces]
    low = min((float(values.min()) for values in sound), default=0.0)
    high = max((float(values.max()) for values in sound), default=0.0)
    unit = next((result.unit(channel) for channel in channels if traces[channel]), "1")
    shown = readable_unit(unit, max(-low, high))
    factor = convert(1.0, unit, shown)
    margin = 0.05 * factor * (high - low)
    limits = (factor * low - margin, factor * high + margin) if result.failures and high > low else None
    return _Row(channels, traces, shown, factor, factor * max(-low, high), limits)


def _draw_row(axes: Sequence[Axes], row: _Row, columns: Sequence[Sequence[str]], colors: Mapping[str, str]) -> None:
    """Draw a row of a scenario's picture: a panel for each column of runs, all of one scale."""
    for axis, names in zip(axes, columns, strict=True):
        if axis is not axes[0]:
            axis.sharey(axes[0])
            axis.tick_params(labelleft=False)
        for style, traces in zip(cycle(CHANNELS), row.traces.values(), strict=False):
            here = [(name, *traces[name]) for name in names if name in traces]
            shared = len(traces) > 1 and _alike([values for _, values in traces.values()])
            for place, (name, time, values) in enumerate(here[: 1 if shared else None]):
                color = INK if shared else colors[name]
                # Later lines are thinner, so that one that they cover can be seen behind them.
                width = 1.1 + 0.45 * (len(here) - 1 - place) if len(here) <= 4 and not shared else 1.1
                axis.plot(*thinned(time, row.factor * values), style, color=color, linewidth=width)
    if row.limits is not None:
        axes[0].set_ylim(row.limits)
    _name_channels(axes[0], row)


def _name_channels(axis: Axes, row: _Row) -> None:
    from matplotlib.lines import Line2D

    # pressure_a and pressure_b are pressures.
    quantities = {re.sub(r"_[ab]$", "", channel.rpartition(".")[2]) for channel in row.channels}
    axis.set_ylabel(label(quantities.pop().replace("_", " ") if len(quantities) == 1 else "", row.unit).strip())
    if len(row.channels) == 1:
        axis.set_title(row.channels[0])
        return
    handles = [
        Line2D([], [], color=SOFT, linestyle=style, label=channel)
        for style, channel in zip(cycle(CHANNELS), row.channels, strict=False)
    ]
    # A power of ten of the axis stands in the corner, where the legend would hide it.
    corner = 0.0 if 1e-3 <= row.largest < 1e4 else 0.06
    axis.legend(handles=handles, loc="lower left", bbox_to_anchor=(corner, 1.0), ncols=4, borderaxespad=0.2)


def readable_unit(unit: str, largest: float) -> str:
    """Unit in which a scenario's values up to ``largest`` (SI) are read best.

    Examples
    --------
    >>> readable_unit("Pa", 1.6e7)
    'bar'
    """
    return next((other for other, low, high in _READABLE.get(unit, ()) if low <= largest < high), unit)


def _alike(traces: Sequence[Array]) -> bool:
    """Whether all runs of a scenario show the same: then one line stands for all."""
    return all(np.array_equal(traces[0], trace) for trace in traces[1:])
