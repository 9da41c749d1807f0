"""A text table of numbers: read fast, and when that fails, read again to say where it is wrong."""

import csv
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vpm.errors import ExperimentError, near_match
from vpm.experiment.dates import is_date, seconds_of_dates
from vpm.experiment.dialect import Dialect, is_number, read_dialect
from vpm.numbers import Array


@dataclass(frozen=True)
class Table:
    """Columns of a text file of numbers."""

    header: tuple[str, ...]  #: All column names.
    columns: dict[str, Array]  #: Each of shape (N,); those that were asked for.
    #: Shape (N,); line of the file for each row, which counts from 1; None where a file has no lines.
    lines: NDArray[np.int64] | None
    stamps: frozenset[str] = frozenset()  #: Columns that are times and so are in seconds already.
    #: Times of the samples of a column that has a clock of its own, s; such columns differ in length.
    clocks: dict[str, Array] = field(default_factory=dict)
    notes: tuple[str, ...] = ()  #: Sentences for the history of the record.


def read_header(path: str | PathLike[str]) -> Dialect:
    """Names of the columns of a file, and how it writes its table."""
    dialect = read_dialect(path)
    header, where = dialect.header, f"{path}, line {dialect.named}"
    for at, cell in enumerate(header):
        if not cell:
            raise _error(path, f"{where}: column {at + 1} of {len(header)} has no name; give it one")
        if cell in header[:at]:
            raise _error(
                path,
                f'{where}: the name "{cell}" stands over columns {header.index(cell) + 1} and {at + 1}; '
                "rename one of them",
            )
    return dialect


def read_table(path: str | PathLike[str], dialect: Dialect, wanted: Sequence[str], clock: str) -> Table:
    """Read columns of numbers of a text file.

    - ``path``: text: a line of column names, then numbers. Blank lines do not count.
    - ``wanted``: columns to read; others may hold anything
    - ``clock``: column of the time among them: numbers, or dates

    Raises `ExperimentError`: a column is missing, or a cell is no number (with its line, column and text). A cell may
    be empty beside a clock: a column with such cells was sampled more slowly, or lost samples.
    """
    header = dialect.header
    for name in wanted:
        if name not in header:
            raise missing_column(path, name, header)
    if next(dialect.rows(path), None) is None:
        raise _error(path, f"{path} has a line of column names but no rows; record at least ten samples")
    places = [header.index(name) for name in wanted]
    try:
        values = _numbers(path, dialect, places)
    except (ValueError, UnicodeDecodeError) as error:
        problem = _diagnose(path, dialect, places, header.index(clock))
        if problem is not None:
            raise problem from error
        return _by_cells(path, dialect, wanted, clock)
    lines = _line_numbers(path, dialect, len(values))
    return Table(header, {name: values[:, at] for at, name in enumerate(wanted)}, lines)


def _by_cells(path: str | PathLike[str], dialect: Dialect, wanted: Sequence[str], clock: str) -> Table:
    """Text table with dates or empty cells, row by row.

    The clock of the record is that of the column with most samples. Columns with other rows have clocks of their own.
    """
    numbers, rows = zip(*dialect.rows(path), strict=True)
    lines = np.asarray(numbers, dtype=np.int64)
    cells = {name: [row[dialect.header.index(name)].strip() for row in rows] for name in wanted}
    dated = is_date(cells[clock][0])
    time = _dates(path, lines, cells[clock], clock) if dated else _floats(cells[clock], dialect)
    filled = {name: np.array([bool(cell) for cell in cells[name]]) for name in wanted if name != clock}
    for name, there in filled.items():
        if not there.any():
            raise _error(path, f'{path}: all cells of column "{name}" are empty; do not map it')
    base = max(filled.values(), key=np.count_nonzero, default=np.ones(len(rows), dtype=bool))
    columns = {clock: time[base]}
    clocks, notes = {}, []
    for name, there in filled.items():
        columns[name] = _floats([cell for cell in cells[name] if cell], dialect)
        if not np.array_equal(there, base):
            clocks[name] = time[there]
            notes.append(f'Column "{name}" has {np.count_nonzero(there)} numbers in {len(rows)} rows.')
    stamps = frozenset({clock} if dated else ())
    return Table(dialect.header, columns, lines[base], stamps, clocks, tuple(notes))


