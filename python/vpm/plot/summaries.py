"""Pictures of whole results: a comparison, and the stages of a diagnosis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from vpm.plot.signals import draw_overlay, draw_residual_against, draw_residual_time
from vpm.plot.style import label, panels, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]


class ChannelLike(Protocol):
    """One channel of a comparison, as a summary draws it."""

    @property
    def channel(self) -> str:
        """Name of a channel of a plotted comparison."""

    @property
    def unit(self) -> str:
        """Unit of a channel of a plotted comparison."""

    @property
    def time(self) -> Array:
        """Time of a channel of a plotted comparison, shape (N,), s."""

    @property
    def measured(self) -> Array:
        """Measured values of a plotted comparison, shape (N,)."""

    @property
    def simulated(self) -> Array:
        """Simulated values of a plotted comparison, shape (N,)."""

    @property
    def residual(self) -> Array:
        """Residual of a plotted comparison, shape (N,)."""

    @property
    def relative_error(self) -> float:
        """Relative error of a channel of a plotted comparison, percent."""


class ComparisonLike(Protocol):
    """Comparison of a run with a log, as `plot_comparison` draws it."""

    @property
    def model_name(self) -> str:
        """Name of the model of a plotted comparison."""

    @property
    def experiment_name(self) -> str:
        """Name of the log of a plotted comparison."""

    @property
    def mode(self) -> str:
        """Mode of simulation of a plotted comparison."""

    @property
    def channels(self) -> Sequence[ChannelLike]:
        """Channels of a plotted comparison."""

    @property
    def state(self) -> Mapping[str, Array]:
        """Motion of the joints at the same samples."""

    @property
    def state_units(self) -> Mapping[str, str]:
        """Units of the joint motion of a plotted comparison."""


class PictureLike(Protocol):
    """Residuals of one joint at each stage of a diagnosis."""

    @property
    def channel(self) -> str:
        """Name."""

    @property
    def unit(self) -> str:
        """Unit of the residual."""

    @property
    def coordinate_unit(self) -> str:
        """Unit of the position."""

    @property
    def time(self) -> Array:
        """Shape (N,), s."""

    @property
    def position(self) -> Array:
        """Shape (N,)."""

    @property
    def velocity(self) -> Array:
        """Shape (N,)."""

    @property
    def before(self) -> Array:
        """Residual of the nominal model, shape (N,); NaN where a sample does not count."""

    @property
    def recalibrated(self) -> Array:
        """Residual with fitted parameters, shape (N,)."""

    @property
    def after(self) -> Array:
        """Residual with the accepted effects, shape (N,)."""


@styled
def plot_comparison(comparison: ComparisonLike) -> Figure:
    """Draw a summary of a comparison: measured and simulated channels, residuals over time and velocity.

    Parameters
    ----------
    comparison : Comparison
    """
    channels = comparison.channels
    figure, axes = panels(len(channels), 3, height=2.6, width=13.0)
    for row, each in zip(axes, channels, strict=True):
        starts = [0, *(int(at) + 1 for at in np.flatnonzero(np.diff(each.time) <= 0.0))]
        draw_overlay(row[0], each.time, each.measured, each.simulated, starts)
        row[0].set_title(f"{each.channel}, error {each.relative_error:.3g} %")
        row[0].set_xlabel("time [s]")
        row[0].set_ylabel(label(each.channel.rpartition(".")[2], each.unit))
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
def plot_pictures(pictures: Sequence[PictureLike]) -> Figure:
    """Draw a summary of stages: the residual of each joint over time, velocity and position.

    Parameters
    ----------
    pictures : sequence of Picture
    """
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


def _velocity_of(comparison: ComparisonLike, channel: str) -> str | None:
    """Velocity of the channel's own joint, else that of the first joint."""
    known = [name for name in comparison.state if name.endswith(".velocity")]
    own = f"{channel.rpartition('.')[0]}.velocity"
    return own if own in known else known[0] if known else None
