"""Pictures of closed linkages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from vpm.numbers import Array
from vpm.plot.style import BLUE, GREEN, INK, ORANGE, panels, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@styled
def plot_limbs(elbows: Array, tips: Array, names: Sequence[str]) -> Figure:
    """Draw linkages with two bodies as lines from the origin.

    ``elbows``, ``tips``: shape (N, 2), in m.
    """
    figure, [[axes]] = panels(1, height=4.5, width=6.0)
    for elbow, tip, name in zip(elbows, tips, names, strict=True):
        axes.plot([0.0, elbow[0], tip[0]], [0.0, elbow[1], tip[1]], marker="o", markersize=3, label=name)
    axes.plot(0.0, 0.0, "s", color=INK)
    axes.set(aspect="equal", xlabel="x [m]", ylabel="y [m]")
    figure.legend(loc="outside right upper", title="q1, q2")
    return figure


@styled
def plot_stroke_workspace(
    strokes: tuple[Array, Array], angles: Array, tips: Array, transmission: Array, singular: Sequence[Array]
) -> Figure:
    """Draw a linkage's reach by two strokes, and its angles and transmission to the singular strokes.

    - ``strokes``: shape (N,) and (M,), in m
    - ``angles``, ``tips``, ``transmission``: shape (N, M, 2), in rad, m and rad/m
    - ``singular``: singular strokes of each actuator (m)
    """
    figure, rows = panels(1, 3, height=3.6, width=13.0)
    reach, turn, ratio = rows[0]
    # Lines of one constant stroke each, so that the borders of the reach are seen.
    reach.plot(tips[::4, :, 0].T, tips[::4, :, 1].T, color=BLUE, linewidth=0.6)
    reach.plot(tips[:, ::4, 0], tips[:, ::4, 1], color=ORANGE, linewidth=0.6)
    reach.plot(0.0, 0.0, "s", color=INK)
    reach.set(aspect="equal", xlabel="x [m]", ylabel="y [m]", title="end point, lines of constant stroke")
    for k, colour in enumerate((BLUE, ORANGE)):
        # Each angle depends on its own stroke alone.
        pick = (slice(None), _filled(angles[..., 0].T)) if k == 0 else (_filled(angles[..., 1]), slice(None))
        turn.plot(strokes[k], np.degrees(np.unwrap(angles[pick][..., k])), color=colour, label=f"joint {k + 1}")
        ratio.plot(strokes[k], transmission[pick][..., k], color=colour, label=f"joint {k + 1}")
        near = singular[k][(singular[k] > strokes[k].min() - 0.02) & (singular[k] < strokes[k].max() + 0.02)]
        for axes in (turn, ratio):
            for stroke in near:
                axes.axvline(stroke, color=colour, linestyle=":", linewidth=1.0)
    turn.set_title("joint angle [deg]; dotted: singular strokes")
    ratio.set_title("transmission [rad/m]")
    ratio.set_ylim(-150.0, 150.0)
    for axes in (turn, ratio):
        axes.set_xlabel("stroke [m]")
    turn.legend()
    return figure


def _filled(table: Array) -> int:
    """Row with the most numbers."""
    return int(np.isfinite(table).sum(axis=1).argmax())


@styled
def plot_strokes(angles: Array, strokes: Array, levers: Array, names: Sequence[str]) -> Figure:
    """Draw lengths and lever arms of a linkage's cylinders over joint angles.

    ``angles``, ``strokes``, ``levers``: shape (N, K), in rad, m and m/rad.
    """
    figure, rows = panels(2, len(names), width=9.0, share_x=True)
    for k, name in enumerate(names):
        degrees = np.degrees(angles[:, k])
        rows[0][k].plot(degrees, strokes[:, k], color=BLUE)
        rows[1][k].plot(degrees, levers[:, k], color=GREEN)
        rows[0][k].set(title=f"{name} cylinder", ylabel="length [m]")
        rows[1][k].set(ylabel="lever arm [m/rad]", xlabel=f"{name} angle [deg]")
    return figure


@styled
def plot_shares(first: Array, second: Array, maps: Mapping[str, Array], title: str) -> Figure:
    """Draw shares of the effort in a linkage over two joint angles.

    ``first``, ``second``: shape (R,) and (C,), joint angles (rad); ``maps``: each of shape (R, C), fractions.
    """
    figure, rows = panels(1, len(maps), height=3.4, width=12.0)
    for axes, (name, table) in zip(rows[0], maps.items(), strict=True):
        mesh = axes.pcolormesh(np.degrees(second), np.degrees(first), 100.0 * table, shading="nearest", cmap="viridis")
        mesh.set_clim(0.0, max(100.0, float(np.nanpercentile(100.0 * table, 95))))
        axes.grid(visible=False)
        axes.set(title=f"{name}: {100.0 * table.mean():.2f} % on average", xlabel="knee angle [deg]")
    rows[0][0].set_ylabel("hip angle [deg]")
    figure.colorbar(mesh, ax=rows[0], label="largest share [%]", shrink=0.9)
    figure.suptitle(title, fontsize=11, x=0.01, ha="left")
    return figure
