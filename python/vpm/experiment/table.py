"""A text table of numbers: read fast, and when that fails, read again to say where it is wrong."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import islice
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vpm.errors import ExperimentError, near_match

Array = NDArray[np.float64]

#: Separators that are looked for in the header.
DELIMITERS = (",", ";", "\t")

_ENCODING = "utf-8-sig"


@dataclass(frozen=True)
class Table:
    """Columns of a file.

    Attributes
    ----------
    header : tuple of str
        All column names.
    columns : dict of str to ndarray, shape (N,)
        Those that were asked for.
    lines : ndarray of int, shape (N,), or None
        Line of the file for each row, which counts from 1; None where a file has no lines.
    stamps : frozenset of str
        Columns that are times and so are in seconds already.
    clocks : dict of str to ndarray
        Times of the samples of a column that has a clock of its own, s; such columns differ in length.
    notes : tuple of str
        Sentences for the history of the record.
    """

    header: tuple[str, ...]
    columns: dict[str, Array]
    lines: NDArray[np.int64] | None
    stamps: frozenset[str] = frozenset()
    clocks: dict[str, Array] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


def read_header(path: str | PathLike[str]) -> tuple[tuple[str, ...], str]:
    """Column names and delimiter of a file.

    Raises
    ------
    ExperimentError
        The file does not exist, is no text, is empty, has no header, or names a column twice.
    """
    shown = str(path)
    lines = _first_lines(path, 1)
    if not lines or not lines[0].strip():
        raise _error(path, f"{shown} is empty; a log starts with a line of column names")
    delimiter = max(DELIMITERS, key=lines[0].count)
    header = tuple(cell.strip() for cell in next(csv.reader(lines, delimiter=delimiter)))
    if all(_is_number(cell) for cell in header):
        raise _error(
            path, f'{shown}, line 1 holds numbers ("{lines[0].strip()[:40]}"); put a line of column names above them'
        )
    for at, cell in enumerate(header):
        if not cell:
            raise _error(path, f"{shown}, line 1: column {at + 1} of {len(header)} has no name; give it one")
        if cell in header[:at]:
            raise _error(
                path,
                f'{shown}, line 1: the name "{cell}" stands over columns {header.index(cell) + 1} and {at + 1}; '
                "rename one of them",
            )
    return header, delimiter


def read_table(path: str | PathLike[str], wanted: Sequence[str] | None = None) -> Table:
    """Read columns of numbers.

    Parameters
    ----------
    path : path-like
        Text in UTF-8: a line of column names, then numbers with decimal points, separated by commas, semicolons or
        tabulators. Blank lines do not count.
    wanted : sequence of str, optional
        Columns to read; others may hold anything. All by default.

    Returns
    -------
    Table

    Raises
    ------
    ExperimentError
        As `read_header`, a column is missing, or a cell is no number (with its line, column and text).
    """
    header, delimiter = read_header(path)
    names = list(header if wanted is None else wanted)
    for name in names:
        if name not in header:
            raise missing_column(path, name, header)
    if not any(line.strip() for line in islice(_first_lines(path, 1000), 1, None)):
        raise _error(path, f"{path} has a line of column names but no rows; record at least ten samples")
    places = [header.index(name) for name in names]
    try:
        values = np.loadtxt(
            path,
            delimiter=delimiter,
            skiprows=1,
            usecols=places,
            ndmin=2,
            comments=None,
            quotechar='"',
            encoding=_ENCODING,
        )
    except (ValueError, UnicodeDecodeError) as error:
        problem = _diagnose(path, header, delimiter, places)
        raise problem or _error(path, f"{path} cannot be read as a table of numbers ({error})") from error
    lines = _line_numbers(path, header, delimiter, len(values))
    return Table(header, {name: values[:, at] for at, name in enumerate(names)}, lines)


def missing_column(path: str | PathLike[str], name: str, header: Sequence[str], channel: str = "") -> ExperimentError:
    """Error for a column that the file does not have."""
    use = f' for the channel "{channel}"' if channel else ""
    return _error(
        path,
        f'{path} has no column "{name}"{use}; {near_match(name, header, what="its columns are")}',
        channel=channel or None,
    )


def _first_lines(path: str | PathLike[str], count: int) -> list[str]:
    try:
        with Path(path).open(encoding=_ENCODING, newline="") as file:
            return list(islice(file, count))
    except FileNotFoundError as error:
        raise _error(path, f"{path} does not exist; check the name and the folder") from error
    except UnicodeDecodeError as error:
        raise _error(path, f"{path} is not a text file in UTF-8 (byte {error.start}); export the log as CSV") from error
    except OSError as error:
        raise _error(path, f"{path} cannot be read ({error.strerror}); give the path of a CSV file") from error


def _line_numbers(path: str | PathLike[str], header: Sequence[str], delimiter: str, rows: int) -> NDArray[np.int64]:
    """Line of each row, once every line is known to have as many cells as the header.

    Counting delimiters takes no time; only where the counts differ, as in a table with quoted cells, is every row read.
    """
    text = Path(path).read_bytes()
    letters = np.frombuffer(text if text.endswith(b"\n") else text + b"\n", dtype=np.uint8)
    ends = np.flatnonzero(letters == ord("\n"))
    seen = np.cumsum(letters == ord(delimiter))[ends]
    if ends.size == rows + 1 and np.all(np.diff(seen, prepend=0) == len(header) - 1):
        return np.arange(2, rows + 2, dtype=np.int64)
    problem = _diagnose(path, header, delimiter, ())
    if problem is not None:
        raise problem
    full = [at for at, line in enumerate(text.splitlines(), 1) if line.strip()]
    return np.array(full[1 : rows + 1], dtype=np.int64)


def _diagnose(
    path: str | PathLike[str], header: Sequence[str], delimiter: str, places: Sequence[int]
) -> ExperimentError | None:
    """Find the first row of the wrong length, or the first cell at `places` that is no number."""
    try:
        with Path(path).open(encoding=_ENCODING, newline="") as file:
            rows = csv.reader(file, delimiter=delimiter)
            for row in rows:
                if rows.line_num == 1 or not any(cell.strip() for cell in row):
                    continue
                problem = _row_problem(row, header, places)
                if problem:
                    return _error(path, f"{path}, line {rows.line_num}: {problem}")
    except (UnicodeDecodeError, csv.Error) as error:
        return _error(path, f"{path} is not a table in UTF-8 ({error}); export the log as CSV")
    return None


def _row_problem(row: Sequence[str], header: Sequence[str], places: Sequence[int]) -> str:
    if len(row) != len(header):
        return f"there are {len(row)} cells where the header names {len(header)} columns; repair or delete the row"
    for place in places:
        cell = row[place].strip()
        if not cell:
            return f'the cell of column "{header[place]}" is empty; fill it or delete the row'
        if not _is_number(cell):
            comma = _is_number(cell.replace(",", ".", 1))
            repair = "write decimal points" if comma else "write a number, or do not map this column"
            return f'"{cell}" in column "{header[place]}" is no number; {repair}'
    return ""


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return "_" not in cell  # Python reads 1_000, tables do not


def _error(path: str | PathLike[str], message: str, *, channel: str | None = None) -> ExperimentError:
    return ExperimentError(message, path=str(path), channel=channel)
