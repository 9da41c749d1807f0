"""Pictures of whole results: a comparison, and the stages of a diagnosis."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from vpm.plot.signals import draw_overlay, draw_residual_against, draw_residual_time
from vpm.plot.style import label, panels, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from vpm.compare.comparison import Comparison
    from vpm.discrepancy.diagnosis import Picture


@styled
def plot_comparison(comparison: Comparison) -> Figure:
    """Draw a summary of a comparison: measured and simulated channels, residuals over time and velocity."""
    channels = comparison.channels
    figure, axes = panels(len(channels), 3, height=2.6, width=13.0)
    for row, each in zip(axes, channels, strict=True):
        starts = [0, *(int(at) + 1 for at in np.flatnonzero(np.diff(each.time) <= 0.0))]
        draw_overlay(row[0], each.time, each.measured, each.simulated, starts)
        row[0].set(
            title=f"{each.channel}, error {each.relative_error:.3g} %",
            xlabel="time [s]",
            ylabel=label(each.channel.rpartition(".")[2], each.unit),
        )
        draw_residual_time(row[1], each.time, {"": each.residual}, each.unit)
        row[1].set_title("residual over time")
        velocity = _velocity_of(comparison, each.channel)
        if velocity is None:
            row[2].remove()
            continue
        name = f"{velocity} [{comparison.state_units[velocity]}]"
        moving = comparison.state[velocity]
        draw_residual_against(row[2], moving, {"": each.residual}, name, unit=each.unit, velocity=moving)
        row[2].set_title("residual and its mean over velocity")
    title = f"{comparison.model_name} against {comparison.experiment_name}, {comparison.mode.replace('_', ' ')}"
    figure.suptitle(title, fontsize=11, x=0.01, ha="left")
    lines, names = axes[0][0].get_legend_handles_labels()
    figure.legend(lines, names, loc="outside upper right", ncols=2)
    return figure


@styled
def plot_pictures(pictures: Sequence[Picture]) -> Figure:
    """Draw a summary of stages: the residual of each joint over time, velocity and position."""
    figure, axes = panels(max(1, len(pictures)), 3, height=2.9, width=13.0)
    for row, each in zip(axes, pictures, strict=False):
        stages = {"before": each.before, "recalibrated": each.recalibrated, "with the effects": each.after}
        draw_residual_time(row[0], each.time, stages, each.unit)
        unit = each.coordinate_unit
        for axis, values, name in (
            (row[1], each.velocity, f"velocity [{unit}/s]"),
            (row[2], each.position, f"position [{unit}]"),
        ):
            draw_residual_against(axis, values, stages, name, unit=each.unit, velocity=each.velocity)
        row[0].set_title(each.channel)
    if pictures:
        lines, names = axes[0][0].get_legend_handles_labels()
        figure.legend(lines, names, loc="outside upper left", ncols=3)
    return figure


def _velocity_of(comparison: Comparison, channel: str) -> str | None:
    """Velocity of the channel's own joint, else that of the first joint."""
    known = [name for name in comparison.state if name.endswith(".velocity")]
    own = f"{channel.rpartition('.')[0]}.velocity"
    return own if own in known else known[0] if known else None
