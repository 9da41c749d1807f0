"""A witness of solids: a bar of bricks with 27 nodes, assembled by plain loops."""

from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

Array = NDArray[np.float64]

POINTS, WEIGHTS = np.polynomial.legendre.leggauss(3)


def _line(t: float) -> tuple[Array, Array]:
    """Quadratic functions of the nodes -1, 0, 1 and their slopes."""
    values = np.array([0.5 * t * (t - 1.0), 1.0 - t * t, 0.5 * t * (t + 1.0)])
    return values, np.array([t - 0.5, -2.0 * t, t + 0.5])


def bricks(
    size: tuple[float, float, float], counts: tuple[int, int, int], young: float, poisson: float, density: float
) -> tuple[Any, Any, Array]:
    """Stiffness, mass and nodes of a bar along z with its root in the plane z = 0."""
    first = young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson))
    shear = 0.5 * young / (1.0 + poisson)
    law = np.diag([2.0 * shear] * 3 + [shear] * 3)
    law[:3, :3] += first
    half = 0.5 * np.array(size) / counts
    stiffness, mass = np.zeros((81, 81)), np.zeros((27, 27))
    for gauss in product(range(3), repeat=3):
        lines = [_line(POINTS[k]) for k in gauss]
        (x, dx), (y, dy), (z, dz) = lines
        weight = np.prod(WEIGHTS[list(gauss)]) * half.prod()
        value = np.einsum("i,j,k->ijk", x, y, z).ravel()
        slopes = [np.einsum("i,j,k->ijk", *parts).ravel() for parts in ((dx, y, z), (x, dy, z), (x, y, dz))]
        gx, gy, gz = (slope / h for slope, h in zip(slopes, half, strict=True))
        strain = np.zeros((6, 27, 3))
        strain[0, :, 0], strain[1, :, 1], strain[2, :, 2] = gx, gy, gz
        strain[3, :, 1], strain[3, :, 2] = gz, gy
        strain[4, :, 0], strain[4, :, 2] = gz, gx
        strain[5, :, 0], strain[5, :, 1] = gy, gx
        b = strain.reshape(6, 81)
        stiffness += weight * b.T @ law @ b
        mass += weight * density * np.outer(value, value)
    grid = [2 * count + 1 for count in counts]
    number = np.arange(np.prod(grid)).reshape(grid)
    places = np.stack(np.meshgrid(*(np.arange(n) for n in grid), indexing="ij"), axis=-1).reshape(-1, 3) * half
    places[:, :2] -= 0.5 * np.array(size[:2])
    n = number.size
    k, m = np.zeros((3 * n, 3 * n)), np.zeros((n, n))
    for a, b_, c in product(*(range(count) for count in counts)):
        own = number[2 * a : 2 * a + 3, 2 * b_ : 2 * b_ + 3, 2 * c : 2 * c + 3].ravel()
        dofs = (3 * own[:, None] + np.arange(3)).ravel()
        k[np.ix_(dofs, dofs)] += stiffness
        m[np.ix_(own, own)] += mass
    return sp.csr_array(k), sp.csr_array(np.kron(m, np.eye(3))), places


def write_archive(path: Path, stiffness: Any, mass: Any, nodes: Array, **interfaces: NDArray[np.intp]) -> Path:
    """Everything in one file, as docs/reduced_links.md has it."""
    parts = {
        f"{name}_{part}": getattr(matrix, part)
        for name, matrix in (("stiffness", stiffness), ("mass", mass))
        for part in ("data", "indices", "indptr")
    }
    faces = {f"interface_{name}": numbers for name, numbers in interfaces.items()}
    np.savez_compressed(path, nodes=nodes, **parts, **faces)  # type: ignore[arg-type]
    return path


def bar_archive(path: Path, counts: tuple[int, int, int] = (1, 1, 4)) -> Path:
    """A steel bar, 0.4 m long, 20 mm by 10 mm, held at z = 0."""
    k, m, nodes = bricks((0.02, 0.01, 0.4), counts, 206e9, 0.3, 7850.0)
    faces = {name: np.flatnonzero(np.abs(nodes[:, 2] - at) < 1e-9) for name, at in (("root", 0.0), ("tip", 0.4))}
    return write_archive(path, k, m, nodes, **faces)
