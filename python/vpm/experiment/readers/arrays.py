"""Files of named arrays, vectors and matrices of two dimensions: how a column of one is written and read."""

import re
from abc import abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from os import PathLike

import numpy as np

from vpm.experiment.readers.base import Log
from vpm.experiment.table import Table
from vpm.numbers import Array

#: ``name[:, 2]``, ``name[2, :]`` and ``name.2``; indices count from zero.
_COLUMN = re.compile(r"^(?P<name>.+?)\s*(?:\[\s*:\s*,\s*(?P<index>\d+)\s*\]|\.(?P<short>\d+))$")
_ROW = re.compile(r"^(?P<name>.+?)\s*\[\s*(?P<index>\d+)\s*,\s*:\s*\]$")

#: Matrices with more columns than this are taken for tables or pictures, and their columns are not listed one by one.
MOST_COLUMNS = 64


class ArrayLog(Log):
    """A log in a file of arrays, such as MAT or HDF5.

    - ``shapes``: each array of numbers; a vector has one dimension, also where the file stores it as a row or a column
    - ``refused``, ``units``: as in `Log`
    """

    def __init__(
        self,
        path: str | PathLike[str],
        shapes: Mapping[str, tuple[int, ...]],
        refused: Mapping[str, str],
        units: dict[str, str],
    ) -> None:
        super().__init__(path)
        self.shapes = shapes
        self.header = tuple(name for array in shapes for name in _names(array, shapes[array]))
        matrices = {array: _which(array, shape) for array, shape in shapes.items() if len(shape) > 1}
        self.refused = {**refused, **matrices}
        self.units = units

    def find(self, column: str) -> str | None:
        """Name of a column in arrays; see `Log.find`."""
        place = self._place(column)
        if place is None:
            return None
        array, row, index = place
        if index is None:
            return array
        return f"{array}[{index}, :]" if row else f"{array}[:, {index}]"

    def _read(self, columns: Sequence[str], clock: str) -> Table:
        """Columns of a file of arrays by name; see `Log.read`."""
        found = {column: self._values(column) for column in columns}
        expected = found[clock].size
        for column, values in found.items():
            if values.size != expected:
                raise self.error(
                    f'{self.path}: the column "{column}" has {values.size} values and the clock "{clock}" {expected}; '
                    "map columns that were sampled together, and load the others as a record of their own"
                )
        return Table(self.header, found, None)

    @abstractmethod
    def array(self, name: str) -> Array:
        """Numbers of a whole array, of the shape in `shapes`."""

    def _values(self, column: str) -> Array:
        place = self._place(column)
        if place is None:
            raise self.missing(column)
        array, row, index = place
        whole = self.array(array)
        if index is None:
            return whole
        return np.ascontiguousarray(whole[index] if row else whole[:, index])

    def _place(self, column: str) -> tuple[str, bool, int | None] | None:
        """Array, whether a row of it is meant, and the index of the row or column; None where there is none such."""
        if len(self.shapes.get(column, ())) == 1:
            return column, False, None
        for pattern, row in ((_COLUMN, False), (_ROW, True)):
            match = pattern.match(column)
            if match is None:
                continue
            name = match["name"]
            shape = self.shapes.get(name, ())
            index = int(match["index"] or match.groupdict().get("short") or 0)
            if len(shape) == 1 and index == 0 and not row:
                return name, False, None
            if len(shape) == 2 and index < shape[0 if row else 1]:
                return name, row, index
        return None


def shape_of_vector(shape: tuple[int, ...]) -> tuple[int, ...]:
    """Shape of an array without dimensions of one sample where a vector remains."""
    long = tuple(size for size in shape if size != 1)
    return long if len(long) == 1 else shape


def _names(array: str, shape: tuple[int, ...]) -> Iterator[str]:
    if len(shape) == 1:
        yield array
    elif shape[1] <= shape[0]:
        yield from (f"{array}[:, {index}]" for index in range(min(shape[1], MOST_COLUMNS)))
    else:  # more columns than rows: samples run along the rows
        yield from (f"{array}[{index}, :]" for index in range(min(shape[0], MOST_COLUMNS)))


def _which(array: str, shape: tuple[int, ...]) -> str:
    first, last = (f"{array}[:, 0]", f"{array}[:, {shape[1] - 1}]")
    if shape[1] > shape[0]:
        first, last = (f"{array}[0, :]", f"{array}[{shape[0] - 1}, :]")
    return f"is a matrix of {shape[0]} x {shape[1]}; name one column of it, from {first} to {last}"
