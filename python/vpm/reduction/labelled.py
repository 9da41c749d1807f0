"""Labelled matrices: entries by labels of nodes and components, as Nastran and Abaqus write them.

Nastran punches ``DMIG`` cards, in fields of 8 or 16 characters or between commas. Abaqus writes lines ``node,
component, node, component, entry`` (``*MATRIX OUTPUT, FORMAT=MATRIX INPUT``). Components 1 to 3 are displacements, 4 to
6 rotations.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from vpm.errors import ReductionError, refused_as
from vpm.model.beams.reduced import read_bytes
from vpm.numbers import Array
from vpm.reduction.structure import Matrix

#: Components of a node, and the highest label that programs give.
COMPONENTS, HIGHEST = 6, 2**40
#: Fields of a card in small, free and large format: how many, and how wide.
_SMALL, _LARGE = (8, 8), (4, 16)
#: An exponent that a card writes without its letter, as in ``1.5+7``.
_BARE = re.compile(r"(?<=[\d.])([+-]\d+)$")


@dataclass(frozen=True, eq=False)
class Labelled:
    """Labelled matrix: its entries, by ``6 label + component - 1``."""

    rows: NDArray[np.int64]
    columns: NDArray[np.int64]
    entries: Array

    @property
    def places(self) -> NDArray[np.int64]:
        """Rows of a labelled matrix that are not zero throughout, in order."""
        kept = self.entries != 0.0
        return np.unique(np.concatenate([self.rows[kept], self.columns[kept]]))

    def on(self, places: NDArray[np.int64]) -> Matrix:
        """Labelled matrix as a sparse one, with rows and columns in the order of these places."""
        kept = self.entries != 0.0
        where = [np.searchsorted(places, each[kept]) for each in (self.rows, self.columns)]
        return sp.csr_array((self.entries[kept], where), shape=(places.size, places.size))


def read_labelled(path: Path, initial: str) -> Labelled | None:
    """Read a labelled matrix, or None where a file has no labels.

    ``initial``: letter with which the name of the matrix begins, where a file holds several: K or M.
    """
    text = _text(path)
    if re.search(r"^DMIG[*, ]", text, re.MULTILINE):
        return _of_cards(text, path, initial)
    first = next((line for line in text.splitlines() if _is_data(line)), "")
    return _of_lines(text, path) if len(first.replace(",", " ").split()) == 5 else None


def read_labelled_nodes(path: Path) -> dict[int, tuple[float, float, float]]:
    """Places of nodes by their labels: GRID cards, the *NODE lines of an input file, or lines ``label x y z``."""
    text = _text(path)
    found: dict[int, tuple[float, float, float]] = {}
    turned: list[str] = []
    try:
        if re.search(r"^GRID[*, ]", text, re.MULTILINE):
            for fields in _cards(text, "GRID"):
                label, frame, x, y, z, own = (fields + [""] * 6)[:6]
                if any(_integer(each) for each in (frame, own)):
                    turned.append(label)
                found[int(label)] = _number(x), _number(y), _number(z)
        inside = not re.search(r"^\*NODE\b", text, re.MULTILINE | re.IGNORECASE)
        for line in [] if found else text.splitlines():
            if line.startswith("*") and not line.startswith("**"):
                inside = bool(re.match(r"\*NODE\s*(,|$)", line, re.IGNORECASE))
            elif inside and _is_data(line):
                label, x, y, z = line.replace(",", " ").split()
                found[int(label)] = float(x), float(y), float(z)
        if not np.isfinite(list(found.values())).all():
            raise ValueError("not finite")
    except ValueError:
        raise ReductionError(
            f"{path} is no list of nodes with labels; write GRID cards, *NODE lines, or label, x, y and z in a line"
        ) from None
    if turned:
        raise ReductionError(
            f"{path}: GRID {turned[0]} has a coordinate system of its own; export places and displacements in the "
            "basic one"
        )
    return found


def _text(path: Path) -> str:
    with refused_as(ReductionError):
        return read_bytes(path).decode("utf-8", errors="replace")


def _is_data(line: str) -> bool:
    return bool(line.strip()) and line.lstrip()[0] not in "*#%$"


# ---- Abaqus ----------------------------------------------------------------------------------------------------------


def _of_lines(text: str, path: Path) -> Labelled:
    """Labelled matrix of lines with two nodes, two components and an entry."""
    lines = [line.replace(",", " ") for line in text.splitlines() if _is_data(line)]
    try:
        table = np.loadtxt(lines, ndmin=2)
    except ValueError as error:
        raise ReductionError(
            f"{path} is no matrix ({str(error)[:80]}); write node, component, twice, and entry"
        ) from None
    given = table[:, :4]
    if not (np.isfinite(given).all() and (given == np.rint(given)).all() and np.abs(given).max() <= HIGHEST):
        raise ReductionError(f"{path} has labels that are no whole numbers; write node, component, twice, and entry")
    numbers = given.astype(np.int64)
    rows, columns = (_places(numbers[:, at], numbers[:, at + 1], path) for at in (0, 2))
    return _whole(Labelled(rows, columns, table[:, 4]), path, triangle=True)


def _places(labels: NDArray[np.int64], components: NDArray[np.int64], path: Path) -> NDArray[np.int64]:
    """Places of a labelled matrix from labels and components."""
    wrong = (components < 1) | (components > COMPONENTS) | (labels < 1) | (labels > HIGHEST)
    if wrong.any():
        at = int(np.argmax(wrong))
        raise ReductionError(
            f"{path} has component {components[at]} of node {labels[at]}, but nodes have components 1 to {COMPONENTS}; "
            "export the matrices of nodes alone, without modal coordinates, multipliers and temperatures"
        )
    return np.asarray(COMPONENTS * labels + components - 1)


def _whole(matrix: Labelled, path: Path, *, triangle: bool) -> Labelled:
    """Labelled matrix with both triangles, of which one may be left out if ``triangle``."""
    if not np.isfinite(matrix.entries).all():
        raise ReductionError(f"{path} has entries that are not finite; export it again")
    places, numbers = np.unique(np.stack([matrix.rows, matrix.columns]), return_inverse=True)
    row, column = numbers.reshape(2, -1)
    given = row * places.size + column
    if np.unique(given).size < given.size:
        raise ReductionError(f"{path} gives an entry twice; export it again")
    if not triangle:
        return matrix
    lacking = (row != column) & ~np.isin(column * places.size + row, given)
    return Labelled(
        np.concatenate([matrix.rows, matrix.columns[lacking]]),
        np.concatenate([matrix.columns, matrix.rows[lacking]]),
        np.concatenate([matrix.entries, matrix.entries[lacking]]),
    )


# ---- Nastran ---------------------------------------------------------------------------------------------------------


def _of_cards(text: str, path: Path, initial: str) -> Labelled:
    """Labelled matrix of DMIG cards: a header, and a card for each column.

    A header has the form (1 square, 6 symmetric), the precision (1 and 2 real, 3 and 4 complex). A column has its node
    and component, an empty field, and then node, component, real and imaginary part of each of its entries.
    """
    headers: dict[str, list[str]] = {}
    columns: dict[str, list[list[str]]] = {}
    for name, *fields in _cards(text, "DMIG"):
        if fields[:1] == ["0"]:
            headers[name] = fields
        else:
            columns.setdefault(name, []).append(fields)
    own = [name for name in headers if name.startswith(initial)] if len(headers) > 1 else list(headers)
    if len(own) != 1:
        raise ReductionError(
            f"{path} holds the matrices {', '.join(sorted({*headers, *columns}))}, of which one name has to begin with "
            f"{initial}; leave one"
        )
    (name,) = own
    form, precision = (headers[name] + ["", "", ""])[1:3]
    if form not in ("1", "6") or precision not in ("1", "2"):
        raise ReductionError(
            f"{path}: {name} has form {form} and type {precision}, but a square (1) or symmetric (6) real matrix "
            "(1 or 2) is needed; export one"
        )
    labels: list[tuple[int, int, int, int]] = []
    entries: list[float] = []
    try:
        for node, component, _, *rest in columns.get(name, []):
            at = _integer(node), _integer(component)
            for begin in range(0, len(rest) - 2, 4):
                row, own_component, entry = rest[begin : begin + 3]
                if row or entry:
                    labels.append((_integer(row), _integer(own_component), *at))
                    entries.append(_number(entry))
    except ValueError as error:
        raise ReductionError(
            f"{path}: a card DMIG {name} cannot be read ({str(error)[:80]}); export it again"
        ) from None
    numbers = np.array(labels, dtype=np.int64).reshape(-1, 4)
    rows, at_columns = (_places(numbers[:, at], numbers[:, at + 1], path) for at in (0, 2))
    return _whole(Labelled(rows, at_columns, np.array(entries)), path, triangle=form == "6")


def _cards(text: str, name: str) -> Iterator[list[str]]:
    """Fields of all cards of one name in a text of Nastran, those of continuations behind them."""
    fields: list[str] | None = None
    for line in text.splitlines():
        if not line.strip() or line.startswith("$"):
            continue
        begins = bool(re.match(rf"{name}[*, ]", line))
        if not begins and (fields is None or line[0] not in "*+, "):
            if fields is not None:
                yield fields
            fields = None
            continue
        if begins:
            if fields is not None:
                yield fields
            fields = []
        assert fields is not None  # noqa: S101  # a continuation has a card before it
        fields += _fields(line)
    if fields is not None:
        yield fields


def _fields(line: str) -> Sequence[str]:
    """Fields of one line of a card but the first, which has its name, and the last, which marks continuations."""
    if "," in line:
        parts = [part.strip() for part in line.split(",")][1:9]
        return parts + [""] * (-len(parts) % 4)
    count, width = _LARGE if "*" in line[:8] else _SMALL
    return [line[8 + width * at : 8 + width * (at + 1)].strip() for at in range(count)]


def _number(text: str) -> float:
    """Number of a field of a card; D begins an exponent too, and may be left out."""
    return float(_BARE.sub(r"e\1", text.upper().replace("D", "E"))) if text else 0.0


def _integer(text: str) -> int:
    """Whole number of a field of a card, 0 if empty."""
    number = int(text) if text else 0
    if abs(number) > HIGHEST:
        raise ValueError(f"{text} is no label")
    return number
