"""A solid whose interfaces are tied to frames, and what is solved with some of the frames held."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import scipy.linalg
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from numpy.typing import NDArray

from vpm.errors import ReductionError
from vpm.numbers import Array
from vpm.reduction.structure import Interface, Matrix, Structure, rigid_motions

#: Masses up to which their flexibility is a matrix.
_FEW = 300
#: Share of the largest flexibility below which one is rounding.
_FLEXIBLE = 1e-12


class Tied:
    """A solid whose interfaces are tied to frames: rigid ties are eliminated, averages stand as rows beside.

    The unknowns are the displacements of all other nodes and the motions of rigidly tied frames.
    """

    def __init__(self, structure: Structure) -> None:
        self.structure = structure
        places = zip(structure.interfaces, structure.places, strict=True)
        #: Nodes of each interface from its frame.
        self.arms = [structure.nodes[interface.nodes] - place for interface, place in places]
        self.tie = self._ties()
        # A rigid tie is averaged to what it was: one row serves both kinds.
        self.rows: list[Matrix] = [
            sp.csr_array(self._average(interface, arms).T @ self.tie)
            for interface, arms in zip(structure.interfaces, self.arms, strict=True)
        ]
        self.stiffness = sp.csr_array(self.tie.T @ structure.stiffness @ self.tie)
        self.mass = sp.csr_array(self.tie.T @ structure.mass @ self.tie)

    def _rotations(self, nodes: NDArray[np.intp]) -> NDArray[np.intp]:
        """Places of the rotations of some nodes of the tied solid among all of its rotations."""
        return np.flatnonzero(np.isin(self.structure.rotations // 3, nodes))

    def _average(self, interface: Interface, arms: Array) -> Matrix:
        """What the nodes of an interface of the tied solid add to the motion of its frame, shape (size, 6).

        Displacements tell it where nodes of a face do; a node alone, or nodes on a line, by rotations too.
        """
        shifts, structure = rigid_motions(arms), self.structure
        if np.linalg.matrix_rank(shifts) == shifts.shape[1]:
            return _at(np.linalg.pinv(shifts).astype(np.float64).T, interface.nodes, structure.size)
        turns = self._rotations(interface.nodes)
        motions = np.vstack([shifts, np.eye(6)[structure.rotations[turns] % 3]])
        numbers = np.concatenate([_numbers(interface.nodes), 3 * len(structure.nodes) + turns])
        return _in_rows(np.linalg.pinv(motions).astype(np.float64).T, numbers, structure.size)

    def _ties(self) -> Matrix:
        """Displacements of all nodes of the tied solid per unit of each unknown."""
        interfaces, count, size = self.structure.interfaces, len(self.structure.nodes), self.structure.size
        rigid = [(i.nodes, arms) for i, arms in zip(interfaces, self.arms, strict=True) if i.tie == "rigid"]
        free = np.setdiff1d(np.arange(count), np.concatenate([np.array([], dtype=np.intp), *(own for own, _ in rigid)]))
        if free.size == 0:
            raise ReductionError("all nodes are tied rigidly to frames, so nothing can deform; name fewer nodes")
        dofs = np.concatenate([_numbers(free), 3 * count + self._rotations(free)])
        alone = sp.csr_array((np.ones(dofs.size), (dofs, np.arange(dofs.size))), shape=(size, dofs.size))
        return sp.csr_array(sp.hstack([alone, *(self._rigid(own, arms) for own, arms in rigid)]))

    def _rigid(self, nodes: NDArray[np.intp], arms: Array) -> Matrix:
        """Displacements and rotations of some nodes of the tied solid per unit of the motion of their frame."""
        structure, turns = self.structure, self._rotations(nodes)
        about = np.eye(6)[structure.rotations[turns] % 3]
        return _at(rigid_motions(arms), nodes, structure.size) + _in_rows(
            about, 3 * len(structure.nodes) + turns, structure.size
        )

    @property
    def size(self) -> int:
        """Number of unknowns of a solid that is tied to its interfaces."""
        return int(self.stiffness.shape[0])

    @cached_property
    def free(self) -> Held:
        """Factorised stiffness of the tied solid held at the root alone."""
        return Held(self.stiffness, self.rows[:1])

    @cached_property
    def fixed(self) -> Held:
        """Factorised stiffness of the tied solid held at all interfaces."""
        return Held(self.stiffness, self.rows)

    def constraint_modes(self) -> Array:
        """Constraint modes of the tied solid: unit motion of each interface but the root."""
        motions = 6 * len(self.rows)
        return self.fixed.solve(np.zeros((self.size, motions - 6)), np.eye(motions)[:, 6:])

    def fixed_modes(self, count: int) -> Array:
        """Slowest modes of the tied solid with all interfaces held."""
        return slowest(self.fixed, self.mass, count)[1]

    def free_frequencies(self, count: int) -> Array:
        """Slowest frequencies of the tied solid with the root held (Hz)."""
        return np.sqrt(slowest(self.free, self.mass, count)[0]) / (2.0 * np.pi)

    def compliance(self) -> Array:
        """Compliance of the tied solid: motions of interfaces under unit loads on them."""
        rows = sp.csr_array(sp.vstack(self.rows[1:]))
        loads = rows.T.toarray()
        return np.asarray(rows @ self.free.solve(loads, np.zeros((6, loads.shape[1]))))

    def nodal(self, shapes: Array) -> Array:
        """Displacements, then rotations, of all nodes of the tied solid, shape (size, n)."""
        return np.asarray(self.tie @ shapes)

    def frames(self, shapes: Array) -> Array:
        """Motions of the tied solid's interfaces but the root, shape (m, 6, n)."""
        return np.array([row @ shapes for row in self.rows[1:]])


