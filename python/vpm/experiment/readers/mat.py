"""MATLAB files: variables and fields of structures, by SciPy up to version 7.2 and by h5py for version 7.3."""

from collections.abc import Iterator, Mapping
from os import PathLike

import numpy as np
from numpy.typing import NDArray

from vpm.errors import ExperimentError
from vpm.experiment.readers.arrays import ArrayLog, shape_of_vector
from vpm.experiment.readers.base import Log
from vpm.experiment.readers.mat_tags import check_tags
from vpm.numbers import Array


def open_mat(path: str | PathLike[str]) -> Log:
    """Open the reader for a MATLAB (MAT) file of any version."""
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    check_tags(path)
    try:
        content = loadmat(path, simplify_cells=True)
    except NotImplementedError:  # version 7.3 is HDF5, and SciPy says so
        from vpm.experiment.readers.hdf5 import Hdf5Log

        return Hdf5Log(path, matlab=True)
    except (MatReadError, ValueError, TypeError, OSError, EOFError) as error:
        raise ExperimentError(
            f"{path} cannot be read as a MATLAB file ({str(error).splitlines()[0] if str(error) else 'it is empty'}); "
            "save it anew with save -v7 or -v7.3, or export the log as CSV",
            path=str(path),
        ) from error
    return MatLog(path, content)


class MatLog(ArrayLog):
    """Variables of a MATLAB file up to version 7.2: ``q``, ``log.q``, ``log.arm.q``."""

    def __init__(self, path: str | PathLike[str], content: Mapping[str, object]) -> None:
        self._arrays: dict[str, Array] = {}
        refused: dict[str, str] = {}
        for name, value in _leaves(content, ""):
            array = np.asarray(value)
            shape = shape_of_vector(array.shape)
            if array.dtype.kind not in "biuf":
                refused[name] = _reason(array)
            elif len(shape) not in {1, 2} or 0 in shape:
                size = " x ".join(map(str, shape)) or "a single number"
                refused[name] = f"has the size {size}; a column is a vector, or one column of a matrix"
            else:
                self._arrays[name] = array.astype(np.float64).reshape(shape)
        super().__init__(path, {name: array.shape for name, array in self._arrays.items()}, refused, {})

    def array(self, name: str) -> Array:
        """Numbers of a whole variable in a MAT file."""
        return self._arrays[name]


def _leaves(content: Mapping[str, object], prefix: str) -> Iterator[tuple[str, object]]:
    for name, value in content.items():
        if name.startswith("__"):
            continue
        if isinstance(value, Mapping):
            yield from _leaves(value, f"{prefix}{name}.")
        else:
            yield prefix + name, value


def _reason(array: NDArray[np.generic]) -> str:
    if array.dtype.kind in "US":
        return "holds text; name a variable of numbers"
    if array.dtype.kind == "c":
        return "holds complex numbers; save their real and imaginary parts as variables of their own"
    return (
        "holds a cell, an array of structures or an object such as a timetable; save its columns as plain variables, "
        "t = seconds(T.Time); q = T.q"
    )
