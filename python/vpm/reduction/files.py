"""What `vpm reduce` reads: the description of a solid, or matrices with their nodes."""

import tomllib
from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from pydantic import Field, ValidationError

from vpm.errors import ReductionError, VpmError
from vpm.model.beams.reduced import read_bytes
from vpm.model.entry import Entry, Number, Switch, Text, Vector
from vpm.numbers import Array
from vpm.reduction.craig_bampton import Reduction, reduce_structure
from vpm.reduction.labelled import COMPONENTS, Labelled, read_labelled, read_labelled_nodes
from vpm.reduction.matrices import read_matrix, read_nodes
from vpm.reduction.solid import box_mesh, read_mesh, solid
from vpm.reduction.structure import Interface, Matrix, Structure, Tie

_Positive = Annotated[Number, Field(gt=0.0)]
_Count = Annotated[int, Field(strict=True, ge=1, le=1000)]

#: Units of matrices: SI units of force per length, mass, and length.
UNITS = {"SI": (1.0, 1.0, 1.0), "mm-t-s": (1e3, 1e3, 1e-3), "mm-kg-ms": (1e6, 1.0, 1e-3)}
#: How far from its plane a node may be, as a share of the size of the solid.
_NEAR = 1e-6
#: Share by which the mass may miss the one that is given.
_MASS = 0.01


class _Box(Entry):
    size: Vector
    elements: Annotated[tuple[_Count, ...], Field(min_length=3, max_length=3)]


class _Solid(Entry):
    box: _Box | None = None
    mesh: Text | None = None
    unit: Literal["m", "mm", "cm", "in"] = "m"
    young: _Positive
    poisson: Annotated[Number, Field(gt=-1.0, lt=0.5)] = 0.3
    density: _Positive
    mass: _Positive | None = None


class _Matrices(Entry):
    stiffness: Text
    mass_matrix: Text
    nodes: Text
    units: Literal["SI", "mm-t-s", "mm-kg-ms"] = "SI"
    triangle: Switch = False
    mass: _Positive | None = None


class _Interface(Entry):
    plane: dict[Literal["x", "y", "z"], Number] | None = None
    box: Annotated[tuple[Vector, ...], Field(min_length=2, max_length=2)] | None = None
    nodes: tuple[Annotated[int, Field(strict=True)], ...] | None = None
    tie: Tie = "rigid"


class _File(Entry):
    solid: _Solid | None = None
    matrices: _Matrices | None = None
    interfaces: dict[str, _Interface]


_SCALES = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "in": 0.0254}


def reduce(path: str | PathLike[str], modes: int = 8) -> Reduction:
    """Reduce a solid to a flexible link of a model file.

    Parameters
    ----------
    path : path-like
        TOML file of a solid or of matrices, or an ``.npz`` with ``stiffness``, ``mass``, ``nodes`` and the numbers of
        the nodes of each interface, ``interface_root`` first (docs/reduced_links.md).
    modes : int
        How many of the slowest modes to keep, with the root held.

    Returns
    -------
    Reduction
        ``reduction.link.save("link.npz")`` writes what a model file names.

    Raises
    ------
    ReductionError
        The file cannot be read, or its matrices are those of no solid.

    Examples
    --------
    >>> reduction = vpm.reduce("examples/reduced_link/bar.toml", modes=6)
    """
    return reduce_structure(read_structure(path), modes)


def read_structure(path: str | PathLike[str]) -> Structure:
    """Matrices of what a file describes."""
    path = Path(path)
    if path.suffix.lower() == ".npz":
        return _from_archive(path)
    try:
        content = tomllib.loads(read_bytes(path).decode("utf-8-sig"))
        file = _File.model_validate(content)
    except VpmError as error:
        raise ReductionError(str(error)) from None
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise ReductionError(f"{path} is no TOML file: {error}; describe a [solid] or [matrices]") from None
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(map(str, first["loc"])) or "the file"
        raise ReductionError(
            f"{path}: {where} is wrong: {first['msg'].lower()}; docs/reduced_links.md lists the keys"
        ) from None
    if file.solid is not None and file.matrices is None:
        structure, given = _of_solid(file, file.solid, path)
    elif file.matrices is not None and file.solid is None:
        structure, given = _of_matrices(file, file.matrices, path)
    else:
        raise ReductionError(f"{path} needs one of the tables [solid] and [matrices]; add one, or remove one")
    if given is not None and abs(structure.total_mass / given - 1.0) > _MASS:
        raise ReductionError(
            f"{path}: the solid weighs {structure.total_mass:.5g} kg, but mass is {given:.5g} kg, so "
            f"{structure.total_mass / given:.3g} times that; check density and units"
        )
    return structure


def _of_solid(file: _File, entry: _Solid, path: Path) -> tuple[Structure, float | None]:
    if (entry.box is None) == (entry.mesh is None):
        raise ReductionError(f"{path}: solid needs one of box and mesh; add one, or remove one")
    if entry.box is not None:
        if not min(entry.box.size) > 0.0:
            raise ReductionError(f"{path}: solid.box.size is {entry.box.size}, but has to be above 0; correct it")
        mesh = box_mesh(entry.box.size, entry.box.elements)
    else:
        mesh = read_mesh(path.parent / str(entry.mesh), _SCALES[entry.unit])
    material = {"young": entry.young, "poisson": entry.poisson, "density": entry.density}
    return solid(mesh, lambda nodes: _interfaces(file, nodes, path), **material), entry.mass


