"""Stiffness and mass matrices from files of finite element programs."""

from pathlib import Path

import numpy as np
import scipy.io
import scipy.sparse as sp

from vpm.errors import ReductionError, VpmError
from vpm.model.beams.reduced import read_bytes
from vpm.numbers import Array
from vpm.reduction.structure import Matrix


def read_matrix(path: Path, *, triangle: bool = False) -> Matrix:
    """Read a sparse matrix of finite elements from a file.

    - ``path``: MatrixMarket (``.mtx``), ``.npz`` of `scipy.sparse.save_npz`, ``.npy``, or lines ``row column value``
      from 1 on, as Abaqus (``FORMAT=COORDINATE``) and CalculiX (``.sti``, ``.mas``) write them
    - ``triangle``: only one triangle of a symmetric matrix is in the file
    """
    try:
        matrix = _read(path)
    except VpmError as error:
        raise ReductionError(str(error)) from None
    except (ValueError, TypeError, KeyError, OSError, EOFError, MemoryError, OverflowError, StopIteration) as error:
        raise ReductionError(f"{path} is no matrix ({str(error)[:80]}); export it as MatrixMarket") from None
    except Exception as error:  # damaged archives  # noqa: BLE001
        raise ReductionError(f"{path} is damaged ({type(error).__name__}); export it again") from None
    if matrix.ndim != 2 or matrix.dtype.kind not in "fiu":
        raise ReductionError(f"{path} holds no matrix of real numbers; export one")
    full = sp.csr_array(matrix).astype(np.float64)
    return sp.csr_array(full + full.T - sp.diags_array(full.diagonal())) if triangle else full


def _read(path: Path) -> Matrix:
    content = read_bytes(path)
    match path.suffix.lower():
        case ".npz":
            return sp.load_npz(path)
        case ".npy":
            return np.load(path, allow_pickle=False)
    if content.startswith(b"%%MatrixMarket"):
        return scipy.io.mmread(path)
    rows = np.loadtxt(path, comments=("#", "*", "%"), ndmin=2)
    if rows.shape[1] != 3 or rows[:, :2].min() < 1.0:
        raise ReductionError(f"{path} has {rows.shape[1]} numbers in a line; row, column and value from 1 on are read")
    places = rows[:, :2].astype(np.intp) - 1
    size = int(places.max()) + 1
    if size > 10 * len(rows):
        raise ReductionError(f"{path} has a place {size} in {len(rows)} lines; write row, column and value")
    return sp.coo_array((rows[:, 2], (places[:, 0], places[:, 1])), shape=(size, size))


def read_nodes(path: Path) -> Array:
    """Node places beside the matrices from a text file, or an ``.npy``, of three numbers each."""
    try:
        _ = read_bytes(path)
        if path.suffix.lower() == ".npy":
            nodes = np.load(path, allow_pickle=False)
        else:
            lines = path.read_text(encoding="utf-8", errors="replace").replace(",", " ").splitlines()
            nodes = np.loadtxt(lines, comments=("#", "*", "%"), ndmin=2)
    except VpmError as error:
        raise ReductionError(str(error)) from None
    except (ValueError, TypeError, OSError, EOFError, MemoryError) as error:
        raise ReductionError(f"{path} is no list of nodes ({str(error)[:80]}); write x, y and z in lines") from None
    if nodes.ndim != 2 or nodes.shape[1] not in (3, 4) or nodes.dtype.kind not in "fiu" or not np.isfinite(nodes).all():
        raise ReductionError(f"{path} has the shape {nodes.shape}; write x, y and z of each node in a line")
    return np.asarray(nodes[:, -3:], dtype=np.float64)
