"""Picture of an identification of inertial parameters: estimates and intervals over CAD values."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from vpm.numbers import Array
from vpm.plot.style import BLUE, INK, LINE, ORANGE, SOFT, panels, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from vpm.identify.inertial_fit import InertialFit


#: Half width of a 95 % interval, relative to the value, up to which a base parameter is drawn as known.
KNOWN = 0.2
#: Width of the axis in sizes of the value: wider intervals end in its frame, with their number beside it.
WIDEST = 3.0


@styled
def plot_inertial(fit: InertialFit) -> Figure:
    """Draw bars of estimates over the CAD values with 95 % intervals; above parameters, below base parameters."""
    shown = np.array([k for k, word in enumerate(fit.identifiable) if word != "no"], dtype=int)
    rows = max(len(shown), len(fit.base_words))
    combined = tuple(fit.base_words) != tuple(fit.names[k] for k in shown)
    figure, axes = panels(2 if combined else 1, height=0.7 + 0.22 * rows, width=9.0)
    known = [fit.identifiable[k] == "yes" for k in shown]
    words = [f"{fit.names[k]} ({fit.identifiable[k]})" for k in shown]
    _bars(axes[0][0], words, fit.nominal[shown], fit.values[shown], fit.quantile * fit.std[shown], known)
    axes[0][0].set_title("parameters")
    if not combined:
        return figure
    short = [text if len(text) <= 60 else f"{text[:57]}..." for text in fit.base_words]
    half = fit.quantile * fit.base_std
    _bars(axes[1][0], short, fit.base_nominal, fit.base_values, half, list(half <= KNOWN * np.abs(fit.base_values)))
    axes[1][0].set_title("base parameters")
    return figure


def _bars(axis: Axes, names: Sequence[str], nominal: Array, values: Array, half: Array, known: Sequence[bool]) -> None:
    size = np.abs(np.where(np.isfinite(nominal) & (nominal != 0.0), nominal, values))
    size = np.where(size > 0.0, size, 1.0)
    for row, (value, spread, scale, sure) in enumerate(zip(values, half, size, known, strict=True)):
        center = float(np.clip(value / scale, -WIDEST, WIDEST))
        reach = float(spread / scale)
        color = BLUE if sure else ORANGE
        axis.barh(row, center, height=0.55, color=color if sure else LINE)
        low, high = max(center - reach, -WIDEST), min(center + reach, WIDEST)
        axis.plot([low, high], [row, row], color=INK, linewidth=1.2)
        for end, inside in ((low, low > -WIDEST), (high, high < WIDEST)):
            axis.plot([end], [row], "|" if inside else ("<" if end < 0.0 else ">"), color=INK, markersize=6)
        text = (
            "open" if not np.isfinite(reach) else f"± {100.0 * reach:.3g} %" if reach < 10.0 else f"± {reach:.3g} times"
        )
        axis.annotate(text, (1.01, row), xycoords=("axes fraction", "data"), va="center", fontsize=7.5, color=SOFT)
    axis.axvline(1.0, color=SOFT, linewidth=1.0, linestyle="--")
    axis.set_xlim(-WIDEST, WIDEST)
    axis.set_yticks(np.arange(len(names)), names, fontsize=7.5)
    axis.set_ylim(len(names) - 0.4, -0.6)
    axis.grid(visible=False, axis="y")
    axis.set_xlabel("value / size of the CAD value; line: 95 % interval")
