"""A solid whose interfaces are tied to frames, and what is solved with some of the frames held."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from numpy.typing import NDArray

from vpm.errors import ReductionError
from vpm.reduction.structure import Matrix, Structure, rigid_motions

Array = NDArray[np.float64]


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
        own: list[Array] = [np.linalg.pinv(rigid_motions(arms)).astype(np.float64) for arms in self.arms]
        size = 3 * len(structure.nodes)
        self.rows: list[Matrix] = [
            sp.csr_array(_at(average.T, interface.nodes, size).T @ self.tie)
            for interface, average in zip(structure.interfaces, own, strict=True)
        ]
        self.stiffness = sp.csr_array(self.tie.T @ structure.stiffness @ self.tie)
        self.mass = sp.csr_array(self.tie.T @ structure.mass @ self.tie)

    def _ties(self) -> Matrix:
        """Displacements of all nodes of the tied solid per unit of each unknown."""
        interfaces, count = self.structure.interfaces, len(self.structure.nodes)
        rigid = [(i.nodes, arms) for i, arms in zip(interfaces, self.arms, strict=True) if i.tie == "rigid"]
        free = np.setdiff1d(np.arange(count), np.concatenate([np.array([], dtype=np.intp), *(own for own, _ in rigid)]))
        if free.size == 0:
            raise ReductionError("all nodes are tied rigidly to frames, so nothing can deform; name fewer nodes")
        dofs = _numbers(free)
        alone = sp.csr_array((np.ones(dofs.size), (dofs, np.arange(dofs.size))), shape=(3 * count, dofs.size))
        return sp.csr_array(sp.hstack([alone, *(_at(rigid_motions(arms), own, 3 * count) for own, arms in rigid)]))

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
        """Displacements of all nodes of the tied solid, shape (3 N, n)."""
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
    """Slowest modes of a tied solid by shift and invert (Lanczos), with squared angular frequencies."""
    if count >= held.n - 1:
        raise ReductionError(f"{count} modes are asked for, but the solid has {held.n} displacements; take fewer modes")
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


def _numbers(nodes: NDArray[np.intp]) -> NDArray[np.intp]:
    """Numbers of node displacements in the tied solid."""
    return (3 * nodes[:, None] + np.arange(3)).ravel()


def _at(block: Array, nodes: NDArray[np.intp], rows: int) -> Matrix:
    """Sparse matrix for the tied solid with a block in the rows of some nodes."""
    own, width = _numbers(nodes), block.shape[1]
    places = np.repeat(own, width), np.tile(np.arange(width), own.size)
    return sp.csr_array((block.ravel(), places), shape=(rows, width))
