"""Pictures of NARX models: runs beside the record, and what each term explains."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from vpm.numbers import Array
from vpm.plot.signals import draw_overlay
from vpm.plot.style import BLUE, INK, label, legend_above, panels, styled, thinned

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from vpm.narx.run import NarxRun


@styled
def plot_narx_run(run: NarxRun) -> Figure:
    """Draw a NARX run: the computed over the measured output, and their difference below."""
    figure, axes = panels(2, height=1.9, share_x=True)
    draw_overlay(axes[0][0], run.time, run.measured, run.values, [0])
    axes[0][0].set_ylabel(label(run.output, run.unit))
    legend_above(axes[0][0], 2)
    axes[1][0].plot(*thinned(run.time, run.measured - run.values), color=BLUE)
    axes[1][0].set(ylabel=label("difference", run.unit), xlabel="time")
    figure.suptitle(f"{run.kind} on {run.record}")
    return figure


@styled
def plot_narx_terms(names: Sequence[str], error_reduction: Array) -> Figure:
    """Draw the energy share still unexplained after each NARX term, in the order of choice."""
    figure, ((axis,),) = panels(1, height=0.8 + 0.22 * len(names))
    rest = np.maximum(1.0 - np.cumsum(np.nan_to_num(error_reduction)), np.finfo(np.float64).eps)
    places = np.arange(len(names))
    axis.plot(rest, places, "o-", color=BLUE)
    axis.set_xscale("log")
    axis.set_yticks(places, names)
    axis.invert_yaxis()
    axis.axvline(1.0, color=INK, linewidth=0.8)
    axis.set_xlabel("unexplained share of the output's energy, after this term")
    return figure