class Held:
    """A stiffness with some motions held: solved again and again by one factorisation."""

    def __init__(self, stiffness: Matrix, rows: list[Matrix]) -> None:
        self.n = int(stiffness.shape[0])
        held = sp.csr_array(sp.vstack(rows))
        self.scale = float(stiffness.diagonal().mean())
        block = sp.csc_array(sp.block_array([[stiffness, self.scale * held.T], [self.scale * held, None]]))
        try:
            self.factors = spla.splu(block, permc_spec="MMD_AT_PLUS_A")
        except RuntimeError:
            raise ReductionError(
                "the stiffness matrix is singular with the interfaces held: parts of it hang on nothing; join them"
            ) from None

    def solve(self, loads: Array, motions: Array) -> Array:
        """Deflections of the tied solid under loads (columns) at given motions of what is held."""
        return np.asarray(self.factors.solve(np.vstack([loads, self.scale * motions]))[: self.n])

    def under(self, load: Array) -> Array:
        """Deflection of the tied solid under one load, what is held at rest."""
        padded = np.zeros(self.factors.shape[0])
        padded[: self.n] = load
        return np.asarray(self.factors.solve(padded)[: self.n])


def slowest(held: Held, mass: Matrix, count: int) -> tuple[Array, Array]:
    """Slowest modes of a tied solid by shift and invert (Lanczos), with squared angular frequencies.

    Of a solid with few masses by its flexibility between these, where Lanczos vectors would run out.
    """
    massive = np.flatnonzero(mass.diagonal() > 0.0)
    if count >= held.n - 1:
        raise ReductionError(f"{count} modes are asked for, but the solid has {held.n} displacements; take fewer modes")
    if massive.size <= _FEW:
        return _between_masses(held, mass, count, massive)
    inverse = spla.LinearOperator((held.n, held.n), matvec=held.under, dtype=np.float64)
    start = held.under(mass @ np.ones(held.n))
    # Of the matrix itself eigsh takes the shape alone where the inverse is given.
    values, shapes = spla.eigsh(mass, k=count, M=mass, sigma=0.0, OPinv=inverse, v0=start)
    order = np.argsort(values)
    if not values.min() > 0.0:
        raise ReductionError(
            f"the stiffness matrix has the squared frequency {values.min():.3g} 1/s^2 with its interfaces held; it "
            "has to be above 0, so export it without loads"
        )
    return values[order], shapes[:, order]


def _between_masses(held: Held, mass: Matrix, count: int, massive: NDArray[np.intp]) -> tuple[Array, Array]:
    """Slowest modes of a tied solid from ``M F M s = M s / w^2``, F the flexibility between what has mass."""
    own = mass[massive][:, massive].toarray()
    unit = np.zeros((held.n, massive.size))
    unit[massive, np.arange(massive.size)] = 1.0
    flexibility = held.solve(unit, np.zeros((held.factors.shape[0] - held.n, massive.size)))[massive]
    product = own @ flexibility @ own
    try:
        values, shapes = scipy.linalg.eigh(0.5 * (product + product.T), own)
    except np.linalg.LinAlgError:
        raise ReductionError("the mass matrix is not positive; export it again") from None
    values, shapes = values[::-1][:count], shapes[:, ::-1][:, :count]
    if values.min() < -_FLEXIBLE * values.max():
        raise ReductionError(
            "the stiffness matrix has a negative squared frequency with its interfaces held; export it without loads"
        )
    if not values[-1] > _FLEXIBLE * values[0]:
        most = int((values > _FLEXIBLE * values[0]).sum())
        raise ReductionError(f"{count} modes are asked for, but the masses of the solid have {most}; take fewer modes")
    inertia = np.zeros((held.n, count))
    inertia[massive] = own @ shapes
    deflected = held.solve(inertia, np.zeros((held.factors.shape[0] - held.n, count))) / values
    return 1.0 / values, deflected


def _numbers(nodes: NDArray[np.intp]) -> NDArray[np.intp]:
    """Numbers of node displacements in the tied solid."""
    return (3 * nodes[:, None] + np.arange(3)).ravel()


def _at(block: Array, nodes: NDArray[np.intp], rows: int) -> Matrix:
    """Sparse matrix for the tied solid with a block in the rows of some nodes."""
    return _in_rows(block, _numbers(nodes), rows)


def _in_rows(block: Array, own: NDArray[np.intp], rows: int) -> Matrix:
    """Sparse matrix for the tied solid with a block in some rows."""
    width = block.shape[1]
    places = np.repeat(own, width), np.tile(np.arange(width), own.size)
    return sp.csr_array((block.ravel(), places), shape=(rows, width))
