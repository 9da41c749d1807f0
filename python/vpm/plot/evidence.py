"""The picture of a finding: the residual over the state that the effect lives in, without the effect and with it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vpm.numbers import Array, short
from vpm.plot.style import BLUE, INK, LINE, ORANGE, SOFT, label, panels, styled

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from vpm.discrepancy.evidence import Evidence


#: Points that a cloud keeps.
MOST_DOTS = 1200
#: Bins of the line that stands for the law, and share of the law that a line has to explain to stand for it.
LAW_BINS, LINE_SHARE = 300, 0.97
#: The band of the noise floor reaches this many times its root mean square: 95 % of normal noise.
BAND = 1.96


@styled
def plot_evidence(evidence: Evidence) -> Figure:
    """Draw the evidence of an effect: the residual without it, the fitted law, and the residual with it.

    ``evidence``: over frequency, both residuals stand in one panel as amplitude densities.
    """
    if evidence.axis == "frequency":
        return _spectra(evidence)
    figure, axes = panels(1, 3, height=3.0, width=11.0)
    left, middle, right = axes[0]
    draw_partial(left, evidence)
    draw_remaining(middle, evidence)
    draw_remaining(right, evidence)
    left.set_title(f"without it: {_size(evidence.without, evidence.unit)}")
    middle.set_title(f"with it: {_size(evidence.repaired, evidence.unit)}")
    right.set_title("the same, magnified")
    scale = _limits(np.concatenate([evidence.without, evidence.repaired, evidence.law]))
    low, high = _limits(evidence.repaired, 4.0)
    reach = float(np.nan_to_num(1.3 * BAND * evidence.noise_floor))
    near = (min(low, -reach), max(high, reach))
    for axis, limits in ((left, scale), (middle, scale), (right, near)):
        axis.set_ylim(*limits)
        axis.set_xlabel(label(evidence.name, evidence.axis_unit))
        axis.margins(x=0.02)
    left.set_ylabel(label(f"residual of {evidence.channel}", evidence.unit))
    figure.legend(*_entries(left, middle), loc="outside upper left", ncols=4, markerscale=3.0)
    return figure


def draw_partial(axis: Axes, evidence: Evidence) -> None:
    """Draw evidence: the residual without the effect as a cloud, and the law over it."""
    _cloud(axis, evidence.values, evidence.without, ORANGE, "residual without it")
    order = np.argsort(evidence.law_values, kind="stable")
    values, law = evidence.law_values[order], evidence.law[order]
    centers, means, share = law_line(values, law)
    if share >= LINE_SHARE:
        axis.plot(centers, means, color="white", linewidth=3.4, alpha=0.8)
        axis.plot(centers, means, color=INK, linewidth=1.6, label="fitted law")
    else:
        axis.plot(values, law, ".", color=INK, markersize=2.2, markeredgewidth=0, rasterized=True, label="fitted law")
    axis.axhline(0.0, color=SOFT, linewidth=0.7)


def draw_remaining(axis: Axes, evidence: Evidence) -> None:
    """Draw evidence: the residual with the effect as a cloud over the noise floor."""
    floor = evidence.noise_floor
    if np.isfinite(floor):
        axis.axhspan(-BAND * floor, BAND * floor, color=LINE, alpha=0.8, linewidth=0, label="noise floor, 95 %")
    _cloud(axis, evidence.values, evidence.repaired, BLUE, "residual with it")
    axis.axhline(0.0, color=SOFT, linewidth=0.7)


def law_line(values: Array, law: Array) -> tuple[Array, Array, float]:
    """Line of a law for plotted evidence: means in bins of equal size, and their share.

    No bin reaches over zero, where friction steps: its mean would be a level that the law never has.

    ``values``, ``law``: shape (n,), in the order of ``values``.

    - result ``centers``, ``means``: shape (bins,)
    - result ``share``: 1 for a law that is a function of ``values``, 0 for one that does not depend on them
    """
    power = float(law @ law)
    sides = np.split(np.arange(values.size), np.searchsorted(values, [0.0]))
    counts = [max(1, min(LAW_BINS * side.size // values.size, side.size // 6)) for side in sides]
    parts = [part for side, n in zip(sides, counts, strict=True) if side.size for part in np.array_split(side, n)]
    centers = np.array([values[part].mean() for part in parts])
    means = np.array([law[part].mean() for part in parts])
    rest = float(np.sum((law - np.interp(values, centers, means)) ** 2))
    return centers, means, 1.0 - rest / power if power > 0.0 else 0.0


def _spectra(evidence: Evidence) -> Figure:
    """Amplitude densities of plotted evidence (Welch's method): both residuals and the law."""
    from scipy.signal import welch

    figure, ((axis,),) = panels(1, height=3.0)
    step = float(np.median(np.diff(evidence.time)))
    length = min(evidence.time.size, max(128, evidence.time.size // 6))
    rows = (
        ("residual without it", evidence.without, ORANGE, 1.6),
        ("fitted law", evidence.without - evidence.repaired, INK, 0.9),
        ("residual with it", evidence.repaired, BLUE, 1.6),
    )
    for name, values, color, width in rows:
        frequency, power = welch(values, 1.0 / step, nperseg=length, detrend="constant")
        axis.loglog(frequency[1:], np.sqrt(power[1:]), color=color, linewidth=width, label=name)
    if np.isfinite(evidence.noise_floor):
        level = evidence.noise_floor / np.sqrt(0.5 / step)
        axis.axhline(level, color=SOFT, linewidth=3.0, alpha=0.4, label="noise floor, if white")
    axis.set(
        xlabel=label("frequency", "Hz"),
        ylabel=label("residual", f"{evidence.unit}/√Hz"),
        title=f"without: {_size(evidence.without, evidence.unit)};  with: {_size(evidence.repaired, evidence.unit)}",
    )
    figure.legend(*axis.get_legend_handles_labels(), loc="outside upper left", ncols=4)
    return figure


def _cloud(axis: Axes, values: Array, residual: Array, color: str, name: str) -> None:
    step = -(-values.size // MOST_DOTS)
    shown = -(-values.size // step)
    size = float(np.clip(130.0 / np.sqrt(shown), 3.0, 6.5))
    axis.plot(
        values[::step],
        residual[::step],
        ".",
        color=color,
        alpha=0.5,
        markersize=size,
        markeredgewidth=0,
        rasterized=shown > 60,
        label=name,
    )


def _limits(values: Array, left_out: float = 0.5) -> tuple[float, float]:
    """Axis limits of plotted evidence: without the last few percent, and with zero."""
    low, high = (float(each) for each in np.percentile(values, [0.5 * left_out, 100.0 - 0.5 * left_out]))
    room = 0.08 * (high - low) or 1.0
    return min(low, 0.0) - room, max(high, 0.0) + room


def _size(residual: Array, unit: str) -> str:
    return f"{short(float(np.sqrt(np.mean(residual**2))))} {unit} rms"


def _entries(*axes: Axes) -> tuple[list[Artist], list[str]]:
    found = [axis.get_legend_handles_labels() for axis in axes]
    return [handle for handles, _ in found for handle in handles], [name for _, names in found for name in names]
