"""Pictures of a diagnosis: measured and simulated, residuals of one joint, correlation of what was fitted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from vpm.numbers import Array
from vpm.plot.signals import amplitude_density, draw_correlation, draw_residual_against, draw_residual_time
from vpm.plot.style import BLUE, INK, ORANGE, SOFT, label, legend_above, panels, styled, thinned

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from vpm.discrepancy.diagnosis import Picture, Trace


#: Samples of a segment of a spectrum: a picture shows no finer lines; and points that are few enough to have a mark.
MOST_IN_SEGMENT, FEW = 2048, 40
#: Parameters beyond which a matrix of correlations shows no numbers in its fields.
MOST_NUMBERS = 14


@styled
def plot_traces(traces: Sequence[Trace]) -> Figure:
    """Draw the findings' channels over time: measured pale and broad, simulated before and after."""
    figure, axes = panels(max(1, len(traces)), height=2.1, share_x=True)
    for row, trace in zip(axes, traces, strict=False):
        axis = row[0]
        time, measured, before, after = thinned(trace.time, trace.measured, trace.before, trace.after)
        axis.plot(time, measured, color=SOFT, alpha=0.5, linewidth=3.2, label="measured")
        axis.plot(time, before, color=ORANGE, linewidth=1.0, linestyle="--", label="simulated before")
        axis.plot(time, after, color=BLUE, linewidth=1.0, label="simulated after")
        axis.set_ylabel(label(trace.channel, trace.unit))
        axis.margins(x=0.01)
    legend_above(axes[0][0], 3)
    axes[-1][0].set_xlabel("time [s]")
    return figure


@styled
def plot_joint_over_time(picture: Picture, stages: Mapping[str, Array]) -> Figure:
    """Draw findings at a joint over time: efforts, measured and needed, and residuals below.

    ``stages``: each of shape (n,), residuals; NaN, where a sample does not count, leaves a gap.
    """
    figure, ((above,), (below,)) = panels(2, height=2.2, share_x=True)
    time, measured = thinned(picture.time, picture.measured)
    above.plot(time, measured, color=SOFT, alpha=0.5, linewidth=3.2, label="measured")
    last = list(stages)[-1]
    for name, residual in stages.items():
        time, needed = thinned(picture.time, picture.measured - residual)
        color, line = (BLUE, "-") if name == last else (ORANGE, "--")
        above.plot(time, needed, color=color, linestyle=line, linewidth=1.0, label=f"needed, {name}")
    above.set_ylabel(label(picture.channel, picture.unit))
    legend_above(above, 3)
    draw_residual_time(below, picture.time, stages, picture.unit)
    return figure


@styled
def plot_joint_over_state(picture: Picture, stages: Mapping[str, Array]) -> Figure:
    """Draw findings at a joint: the residual against velocity and position.

    ``stages``: each of shape (n,).
    """
    figure, axes = panels(1, 2, height=3.2, width=11.0)
    unit = picture.coordinate_unit
    for axis, values, name in zip(
        axes[0],
        (picture.velocity, picture.position),
        (f"velocity [{unit}/s]", f"position [{unit}]"),
        strict=True,
    ):
        draw_residual_against(axis, values, stages, name, unit=picture.unit, velocity=picture.velocity)
    lines, names = axes[0][0].get_legend_handles_labels()
    figure.legend(lines, names, loc="outside upper left", ncols=2, title="> forward, < backward", alignment="left")
    return figure


@styled
def plot_joint_noise(
    stages: Mapping[str, Array], correlation: tuple[Array, Array, Array], rate: float, unit: str
) -> Figure:
    """Draw the findings' remaining noise: correlation with its 95 % band, and spectra of all stages.

    - ``stages``: each of shape (n,), NaN where a sample does not count
    - ``correlation``: lags in s, values, and half the width of the band at each
    - ``rate``: Hz
    - ``unit``: of the residual
    """
    figure, axes = panels(1, 2, height=3.0, width=11.0)
    draw_correlation(axes[0][0], *correlation, "correlation with its own past")
    right = axes[0][1]
    for (name, values), color in zip(stages.items(), (ORANGE, BLUE)[-len(stages) :], strict=True):
        frequency, density = amplitude_density(values, rate, MOST_IN_SEGMENT)
        there = density > 0.0
        if there.any():
            mark = ".-" if frequency.size < FEW else "-"
            right.loglog(frequency[there], density[there], mark, color=color, label=name)
    right.set(xlabel="frequency [Hz]", ylabel=label("density", f"{unit}/√Hz"))
    legend_above(right, 2)
    return figure


@styled
def plot_parameter_correlation(names: Sequence[str], correlation: Array) -> Figure:
    """Draw the correlation matrix of fitted parameters among findings.

    ``correlation``: shape (p, p).
    """
    figure, ((axis,),) = panels(1, height=0.8 + 0.34 * len(names), width=min(11.0, 4.4 + 0.55 * len(names)))
    shown = axis.imshow(correlation, cmap="RdBu_r", vmin=-1.0, vmax=1.0, aspect="auto")
    if len(names) <= MOST_NUMBERS:
        for row, values in enumerate(correlation):
            for column, value in enumerate(values):
                color = "white" if abs(value) > 0.6 else INK
                axis.text(column, row, f"{value:.2f}", ha="center", va="center", fontsize=8, color=color)
    axis.set_yticks(range(len(names)), names)
    axis.set_xticks(range(len(names)), [str(number) for number in range(1, len(names) + 1)])
    axis.set_yticklabels([f"{name}  {number}" for number, name in enumerate(names, 1)])
    axis.grid(visible=False)
    figure.colorbar(shown, ax=axis, label="correlation")
    return figure
