"""One look for all pictures: thin lines, few marks, colours that colour-blind eyes tell apart."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import wraps
from io import StringIO
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

import numpy as np
from numpy.typing import NDArray

from vpm.errors import MissingExtraError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

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
    "axes.formatter.use_mathtext": True,
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

#: Points that a line keeps; the rest cannot be seen and would only make files large.
MOST_POINTS = 4000


@contextmanager
def _style() -> Iterator[None]:
    try:
        from matplotlib.style import context
    except ImportError as error:
        raise MissingExtraError("matplotlib", "plot") from error
    with context(dict(_STYLE)):
        yield


def styled(draw: Callable[P, R]) -> Callable[P, R]:
    """Draw with this module's style, and say which extra is missing where matplotlib is not there."""

    @wraps(draw)
    def inner(*args: P.args, **kwargs: P.kwargs) -> R:
        with _style():
            return draw(*args, **kwargs)

    return inner


def panels(
    rows: int, columns: int = 1, *, height: float = 2.2, width: float = 8.0, share_x: bool = False
) -> tuple[Figure, list[list[Axes]]]:
    """Figure with a grid of axes; no window opens, and nothing has to be closed.

    Parameters
    ----------
    rows, columns : int
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
def figure_to_svg(figure: Figure) -> str:
    """SVG of a figure, as an element to put into an HTML page.

    Figures that are made alike give the same text. Letters are drawn as shapes, so that they look alike everywhere.

    Parameters
    ----------
    figure : Figure

    Returns
    -------
    str
        ``<svg ...> ... </svg>`` without the XML declaration; names inside are told apart from those of other figures.
    """
    buffer = StringIO()
    figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    text = buffer.getvalue()
    svg = text[text.index("<svg") :].strip()
    mark = f"f{_checksum(svg):08x}-"
    svg = re.sub(r'\bid="', f'id="{mark}', svg)
    return re.sub(r'(url\(#|href="#)', lambda match: match.group(1) + mark, svg)


def thinned(time: Array, *columns: Array) -> tuple[Array, ...]:
    """Fewer points that still show every peak: the least and the largest of each stretch of the first column.

    Parameters
    ----------
    time : ndarray, shape (N,)
    *columns : ndarray, shape (N,)
        Thinned alike, each stretch at the extremes of each of the columns.
    """
    if time.size <= MOST_POINTS or not columns:
        return (time, *columns)
    stretch = -(-2 * len(columns) * time.size // MOST_POINTS)
    whole = time.size // stretch * stretch
    base = np.arange(0, whole, stretch)
    picks = []
    for column in columns:
        blocks = column[:whole].reshape(-1, stretch)
        picks += [base + np.argmin(blocks, axis=1), base + np.argmax(blocks, axis=1)]
    keep = np.unique(np.concatenate([*picks, np.arange(whole, time.size)]))
    return (time[keep], *(column[keep] for column in columns))


def label(quantity: str, unit: str) -> str:
    """``position [m]``; no brackets for a pure number."""
    return f"{quantity} [{unit}]" if unit not in {"", "1"} else quantity


def _checksum(text: str) -> int:
    from zlib import crc32

    return crc32(text.encode())
