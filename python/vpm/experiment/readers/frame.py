"""Data frames that a program holds already: of pandas, polars, or anything with columns that NumPy takes."""

from collections.abc import Hashable, Iterable, Sequence
from contextlib import suppress
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from vpm.experiment.readers.base import Log
from vpm.experiment.table import Table
from vpm.numbers import Array


class Frame(Protocol):
    """Table with columns by name, such as a pandas one, as `FrameLog` reads it."""

    @property
    def columns(self) -> Iterable[Hashable]:
        """Names of a data frame's columns."""

    def __getitem__(self, column: Hashable, /) -> object:
        """Column of a data frame by its name, one value per row."""


class FrameLog(Log):
    """Columns of a data frame, and its index by its name; names of several levels are joined by points.

    Times of day and spans are told in seconds from the first of their column. Missing values are NaN.

    Raises `ExperimentError`: it has no columns, or one of its names twice.
    """

    bracketed_units = True

    def __init__(self, frame: Frame, name: str) -> None:
        super().__init__(name)
        columns, index = list(getattr(frame, "columns", ())), getattr(frame, "index", None)
        if not columns:
            raise self.error(f"{name} is a {type(frame).__name__} without columns; give a data frame with named ones")
        self._columns: dict[str, NDArray[Any]] = {}
        own = getattr(index, "name", None)
        given = [] if own is None else [(_name(own), _array(index))]
        # A frame gives all columns of a name that it has twice; those are refused before they are used.
        given += [(_name(column), _array(frame[column])) for column in columns]
        for column, array in given:
            if column in self._columns or column in self.refused:
                raise self.error(f'{name} has two columns named "{column}"; rename one of them')
            if array.ndim == 1 and array.dtype.kind in "biufmM":
                self._columns[column] = array
            else:
                self.refused[column] = f"holds {array.dtype}, which is no number; name a column of numbers"
        self.header = tuple(self._columns)

    def _read(self, columns: Sequence[str], clock: str) -> Table:  # noqa: ARG002
        """Columns of a data frame by name; see `Log.read`."""
        stamps = frozenset(column for column in columns if self._columns[column].dtype.kind in "mM")
        found = {column: self._seconds(column) if column in stamps else self._numbers(column) for column in columns}
        return Table(self.header, found, None, stamps=stamps)

    def _numbers(self, column: str) -> Array:
        return np.asarray(self._columns[column], dtype=np.float64)

    def _seconds(self, column: str) -> Array:
        """Seconds of a data frame's dates; differences first, in whole ticks, for the resolution."""
        ticks = self._columns[column]
        if missing := int(np.count_nonzero(np.isnat(ticks))):
            raise self.error(f'{self.path}: {missing} times of the column "{column}" are missing; fill them')
        return np.asarray((ticks - ticks[:1]) / np.timedelta64(1, "ns"), dtype=np.float64) * 1e-9


def _name(column: object) -> str:
    return ".".join(str(level) for level in column if level != "") if isinstance(column, tuple) else str(column)


def _array(values: object) -> NDArray[Any]:
    """Values of a data frame's column; numbers of which some are missing come as objects."""
    array, converted = np.asarray(values), getattr(values, "to_numpy", None)
    if array.dtype.kind == "O" and converted is not None:
        with suppress(TypeError, ValueError):
            return np.asarray(converted(dtype=np.float64, na_value=np.nan))
    return array
