"""Reduction of a solid to few modes, with the integrals of its inertia and its stiffening by loads.

Sources: R. R. Craig, M. C. C. Bampton, "Coupling of substructures for dynamic analyses", AIAA J. 6(7), 1968; S. R.
Idelsohn, A. Cardona, "A reduction method for nonlinear structural dynamic analysis", Comput. Methods Appl. Mech. Eng.
49, 1985, for static modal derivatives; O. Wallrapp, "Standardization of flexible body modeling in multibody system
codes", Mech. Struct. Mach. 22(3), 1994.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from vpm.errors import ReductionError
from vpm.model.beams.reduced import MODES, ReducedLink
from vpm.numbers import Array
from vpm.reduction.structure import (
    Structure,
    check_structure,
    check_units,
    rigid_motions,
    second_moments,
    with_real_bodies,
)
from vpm.reduction.tied import Tied

#: Signs of the cross product: ``(a x b)_k = CROSS_kij a_i b_j``.
_CROSS = np.array([[np.cross(a, b)[k] for a in np.eye(3) for b in np.eye(3)] for k in range(3)]).reshape(3, 3, 3)
#: Share of the largest one below which an entry of the Gram matrix is rounding.
_RANK = 1e-12


@dataclass(frozen=True, eq=False)
class Reduction:
    """A reduced solid, and how good it is.

    Attributes
    ----------
    link : ReducedLink
        What a model file names.
    frequencies, full : ndarray
        Frequencies of the kept modes and of the whole solid (Hz), held at its root.
    effective_mass : ndarray
        Share of the mass that each mode moves along x, y and z, shape (n, 3).
    compliance : ndarray
        Share of the exact deflection under a unit load that the kept modes show, for rotations and translations of each
        interface, shape (m, 6).
    mass : float
        Mass of the solid (kg).
    """

    link: ReducedLink
    frequencies: Array
    full: Array
    effective_mass: Array
    compliance: Array
    mass: float

    @property
    def errors(self) -> Array:
        """Relative frequency errors of a Craig-Bampton reduction."""
        return np.asarray(self.frequencies / self.full - 1.0)

    def __str__(self) -> str:
        return "\n".join(self._lines())

    def _lines(self) -> Iterator[str]:
        yield f"{self.mass:.6g} kg, {self.frequencies.size} modes of the solid held at its root"
        yield f"{'mode':>4s} {'frequency':>12s} {'error':>9s}   {'effective mass along x, y, z':>30s}"
        rows = zip(self.frequencies, self.errors, self.effective_mass, strict=True)
        for number, (frequency, error, (x, y, z)) in enumerate(rows):
            yield f"{number:4d} {frequency:9.5g} Hz {error:9.1e}   {x:10.4f}{y:10.4f}{z:10.4f}"
        x, y, z = self.effective_mass.sum(axis=0)
        yield f"{'sum':>4s} {'':22s}   {x:10.4f}{y:10.4f}{z:10.4f}"
        for name, shares in zip(self.link.interfaces, self.compliance, strict=True):
            shown = ", ".join(f"{share:.4f}" for share in shares)
            yield f"deflection of {name} under unit moments and forces, of the exact one: {shown}"
        if not self.link.stiffens:
            yield (
                "stiffening by loads and spin is left out, since matrices do not tell it: a spin that is not slow "
                "beside the first frequency, or a load near that of buckling, needs a solid with its mesh"
            )


def reduce_structure(structure: Structure, modes: int = 8) -> Reduction:
    """Craig-Bampton reduction of a solid to its slowest modes.

    All constraint modes of the interfaces and as many fixed-interface modes as are asked for make the basis; of its own
    modes, with the root held, the slowest are kept.

    ``modes``: how many modes to keep, 1 to 64.

    Raises
    ------
    ReductionError
        The matrices are those of no solid, or have fewer modes.
    """
    if not 1 <= modes <= MODES:
        raise ReductionError(f"{modes} modes are asked for, but 1 to {MODES} are possible")
    check_structure(structure)
    structure = with_real_bodies(structure)
    solid = Tied(structure)
    basis = np.hstack([solid.constraint_modes(), solid.fixed_modes(modes)])
    squares, shapes = _own_modes(solid, basis, modes)
    check_units(structure, float(np.sqrt(squares[0]) / (2.0 * np.pi)))
    full = solid.free_frequencies(modes)
    fields, frames = solid.nodal(shapes), solid.frames(shapes)
    second = _second(solid, fields, frames)
    link = _link(structure, squares, fields, frames, second)
    moved = structure.rigid_motions(structure.centre)[:, 3:]
    effective = (fields.T @ (structure.mass @ moved)) ** 2 / structure.total_mass
    exact = np.diag(solid.compliance())
    kept = (frames**2 / squares).sum(axis=-1)
    shares = kept / exact.reshape(kept.shape)
    return Reduction(link, np.sqrt(squares) / (2.0 * np.pi), full, effective, shares, structure.total_mass)


def _own_modes(solid: Tied, basis: Array, count: int) -> tuple[Array, Array]:
    """Slowest Craig-Bampton modes within a basis, of unit modal mass."""
    basis = basis / np.sqrt(np.einsum("ij,ij->j", basis, solid.stiffness @ basis))
    stiffness, mass = basis.T @ (solid.stiffness @ basis), basis.T @ (solid.mass @ basis)
    # The other way round, for rotations without inertia leave the mass singular.
    values, shapes = scipy.linalg.eigh(0.5 * (mass + mass.T), 0.5 * (stiffness + stiffness.T))
    values, shapes = values[::-1][:count], basis @ shapes[:, ::-1][:, :count]
    shapes *= np.sign(shapes[np.abs(shapes).argmax(axis=0), np.arange(count)]) / np.sqrt(values)
    return 1.0 / values, shapes


def _second(solid: Tied, fields: Array, frames: Array) -> tuple[Array, Array] | None:
    """Second derivatives by each pair of Craig-Bampton modes, of displacements and frames; or None.

    A deflection of second order is what undoes the stress of the second-order strain: ``K gamma = -int B^T C sym(A_i^T
    A_j)``. Its work with any load is the geometric stiffness of that load. Rigid frames turn their nodes to second
    order.
    """
    structure, n = solid.structure, fields.shape[1]
    stretching = structure.stretching
    if stretching is None:
        return None
    loads, offsets, motions = [], [], []
    for i, j in _pairs(n):
        offset, motion = np.zeros(fields.shape[0]), np.zeros((len(frames), 6))
        for number, (interface, arms) in enumerate(zip(structure.interfaces[1:], solid.arms[1:], strict=True)):
            turned = _turned(frames[number, :3, i], frames[number, :3, j], arms)
            if interface.tie == "rigid":
                offset.reshape(-1, 3)[interface.nodes] = turned
            else:
                motion[number] = np.linalg.pinv(rigid_motions(arms)) @ turned.ravel()
        loads.append(solid.tie.T @ (-stretching(fields[:, i], fields[:, j]) - structure.stiffness @ offset))
        offsets.append(offset)
        motions.append(motion)
    found = solid.free.solve(np.array(loads).T, np.zeros((6, len(loads))))
    return solid.nodal(found) + np.array(offsets).T, solid.frames(found) - np.moveaxis(np.array(motions), 0, -1)


def _pairs(n: int) -> Iterator[tuple[int, int]]:
    return ((i, j) for j in range(n) for i in range(j + 1))


def _turned(one: Array, other: Array, arms: Array) -> Array:
    """Second derivative of a turn for Craig-Bampton modes: ``sym(w_i x (w_j x r))``."""
    return 0.5 * (np.cross(one, np.cross(other, arms)) + np.cross(other, np.cross(one, arms)))


def _link(
    structure: Structure, squares: Array, fields: Array, frames: Array, second: tuple[Array, Array] | None
) -> ReducedLink:
    """Point masses of a Craig-Bampton link with the Gram matrix of the solid's fields.

    With ``G = L L^T`` the columns of L are as good as the solid; a turn of them makes the masses equal. What is
    quadratic goes to them by its products with all other fields. A node with rotary inertia J is a small rigid body
    of the second moments ``tr(J)/2 - J``, and a field grows within it by its gradient, ``theta x r``.
    """
    nodes, n = structure.nodes - structure.places[0], squares.size
    shifts = fields[: nodes.size]
    functions = np.hstack([np.ones((len(nodes), 1)), nodes, shifts.reshape(len(nodes), 3 * n)])
    weighted = structure.scalar_mass @ functions
    gram = functions.T @ weighted
    if structure.rotations.size:
        moments = second_moments(structure.rotary_inertia)
        grown = np.einsum("kij,pin->pjkn", _CROSS, structure.turns(fields)).reshape(len(nodes), 3, 3 * n)
        of_places = np.broadcast_to(np.eye(4)[1:], (len(nodes), 3, 4))
        gradients = np.concatenate([of_places, grown], axis=2)
        gram += np.einsum("pia,pij,pjb->ab", gradients, moments, gradients, optimize=True)
    size = np.sqrt(np.diag(gram))
    size[size == 0.0] = 1.0
    values, vectors = np.linalg.eigh(gram / np.outer(size, size))
    if values[0] < -1e-9 * values[-1]:
        raise ReductionError(
            f"the mass matrix is not positive: {values[0] / values[-1]:.2g} of its size is below zero; export it again"
        )
    kept = values > _RANK * values[-1]
    root, vectors = np.sqrt(values[kept]), vectors[:, kept]
    factor = size[:, None] * vectors * root
    turn = _levelled(factor[0])
    weight = np.sqrt(gram[0, 0] / root.size)
    at = (factor @ turn).T / weight
    curved, frames_curved = np.zeros((root.size, 0, 3)), np.zeros((len(frames), 0, 6))
    if second is not None:
        products = weighted.T @ second[0].reshape(len(nodes), -1) / size[:, None]
        projected = turn.T @ ((vectors / root).T @ products) / weight
        curved = projected.reshape(root.size, 3, -1).transpose(0, 2, 1)
        frames_curved = second[1].transpose(0, 2, 1)
    return ReducedLink(
        squares=squares,
        masses=np.full(root.size, weight**2),
        points=at[:, 1:4],
        point_shapes=at[:, 4:].reshape(root.size, 3, n).transpose(0, 2, 1),
        point_curved=curved,
        interfaces=tuple(interface.name for interface in structure.interfaces[1:]),
        places=structure.places[1:] - structure.places[0],
        shapes=frames.transpose(0, 2, 1),
        curved=frames_curved,
    )


def _levelled(row: Array) -> Array:
    """Orthogonal matrix for Craig-Bampton masses that makes all entries of a row equal (Householder)."""
    normal = row / np.linalg.norm(row) - np.full(row.size, row.size**-0.5)
    square = normal @ normal
    return np.eye(row.size) - (2.0 / square * np.outer(normal, normal) if square > 0.0 else 0.0)