def _of_matrices(file: _File, entry: _Matrices, path: Path) -> tuple[Structure, float | None]:
    folder, (stiffness, mass, length) = path.parent, UNITS[entry.units]
    labelled = [
        read_labelled(folder / name, initial)
        for name, initial in ((entry.stiffness, "K"), (entry.mass_matrix, "M"))
        if Path(name).suffix.lower() not in (".npz", ".npy")
    ]
    if labelled and all(each is not None for each in labelled):
        own = [each for each in labelled if each is not None]
        return _of_labels(file, entry, own, path), entry.mass
    nodes = read_nodes(folder / entry.nodes) * length
    matrices = [read_matrix(folder / name, triangle=entry.triangle) for name in (entry.stiffness, entry.mass_matrix)]
    return Structure(matrices[0] * stiffness, matrices[1] * mass, nodes, _interfaces(file, nodes, path)), entry.mass


def _of_labels(file: _File, entry: _Matrices, matrices: list[Labelled], path: Path) -> Structure:
    """Files with labels as matrices of all displacements, then all rotations that stiffness or mass act on."""
    stiffness, mass, length = UNITS[entry.units]
    known = read_labelled_nodes(path.parent / entry.nodes)
    given = np.unique(np.concatenate([matrix.places for matrix in matrices]))
    labels = np.unique(given // COMPONENTS)
    if lacking := [label for label in labels.tolist() if label not in known]:
        raise ReductionError(
            f"{path}: {entry.nodes} does not have the node {lacking[0]} of the matrices, nor {len(lacking) - 1} "
            "others; give the places of all"
        )
    turns = given[given % COMPONENTS >= 3]
    shifts = (COMPONENTS * labels[:, None] + np.arange(3)).ravel()
    places = np.sort(np.concatenate([shifts, turns]))
    order = np.searchsorted(places, np.concatenate([shifts, turns]))
    # Of a rotation: a moment per turn, and a moment of inertia.
    scale = sp.diags_array(np.repeat([1.0, length], [shifts.size, turns.size]))
    full = [scale @ matrix.on(places)[order][:, order] @ scale for matrix in matrices]
    nodes = length * np.array([known[label] for label in labels.tolist()]).reshape(-1, 3)
    rotations = 3 * np.searchsorted(labels, turns // COMPONENTS) + turns % COMPONENTS - 3
    return Structure(
        sp.csr_array(stiffness * full[0]),
        sp.csr_array(mass * full[1]),
        nodes,
        _interfaces(file, nodes, path, labels),
        rotations=np.asarray(rotations, dtype=np.intp),
        labels=np.asarray(labels, dtype=np.intp),
    )


def _interfaces(
    file: _File, nodes: Array, path: Path, labels: NDArray[np.int64] | None = None
) -> tuple[Interface, ...]:
    found = []
    for name, entry in file.interfaces.items():
        ways = [way for way in (entry.plane, entry.box, entry.nodes) if way is not None]
        if len(ways) != 1:
            raise ReductionError(
                f"{path}: interfaces.{name} needs one of plane, box and nodes; add one, or remove others"
            )
        chosen = _chosen(entry, nodes)
        if labels is not None and entry.nodes is not None:
            if (unknown := np.setdiff1d(chosen, labels)).size:
                raise ReductionError(
                    f"{path}: interfaces.{name} has the node {unknown[0]}, which no matrix has; correct it"
                )
            chosen = np.searchsorted(labels, chosen)
        found.append(Interface(name, chosen, entry.tie))
    return tuple(found)


def _chosen(entry: _Interface, nodes: Array) -> NDArray[np.intp]:
    if entry.nodes is not None:
        return np.array(sorted(set(entry.nodes)), dtype=np.intp)
    near = _NEAR * float(np.linalg.norm(np.ptp(nodes, axis=0)))
    inside = np.ones(len(nodes), dtype=bool)
    if entry.plane is not None:
        for axis, at in entry.plane.items():
            inside &= np.abs(nodes[:, "xyz".index(axis)] - at) <= near
    if entry.box is not None:
        low, high = np.sort(np.array(entry.box), axis=0)
        inside &= ((nodes >= low - near) & (nodes <= high + near)).all(axis=1)
    return np.flatnonzero(inside)


def _from_archive(path: Path) -> Structure:
    """Files of a solid in one ``.npz``; sparse matrices in CSR."""

    def matrix(stored: Mapping[str, Matrix], name: str) -> Matrix:
        if name in stored:
            return sp.csr_array(np.asarray(stored[name], dtype=np.float64))
        parts = tuple(stored[f"{name}_{part}"] for part in ("data", "indices", "indptr"))
        size = parts[2].size - 1
        built = sp.csr_array(parts, shape=(size, size), dtype=np.float64)
        built.check_format(full_check=True)
        return built

    try:
        _ = read_bytes(path)
        with np.load(path, allow_pickle=False) as stored:
            nodes = np.asarray(stored["nodes"], dtype=np.float64)
            if nodes.ndim != 2 or nodes.shape[1] != 3:
                raise ReductionError(
                    f"{path}: nodes has the shape {nodes.shape}, but x, y and z of each node are needed"
                )
            names = [name for name in stored if name.startswith("interface_")]
            interfaces = tuple(
                Interface(name.removeprefix("interface_"), np.unique(np.asarray(stored[name]).astype(np.intp)))
                for name in names
            )
            return Structure(matrix(stored, "stiffness"), matrix(stored, "mass"), nodes, interfaces)
    except ReductionError:
        raise
    except KeyError as error:
        missing = str(error.args[0]).split()[0]
        raise ReductionError(
            f"{path} has no {missing}; write stiffness, mass, nodes, interface_root and interface_tip"
        ) from None
    except Exception as error:  # damaged archives  # noqa: BLE001
        raise ReductionError(
            f"{path} cannot be read ({str(error)[:80] or type(error).__name__}); write it again"
        ) from None
