"""Pictures of scenarios: all runs in each panel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf
from textwrap import fill
from typing import TYPE_CHECKING, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from vpm.plot.style import BLUE, GREEN, INK, ORANGE, PURPLE, SKY, SOFT, label, panels, styled, thinned
from vpm.units import convert

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

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


class ScenarioLike(Protocol):
    """What `plot_scenario` draws."""

    @property
    def name(self) -> str:
        """Of the scenario."""

    @property
    def panels(self) -> Sequence[Sequence[str]]:
        """Channels of each panel."""

    @property
    def runs(self) -> Mapping[str, object]:
        """By name."""

    @property
    def failures(self) -> Mapping[str, str]:
        """What went wrong, by the name of the run."""

    def traces(self, channel: str) -> Mapping[str, tuple[Array, Array]]:
        """Time and values in each run that has the channel."""

    def unit(self, channel: str) -> str:
        """SI unit of a channel."""


@styled
def plot_scenario(result: ScenarioLike) -> Figure:
    """Draw all runs over time: a colour for each run, a style of line for each channel of a panel.

    Parameters
    ----------
    result : ScenarioRun
    """
    from matplotlib.lines import Line2D

    figure, axes = panels(max(1, len(result.panels)), height=1.9, share_x=True)
    colors = {name: RUNS[place % len(RUNS)] for place, name in enumerate(result.runs)}
    for (axis,), channels in zip(axes, result.panels, strict=False):
        _draw_panel(axis, result, channels, colors)
    axes[-1][0].set_xlabel("time [s]")
    axes[-1][0].margins(x=0.01)
    figure.suptitle(result.name, fontsize=11, x=0.02, ha="left")
    if len(colors) > 1:
        handles = [Line2D([], [], color=color, linewidth=2.0, label=name) for name, color in colors.items()]
        figure.legend(handles=handles, loc="outside upper right", ncols=min(len(handles), 3))
    told = "\n".join(fill(f"{name} failed: {reason}", 110) for name, reason in result.failures.items())
    if told:
        figure.supxlabel(told, fontsize=8, color=ORANGE)
    return figure


def _draw_panel(axis: Axes, result: ScenarioLike, channels: Sequence[str], colors: Mapping[str, str]) -> None:
    from matplotlib.lines import Line2D

    styles = {channel: CHANNELS[place % len(CHANNELS)] for place, channel in enumerate(channels)}
    found = {channel: result.traces(channel) for channel in channels}
    largest = max((float(np.abs(values).max(initial=0.0)) for each in found.values() for _, values in each.values()))
    unit = next((result.unit(channel) for channel in channels if found[channel]), "1")
    shown = readable_unit(unit, largest)
    factor = convert(1.0, unit, shown)
    for channel, traces in found.items():
        shared = len(traces) > 1 and _alike([values for _, values in traces.values()])
        for name, (time, values) in list(traces.items())[: 1 if shared else None]:
            color = INK if shared else colors[name]
            axis.plot(*thinned(time, factor * values), styles[channel], color=color, linewidth=1.1)
    quantities = {channel.rpartition(".")[2] for channel in channels}
    axis.set_ylabel(label(quantities.pop().replace("_", " ") if len(quantities) == 1 else "", shown).strip())
    if len(channels) == 1:
        axis.set_title(channels[0])
        return
    handles = [Line2D([], [], color=SOFT, linestyle=style, label=channel) for channel, style in styles.items()]
    # A power of ten of the axis stands in the corner, where the legend would hide it.
    corner = 0.0 if 1e-3 <= factor * largest < 1e4 else 0.06
    axis.legend(handles=handles, loc="lower left", bbox_to_anchor=(corner, 1.0), ncols=4, borderaxespad=0.2)


def readable_unit(unit: str, largest: float) -> str:
    """Unit in which values up to ``largest`` (SI) are read best.

    Examples
    --------
    >>> readable_unit("Pa", 1.6e7)
    'bar'
    """
    return next((other for other, low, high in _READABLE.get(unit, ()) if low <= largest < high), unit)


def _alike(traces: Sequence[Array]) -> bool:
    """Whether all runs show the same, as with a common reference: then one line stands for all."""
    return all(np.array_equal(traces[0], trace) for trace in traces[1:])