def _floats(cells: Sequence[str], dialect: Dialect) -> Array:
    """Numbers of cells of a text table."""
    return np.array([float(dialect.number(cell)) for cell in cells], dtype=np.float64)


def _dates(path: str | PathLike[str], lines: NDArray[np.int64], cells: Sequence[str], clock: str) -> Array:
    """Seconds of the dates of a text table."""
    try:
        return seconds_of_dates(cells)
    except ValueError as error:
        place, why = error.args
        told = f'{path}, line {lines[place]}: "{cells[place]}" in column "{clock}" {why}'
        raise _error(path, told, channel="time") from error


def _numbers(path: str | PathLike[str], dialect: Dialect, places: Sequence[int]) -> Array:
    """Columns of numbers of a text table, whose marks become those of Python."""
    source: str | PathLike[str] | Iterable[str] = path
    skipped = dialect.skipped
    if dialect.comma or dialect.group:
        if dialect.delimiter == ",":
            # Within quotes a comma is part of a number.
            source, skipped = (",".join(map(dialect.number, row)) for _, row in dialect.rows(path)), 0
        else:
            source = map(dialect.number, Path(path).read_text(encoding=dialect.encoding).splitlines())
    return np.loadtxt(
        source,
        delimiter=dialect.delimiter,
        skiprows=skipped,
        usecols=places,
        ndmin=2,
        comments=None,
        quotechar='"',
        encoding=dialect.encoding,
    )


def missing_column(path: str | PathLike[str], name: str, header: Sequence[str], channel: str = "") -> ExperimentError:
    """Error for a column that the text table does not have."""
    use = f' for the channel "{channel}"' if channel else ""
    return _error(
        path,
        f'{path} has no column "{name}"{use}; {near_match(name, header, what="its columns are")}',
        channel=channel or None,
    )


def _line_numbers(path: str | PathLike[str], dialect: Dialect, rows: int) -> NDArray[np.int64]:
    """Line numbers of a text table's rows, all with as many cells as the header.

    Counting delimiters takes no time; only where the counts differ, as in a table with quoted cells, is every row read.
    """
    text, first = Path(path).read_bytes(), dialect.skipped
    letters = np.frombuffer(text if text.endswith(b"\n") else text + b"\n", dtype=np.uint8)
    ends = np.flatnonzero(letters == ord("\n"))
    marks = np.flatnonzero(letters == ord(dialect.delimiter or " "))
    seen = np.diff(np.searchsorted(marks, ends), prepend=0)
    if dialect.delimiter and ends.size == rows + first and np.all(seen[first:] == len(dialect.header) - 1):
        return np.arange(first + 1, rows + first + 1, dtype=np.int64)
    problem = _diagnose(path, dialect, (), -1)
    if problem is not None:
        raise problem
    return np.fromiter((number for number, _ in dialect.rows(path)), dtype=np.int64)[:rows]


def _diagnose(path: str | PathLike[str], dialect: Dialect, places: Sequence[int], clock: int) -> ExperimentError | None:
    """Diagnose a text table: the first row of the wrong length, or the first cell with neither a number nor nothing."""
    try:
        for number, row in dialect.rows(path):
            problem = _row_problem(row, dialect, places, clock)
            if problem:
                return _error(path, f"{path}, line {number}: {problem}")
    except (UnicodeDecodeError, csv.Error) as error:
        return _error(path, f"{path} is not a table ({error}); export the log as CSV")
    return None


def _row_problem(row: Sequence[str], dialect: Dialect, places: Sequence[int], clock: int) -> str:
    header = dialect.header
    if len(row) != len(header):
        return f"there are {len(row)} cells where the header names {len(header)} columns; repair or delete the row"
    for place in places:
        cell = row[place].strip()
        if place != clock and not cell:
            continue
        if not cell:
            return f'the cell of column "{header[place]}" is empty; fill it or delete the row'
        if not is_number(dialect.number(cell)) and not (place == clock and is_date(cell)):
            comma = is_number(cell.replace(",", ".", 1))
            other = "or a date such as 2026-03-14 09:26:53.120" if place == clock else "or do not map this column"
            mixed = "numbers of this file have decimal points and commas; write one of them alone"
            repair = mixed if comma else f"write a number, {other}"
            return f'"{cell}" in column "{header[place]}" is no number; {repair}'
    return ""


def _error(path: str | PathLike[str], message: str, *, channel: str | None = None) -> ExperimentError:
    return ExperimentError(message, path=str(path), channel=channel)
