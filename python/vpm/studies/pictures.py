"""Pictures of studies: curves, and fields on meshes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vpm.numbers import Array
from vpm.plot.style import INK, STAGES, label, panels, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Name, abscissae, ordinates, and how it is drawn ("-", "--", "o", "o-").
Curve = tuple[str, ArrayLike, ArrayLike, str]


@styled
def curves(
    title: str, x: tuple[str, str], y: tuple[str, str], lines: Sequence[Curve], *, logarithmic: bool = False
) -> Figure:
    """Picture of curves over one axis.

    ``x``, ``y``: quantity and unit; ``logarithmic``: both axes.
    """
    figure, ((axes,),) = panels(1, height=3.4)
    for number, (name, across, up, mark) in enumerate(lines):
        axes.plot(np.asarray(across), np.asarray(up), mark, color=STAGES[1:][number % (len(STAGES) - 1)], label=name)
    if logarithmic:
        axes.set(xscale="log", yscale="log")
    axes.set(title=title, xlabel=label(*x), ylabel=label(*y))
    axes.legend()
    return figure


@styled
def field(
    title: str, unit: str, corners: Array, faces: NDArray[np.int64], values: Array, axes: tuple[str, str]
) -> Figure:
    """Picture of values on the faces of a mesh in a plane.

    - ``corners``: shape (2, N), mm
    - ``faces``: shape (4, M), corners of each quadrilateral, in turn
    - ``values``: shape (M,)
    - ``axes``: names of the two directions
    """
    from matplotlib.collections import PolyCollection

    figure, ((picture,),) = panels(1, height=4.6, width=7.0)
    shapes = PolyCollection(list(corners.T[faces.T]), array=values, cmap="viridis", edgecolor=INK, linewidth=0.1)
    picture.add_collection(shapes)
    picture.autoscale_view()
    picture.grid(visible=False)
    picture.set(aspect="equal", title=title, xlabel=label(axes[0], "mm"), ylabel=label(axes[1], "mm"))
    figure.colorbar(shapes, ax=picture, label=label("", unit).strip())
    return figure
