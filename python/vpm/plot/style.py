"""One look for all pictures: thin lines, few marks, colours that colour-blind eyes tell apart."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import wraps
from html import escape
from io import StringIO
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from vpm.errors import needs
from vpm.numbers import Array

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure
    from matplotlib.projections.polar import _AxisWrapper
    from matplotlib.ticker import _DummyAxis


P = ParamSpec("P")
R = TypeVar("R")

#: M. Okabe and K. Ito, "Color Universal Design", 2008, in the order in which they are used.
BLUE, ORANGE, GREEN, PURPLE, SKY = "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9"
INK, SOFT, LINE = "#1b2430", "#5d6b7a", "#c9d1db"

#: Colours of the stages of a diagnosis, dull to bright.
STAGES = (SOFT, ORANGE, BLUE, GREEN, PURPLE, SKY)

_STYLE: Mapping[str, Any] = {
    "text.parse_math": False,  # a dollar in a name of the user is a dollar
    "axes.axisbelow": True,
    "axes.edgecolor": SOFT,
    "axes.grid": True,
    "axes.labelcolor": INK,
    "axes.labelsize": 9,
    "axes.linewidth": 0.8,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titlesize": 10,
    "axes.titlecolor": INK,
    "axes.formatter.limits": (-3, 4),
    "axes.formatter.useoffset": False,
    "axes.formatter.use_mathtext": False,  # no formula is parsed, so none may be written
    "figure.dpi": 110,
    "figure.facecolor": "white",
    "font.size": 9,
    "grid.color": LINE,
    "grid.linewidth": 0.5,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "lines.linewidth": 1.2,
    "path.simplify": True,
    "path.simplify_threshold": 0.5,
    "svg.fonttype": "path",
    "svg.hashsalt": "vpm",
    "text.color": INK,
    "xtick.color": SOFT,
    "ytick.color": SOFT,
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
}

_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")

#: Points that a line keeps, two for each of as many strips as a wide picture tells apart: the rest makes files large.
MOST_POINTS = 1200
#: Resolution of clouds of points, dots per inch.
RASTER = 110


@contextmanager
def _style() -> Iterator[None]:
    with needs("matplotlib", "plot"):
        from matplotlib.style import context
    with context(dict(_STYLE)):
        yield


def styled(draw: Callable[P, R]) -> Callable[P, R]:
    """Draw with this module's style, and say which extra is missing where matplotlib is not there."""

    @wraps(draw)
    def inner(*args: P.args, **kwargs: P.kwargs) -> R:
        with _style():
            from matplotlib.figure import Figure

            result = draw(*args, **kwargs)
            if isinstance(result, Figure):
                _write_powers(result)
            return result

    return inner


def _write_powers(figure: Figure) -> None:
    """Powers of ten at logarithmic axes as letters, ``2×10⁻³``: matplotlib writes them as formulas, which stay raw."""
    from matplotlib.ticker import Formatter, LogFormatterSciNotation

    class Powers(Formatter):
        def __init__(self, inner: LogFormatterSciNotation, *, between: bool) -> None:
            self.inner, self.between = inner, between

        def set_axis(self, axis: Axis | _DummyAxis | _AxisWrapper | None) -> None:
            super().set_axis(axis)
            self.inner.set_axis(axis)

        def set_locs(self, locs: list[float]) -> None:
            self.inner.set_locs(locs)

        def __call__(self, x: float, pos: int | None = None) -> str:
            text = plain_power(self.inner(x, pos))
            return "" if self.between and "×" in text and text[0] not in "25" else text  # more would overlap

    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            if isinstance(major := axis.get_major_formatter(), LogFormatterSciNotation):
                axis.set_major_formatter(Powers(major, between=False))
            if isinstance(minor := axis.get_minor_formatter(), LogFormatterSciNotation):
                axis.set_minor_formatter(Powers(minor, between=True))


def plain_power(formula: str) -> str:
    r"""``2×10⁻³`` from ``$\mathdefault{2\times10^{-3}}$``."""
    inside = re.sub(r"\$\\mathdefault\{(.*)\}\$", r"\1", formula).replace(r"\times", "×")
    return re.sub(r"\^\{([^}]*)\}", lambda power: power[1].replace("−", "-").translate(_RAISED), inside)


