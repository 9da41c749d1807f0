"""HDF5 files, and through them MATLAB files of version 7.3: data sets by their path."""

from __future__ import annotations

from collections.abc import Iterator
from os import PathLike
from typing import TYPE_CHECKING

import numpy as np

from vpm.errors import needs
from vpm.experiment.readers.arrays import ArrayLog, shape_of_vector
from vpm.experiment.readers.base import reading
from vpm.numbers import Array

if TYPE_CHECKING:
    import h5py


#: Attributes of a data set that may name its unit.
UNIT_ATTRIBUTES = ("unit", "units")


class Hdf5Log(ArrayLog):
    """Data sets of an HDF5 file: ``group/dataset``, and ``group/table.field`` for tables of compound type.

    ``matlab``: the file was written by MATLAB 7.3: names are those of variables, ``log.q``, and arrays are stored
    transposed.
    """

    def __init__(self, path: str | PathLike[str], *, matlab: bool = False) -> None:
        self._matlab = matlab
        self._places: dict[str, tuple[str, str]] = {}
        shapes: dict[str, tuple[int, ...]] = {}
        refused: dict[str, str] = {}
        units: dict[str, str] = {}
        with _opened(path) as file:
            for place, data in _data_sets(file, ""):
                name = place.replace("/", ".") if matlab else place
                reason = _reason(data, matlab=matlab)
                if reason:
                    refused[name] = reason
                    continue
                fields = data.dtype.names or ("",)
                for field in fields:
                    column = f"{name}.{field}" if field else name
                    self._places[column] = (place, field)
                    shapes[column] = shape_of_vector(data.shape[::-1] if matlab else data.shape)
                    if unit := _unit(data):
                        units[column] = unit
        super().__init__(path, shapes, refused, units)
        stated = {column: units.get(column.partition("[")[0], "") for column in self.header}
        self.units = {column: unit for column, unit in stated.items() if unit}

    def find(self, column: str) -> str | None:
        """Name of a column in HDF5, whose path may begin with a stroke; see `Log.find`."""
        return super().find(column if self._matlab else column.lstrip("/"))

    def array(self, name: str) -> Array:
        """Numbers of a whole HDF5 data set."""
        place, field = self._places[name]
        with _opened(self.path) as file:
            data = file[place][field] if field else file[place][()]
        values = np.asarray(data, dtype=np.float64)
        return (values.T if self._matlab else values).reshape(self.shapes[name])


def _opened(path: str | PathLike[str]) -> h5py.File:
    with needs("h5py", "hdf5"):
        import h5py
    with reading(path, "an HDF5 file"):
        return h5py.File(path, "r")


def _data_sets(group: h5py.Group, prefix: str) -> Iterator[tuple[str, h5py.Dataset]]:
    import h5py

    for name in group:
        if name.startswith("#"):  # MATLAB keeps what cells and objects refer to under names like #refs#
            continue
        try:
            member = group[name]
        except KeyError:  # a link to a file that is not there
            continue
        if isinstance(member, h5py.Group):
            yield from _data_sets(member, f"{prefix}{name}/")
        elif isinstance(member, h5py.Dataset):
            yield f"{prefix}{name}", member


def _reason(data: h5py.Dataset, *, matlab: bool) -> str:
    """Why an HDF5 data set is no column of numbers, or ""."""
    kind = data.attrs.get("MATLAB_class", b"") if matlab else b""
    label = kind.decode() if isinstance(kind, bytes) else str(kind)
    names = data.dtype.names
    numeric = all(data.dtype[n].kind in "biuf" and not data.dtype[n].shape for n in names or ())
    if label in {"char", "cell", "string"} or not (numeric if names else data.dtype.kind in "biuf"):
        return f"holds {label or data.dtype}, which is no real number; store it as an array of doubles"
    shape = shape_of_vector(data.shape)
    if len(shape) not in {1, 2} or 0 in shape or (names and len(shape) != 1):
        size = " x ".join(map(str, data.shape)) or "a single number"
        return f"has the size {size}; a column is a vector, or one column of a matrix"
    return ""


def _unit(data: h5py.Dataset) -> str:
    for attribute in UNIT_ATTRIBUTES:
        value = data.attrs.get(attribute)
        if isinstance(value, bytes):
            return value.decode("utf-8", "replace")
        if isinstance(value, str):
            return value
    return ""
