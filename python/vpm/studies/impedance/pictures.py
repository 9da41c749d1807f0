"""Pictures of impedances: loops with their ellipses, and tables of repeated tests with intervals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from vpm.plot.style import BLUE, INK, ORANGE, SOFT, label, panels, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from vpm.studies.impedance.hysteresis_loop import Loop
    from vpm.studies.impedance.repeated import Repeated, RepeatedTests


@styled
def plot_loops(loops: Sequence[Loop]) -> Figure:
    """Draw impedance loops, measured and of the fitted spring and damper, with and without slope."""
    figure, axes = panels(len(loops), 2, height=2.6)
    angle = np.linspace(0.0, 2.0 * np.pi, 721)
    for (whole, bare), loop in zip(axes, loops, strict=True):
        orders = np.arange(1, loop.displacement_harmonics.size + 1)
        waves = np.exp(1j * np.outer(angle, orders)) * loop.displacement_harmonics
        place = waves.sum(axis=1).real
        speed = (2j * np.pi * loop.frequency * orders * waves).sum(axis=1).real
        lag = loop.force - loop.stiffness * loop.displacement
        for axis, measured, fitted in (
            (whole, loop.force, loop.stiffness * place + loop.damping * speed),
            (bare, lag, loop.damping * speed),
        ):
            axis.plot(1e3 * loop.displacement, measured, ".", color=SOFT, markersize=1.5, rasterized=True)
            axis.plot(1e3 * place, fitted, color=ORANGE)
            axis.set_xlabel(label("displacement", "mm"))
        whole.set_ylabel(label("force", "N"))
        bare.set_ylabel(label("less k x", "N"))
        whole.set_title(f"{loop.name}: {loop.stiffness:.4g} N/m, {loop.damping:.4g} N s/m")
    return figure


@styled
def plot_impedances(rows: Sequence[RepeatedTests]) -> Figure:
    """Draw each row's tests, mean and interval, stiffness on the left and damping on the right."""
    figure, axes = panels(1, 2, height=0.9 + 0.28 * len(rows))
    places = np.arange(len(rows))
    names = [f"{row.joint}, {row.impedance}, {row.test}" for row in rows]
    for axis, name, unit in ((axes[0][0], "stiffness", "N/m"), (axes[0][1], "damping", "N s/m")):
        for place, row in zip(places, rows, strict=True):
            one: Repeated = getattr(row, name)
            axis.plot(one.values, np.full(one.values.size, place), ".", color=SOFT, markersize=3)
            axis.errorbar(one.mean, place, xerr=one.half_width, fmt="o", color=BLUE, markersize=4, capsize=3)
        axis.set_yticks(places, names if axis is axes[0][0] else [""] * len(rows))
        axis.invert_yaxis()
        axis.axvline(0.0, color=INK, linewidth=0.8)
        axis.set_xlabel(label(name, unit))
    return figure
