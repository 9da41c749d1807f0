"""A solid of finite elements as matrices, and what has to hold for them before they are reduced."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from vpm.errors import ReductionError
from vpm.numbers import Array

#: Sparse arrays of scipy, whose types say more than is needed here.
Matrix = Any
Tie = Literal["rigid", "averaged"]

#: Share by which matrices may miss what has to hold exactly: sums of many numbers, written with few digits.
ROUNDING = 1e-6
#: Fastest and slowest waves in solids, m/s, with room: beryllium has 1.3e4, soft rubber some tens.
FASTEST, SLOWEST = 2e4, 1.0


@dataclass(frozen=True, eq=False)
class Interface:
    """Nodes of a solid that are tied to a frame."""

    name: str
    nodes: NDArray[np.intp]
    #: One of "rigid", "averaged"; rigid: the nodes move with the frame (RBE2). Averaged: the frame moves as the nodes
    #: do on average, which stiffens nothing (RBE3).
    tie: Tie = "rigid"


@dataclass(frozen=True, eq=False)
class Structure:
    """Matrices of a solid with three displacements per node; number ``3 node + axis``, SI.

    Rotations of nodes, as shells and beams have them, follow all displacements.
    """

    stiffness: Matrix
    mass: Matrix
    nodes: Array  #: Places, shape (N, 3).
    interfaces: tuple[Interface, ...]  #: That of the root comes first.
    #: For two displacement fields, the nodal forces of the stress of their Green-Lagrange strain, ``sym(A_i^T A_j)``
    #: with the gradients A; without it nothing of second order is known of the solid.
    stretching: Callable[[Array, Array], Array] | None = field(default=None, repr=False)
    #: Numbers ``3 node + axis`` of the rotations, in their order.
    rotations: NDArray[np.intp] = field(default_factory=lambda: np.zeros(0, dtype=np.intp))
    #: What messages call the nodes; their numbers from 0 on if empty.
    labels: NDArray[np.intp] = field(default_factory=lambda: np.zeros(0, dtype=np.intp))

    @property
    def size(self) -> int:
        """Number of displacements and rotations of the structure."""
        return 3 * len(self.nodes) + self.rotations.size

    def label(self, node: int) -> int:
        """What messages call a node of the structure."""
        return int(self.labels[node]) if self.labels.size else node

    def describe(self, number: int) -> str:
        """What messages call a displacement or a rotation of the structure."""
        shift = number < 3 * len(self.nodes)
        place = number if shift else int(self.rotations[number - 3 * len(self.nodes)])
        return f"node {self.label(place // 3)}, {'' if shift else 'rotation about '}{'xyz'[place % 3]}"

    def turns(self, fields: Array) -> Array:
        """Rotations of all nodes in fields of the structure (size, n), shape (N, 3, n); zero where there are none."""
        found = np.zeros((3 * len(self.nodes), fields.shape[1]))
        found[self.rotations] = fields[3 * len(self.nodes) :]
        return found.reshape(len(self.nodes), 3, -1)

    @cached_property
    def rotary_inertia(self) -> Array:
        """Moments of inertia of the structure's nodes about themselves (kg m^2), shape (N, 3, 3)."""
        found, first = np.zeros((len(self.nodes), 3, 3)), 3 * len(self.nodes)
        coupled = sp.coo_array(self.mass[first:, first:])
        rows, columns = self.rotations[coupled.row], self.rotations[coupled.col]
        own = rows // 3 == columns // 3
        found[rows[own] // 3, rows[own] % 3, columns[own] % 3] = coupled.data[own]
        return found

    @cached_property
    def scalar_mass(self) -> Matrix:
        """Mass matrix of one displacement component of the structure."""
        return sp.csr_array((self._block(0, 0) + self._block(1, 1) + self._block(2, 2)) / 3.0)

    @property
    def total_mass(self) -> float:
        """Mass of the structure (kg)."""
        return float(self.scalar_mass.sum())

    @cached_property
    def centre(self) -> Array:
        """Centre of mass of the structure (m)."""
        ones = np.ones(len(self.nodes))
        return np.asarray(ones @ (self.scalar_mass @ self.nodes) / self.total_mass)

    @cached_property
    def places(self) -> Array:
        """Places of the structure's interface frames (m): the middle of their nodes."""
        return np.array([self.nodes[interface.nodes].mean(axis=0) for interface in self.interfaces])

    def _block(self, row: int, column: int) -> Matrix:
        shifts = 3 * len(self.nodes)
        return sp.csr_array(self.mass[row:shifts:3, column:shifts:3])

    def rigid_motions(self, centre: Array) -> Array:
        """Displacements and rotations of the structure by a small rigid motion about a point, shape (size, 6)."""
        turned = np.zeros((self.rotations.size, 6))
        turned[np.arange(self.rotations.size), self.rotations % 3] = 1.0
        return np.vstack([rigid_motions(self.nodes - centre), turned])


def rigid_motions(places: Array) -> Array:
    """Displacements of a structure's points by a small rigid motion, shape (3 N, 6)."""
    motions = np.zeros((len(places), 3, 6))
    x, y, z = places.T
    motions[:, 0, 1], motions[:, 0, 2] = z, -y
    motions[:, 1, 0], motions[:, 1, 2] = -z, x
    motions[:, 2, 0], motions[:, 2, 1] = y, -x
    motions[:, :, 3:] = np.eye(3)
    return motions.reshape(-1, 6)


def second_moments(inertia: Array) -> Array:
    """Second moments of mass of a structure's nodes from their moments of inertia, ``tr(J)/2 - J``."""
    return np.asarray(0.5 * np.trace(inertia, axis1=1, axis2=2)[:, None, None] * np.eye(3) - inertia)


def with_real_bodies(structure: Structure) -> Structure:
    """Structure whose rotary inertia is that of real bodies.

    Elements of bars often give a node a moment of inertia about their axis alone, which no body has. The least that is
    added makes a flat disc of it: half of that about each of the other axes, as the section of a bar has it.
    """
    if not structure.rotations.size:
        return structure
    inertia = structure.rotary_inertia
    moments, axes = np.linalg.eigh(second_moments(inertia))
    real = np.einsum("pia,pa,pja->pij", axes, moments.clip(0.0), axes)
    added = np.trace(real, axis1=1, axis2=2)[:, None, None] * np.eye(3) - real - inertia
    rows = np.repeat(structure.rotations // 3, 3)
    columns = 3 * rows + np.tile(np.arange(3), structure.rotations.size)
    places = np.searchsorted(structure.rotations, columns).clip(0, structure.rotations.size - 1)
    own = structure.rotations[places] == columns
    more = added[rows, np.repeat(structure.rotations % 3, 3), columns % 3]
    first = 3 * len(structure.nodes)
    at = (first + np.repeat(np.arange(structure.rotations.size), 3)[own], first + places[own])
    return replace(structure, mass=sp.csr_array(structure.mass + sp.coo_array((more[own], at), structure.mass.shape)))


def check_structure(structure: Structure) -> None:
    """Refuse matrices that are those of no structure."""
    n = structure.size
    for what in ("stiffness", "mass"):
        matrix: Matrix = getattr(structure, what)
        if matrix.shape != (n, n):
            raise ReductionError(
                f"the {what} matrix has {matrix.shape[0]} rows and {matrix.shape[1]} columns, but "
                f"{len(structure.nodes)} nodes with 3 displacements each need {n}; give the "
                "nodes of the matrix, and rotations with the labels of their nodes"
            )
        if not np.isfinite(matrix.data).all():
            raise ReductionError(f"the {what} matrix has numbers that are not finite; export it again")
        size = abs(matrix).max()
        skew = abs(matrix - matrix.T).max()
        if skew > ROUNDING * size:
            raise ReductionError(
                f"the {what} matrix is not symmetric: two entries differ by {skew:.3g}, its largest is {size:.3g}; "
                "export both triangles, or say that it is one with triangle = true"
            )
        least = matrix.diagonal().min()
        if least < 0.0 or (what == "stiffness" and least == 0.0):
            number = int(matrix.diagonal().argmin())
            raise ReductionError(
                f"the {what} matrix has {least:.3g} on its diagonal, at {structure.describe(number)}; "
                "it is not that of a free solid, so export it without constraints"
            )
    _check_mass(structure)
    _check_interfaces(structure)
    _check_rigid(structure)


def _check_mass(structure: Structure) -> None:
    """Refuse a structure whose mass differs by direction, or couples two of them."""
    scalar = structure.scalar_mass
    size = abs(scalar).max()
    worst = max(
        (abs(structure._block(i, j) - (scalar if i == j else 0.0 * scalar)).max(), i, j)  # noqa: SLF001
        for i in range(3)
        for j in range(3)
    )
    if worst[0] > ROUNDING * size:
        raise ReductionError(
            f"the mass matrix couples {'xyz'[worst[1]]} with {'xyz'[worst[2]]} by {worst[0] / size:.2g} of "
            "its largest entry, but mass is the same in all directions and couples none; check the order of the "
            "displacements: x, y and z node by node"
        )
    _check_rotary(structure)
    if not structure.total_mass > 0.0:
        raise ReductionError(f"the mass matrix sums up to {structure.total_mass:.3g} kg; it has to be above 0")


def _check_rotary(structure: Structure) -> None:
    """Refuse a structure whose rotations have an inertia that is not that of bodies on its nodes.

    In a large motion the products of a mass with places and displacements matter one by one, and matrices that couple
    rotations with displacements do not tell them.
    """
    first = 3 * len(structure.nodes)
    if not structure.rotations.size:
        return
    coupled = sp.coo_array(structure.mass[first:, :])
    node = structure.rotations[coupled.row] // 3
    beyond = coupled.col - first
    own = (beyond >= 0) & (structure.rotations[beyond.clip(0)] // 3 == node)
    shift = np.abs(coupled.data) > ROUNDING * np.sqrt(
        structure.mass.diagonal()[first + coupled.row] * structure.mass.diagonal()[coupled.col]
    )
    if (wrong := np.flatnonzero(~own & shift)).size:
        worst = wrong[0]
        raise ReductionError(
            f"the mass matrix couples {structure.describe(first + coupled.row[worst])}, with "
            f"{structure.describe(coupled.col[worst])}, as consistent matrices of beams and shells do; export lumped "
            "mass (Nastran: PARAM,COUPMASS,-1)"
        )


def _check_interfaces(structure: Structure) -> None:
    if len(structure.interfaces) < 2:
        raise ReductionError("the solid needs two interfaces, root and another one; name the nodes of both")
    taken: dict[int, str] = {}
    for interface in structure.interfaces:
        nodes, what = interface.nodes, f'interface "{interface.name}"'
        if nodes.size == 0:
            raise ReductionError(f"{what} has no nodes; check its places against the mesh, in m")
        if nodes.min() < 0 or nodes.max() >= len(structure.nodes):
            wrong = nodes.max() if nodes.min() >= 0 else nodes.min()
            raise ReductionError(
                f"{what} has the node {wrong}, but the nodes are numbered 0 to {len(structure.nodes) - 1}; correct it"
            )
        spread = np.linalg.svd(structure.nodes[nodes] - structure.nodes[nodes].mean(axis=0), compute_uv=False)
        holds = np.isin(3 * nodes[:, None] + np.arange(3), structure.rotations).all(axis=1).any()
        if not holds and (spread.size < 2 or spread[1] <= ROUNDING * spread[0] or spread[0] == 0.0):
            raise ReductionError(
                f"{what} has {nodes.size} nodes on one line, which hold no rotation about it; name nodes of a face, or "
                "a node with three rotations"
            )
        for node in nodes:
            if (other := taken.setdefault(int(node), interface.name)) != interface.name:
                raise ReductionError(
                    f'node {structure.label(int(node))} is part of the interfaces "{other}" and "{interface.name}"; '
                    "keep one"
                )


def _check_rigid(structure: Structure) -> None:
    """Refuse a structure in which rigid motions cost energy."""
    motions = structure.rigid_motions(structure.centre)
    names = (
        "rotation about x",
        "rotation about y",
        "rotation about z",
        "shift along x",
        "shift along y",
        "shift along z",
    )
    forces = structure.stiffness @ motions
    largest = abs(structure.stiffness) @ abs(motions)
    shares = np.linalg.norm(forces, axis=0) / np.linalg.norm(largest, axis=0)
    worst = int(shares.argmax())
    if shares[worst] > ROUNDING:
        raise ReductionError(
            f"the stiffness matrix resists the {names[worst]} by {shares[worst]:.2g} of its size, but a free solid "
            "resists no rigid motion; export it without supports, and check places and order of the nodes"
        )


def check_units(structure: Structure, slowest: float) -> None:
    """Refuse frequencies that no structure of this size has.

    A wave that runs along the solid in a quarter of its slowest period is slower than sound in it; bending waves of
    slender solids are slower by its slenderness.
    """
    size = float(np.linalg.norm(np.ptp(structure.nodes, axis=0)))
    speed = 4.0 * slowest * size
    if not SLOWEST * 1e-3 < speed < FASTEST:
        raise ReductionError(
            f"the slowest frequency {slowest:.4g} Hz of a solid {size:.4g} m large means waves of {speed:.3g} m/s, "
            'which no material carries; check the units, for example units = "mm-t-s" for N, mm and tonnes'
        )