def panels(
    rows: int, columns: int = 1, *, height: float = 2.2, width: float = 8.0, share_x: bool = False
) -> tuple[Figure, list[list[Axes]]]:
    """Figure in the common style with a grid of axes; no window opens.

    Parameters
    ----------
    height : float
        Of one row, inches.
    width : float
        Of the whole, inches.
    share_x : bool
        One time axis under all rows.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height * rows + 0.5), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False, sharex="col" if share_x else "none")
    return figure, [list(row) for row in axes]


@styled
def figure_to_svg(figure: Figure, words: str = "") -> str:
    """SVG of a figure in the common style, as an element to put into an HTML page.

    Figures that are made alike give the same text. Letters are drawn as shapes, so that they look alike everywhere; on
    a page, where there are words beside them, they are letters, which takes a third of the room.

    ``words``: what is to be seen, for those who do not see it.
    Result: ``<svg ...> ... </svg>`` without the XML declaration; names inside are told apart from those of other
    figures.
    """
    from matplotlib import rc_context

    buffer = StringIO()
    nobody = dict.fromkeys(("Date", "Creator", "Format", "Type"))
    with rc_context({"svg.fonttype": "none"} if words else {}):
        figure.savefig(buffer, format="svg", metadata=nobody, dpi=RASTER)
    text = buffer.getvalue()
    svg = text[text.index("<svg") :].strip()
    # A hundredth of a point is a hundredth of what anybody sees.
    svg = re.sub(r'(?<= )(d|x|y)="[^"]*"', lambda place: re.sub(r"\d+\.\d{3,}", _hundredths, place[0]), svg)
    mark = f"f{crc32(svg.encode()):08x}-"
    svg = re.sub(r'\bid="', f'id="{mark}', svg)
    svg = re.sub(r'(url\(#|href="#)', lambda match: match.group(1) + mark, svg)
    return svg.replace("<svg", f'<svg role="img" aria-label="{escape(words)}"', 1) if words else svg


def thinned(time: Array, *columns: Array) -> tuple[Array, ...]:
    """Thinned points in the common style: the least and the largest of each stretch.

    - ``time``: shape (N,)
    - ``*columns``: shape (N,), thinned alike, each stretch at the extremes of each of the columns; a gap, NaN, stays
      one
    """
    if time.size <= MOST_POINTS or not columns:
        return (time, *columns)
    stretch = -(-2 * len(columns) * time.size // MOST_POINTS)
    whole = time.size // stretch * stretch
    picks = [np.array([0, time.size - 1])]
    for column in columns:
        picks += [*_extremes(column[:whole], stretch, 0), *_extremes(column[whole:], time.size - whole, whole)]
    keep = np.unique(np.concatenate(picks))
    return (time[keep], *(column[keep] for column in columns))


def _extremes(column: Array, stretch: int, first: int) -> Iterator[NDArray[np.int64]]:
    """Places of the least and the largest value of each stretch and of its first gap, counted from ``first`` on."""
    if not column.size:
        return
    blocks = column.reshape(-1, stretch)
    base, gaps = first + stretch * np.arange(len(blocks)), np.isnan(blocks)
    for sign in (1.0, -1.0):
        yield base + np.argmin(np.where(gaps, np.inf, sign * blocks), axis=1)
    yield (base + np.argmax(gaps, axis=1))[gaps.any(axis=1)]


def legend_above(axis: Axes, columns: int, handles: Sequence[Artist] | None = None) -> None:
    """Legend in the common style above axes, where it hides nothing: of their lines at the right, else at the left."""
    if handles is None:
        axis.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=columns, borderaxespad=0.2)
    else:
        axis.legend(handles=handles, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=columns, borderaxespad=0.2)


def label(quantity: str, unit: str) -> str:
    """Label in the common style: ``position [m]``; no brackets for a pure number."""
    return f"{quantity} [{unit}]" if unit not in {"", "1"} else quantity


def _hundredths(number: re.Match[str]) -> str:
    return f"{float(number[0]):.2f}".rstrip("0").rstrip(".")
