"""Soft bodies of revolution at large strain, pressed onto a rigid obstacle: finite elements of scikit-fem.

Displacements are biquadratic and pressures bilinear on quadrilaterals (Taylor and Hood), which is stable at constant
volume; pressures jump from one layer to the next, as those of different materials do. What is solved is the
stationary point of ``int W(F) + p (J - 1) - p^2 / (2 K)`` with the contact added by augmented Lagrange.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import bmat, csc_matrix, csr_matrix

from vpm.numbers import Array
from vpm.reduction.solid import finite_elements
from vpm.studies.jet import Jet
from vpm.studies.material import Material, invariants

if TYPE_CHECKING:
    from skfem import MeshQuad2

#: Points of integration: exact for polynomials of this order on each element.
ORDER = 5
#: The same for contact: three points on an edge, about its freedoms; more could not all be without overlap.
TOUCH = 5


@dataclass(frozen=True)
class Obstacle:
    """A rigid surface below the body, ``z = level + curvature r^2 / 2``, without friction."""

    level: float  #: Height on the axis, m.
    curvature: float = 0.0  #: 1/m; zero for a plate, ``-1/R`` for a ball of the radius R.


@dataclass
class State:
    """Displacements, pressures and contact multipliers of a soft body."""

    displacement: Array
    pressure: Array
    multiplier: Array  #: Shape (facets, points); contact pressure of the last round, Pa of the undeformed surface.

    def copy(self) -> State:
        """Copy of a state of a soft body."""
        return State(self.displacement.copy(), self.pressure.copy(), self.multiplier.copy())


@dataclass
class SoftBody:
    """A body of revolution about z, in layers; x of the mesh is the radius."""

    mesh: MeshQuad2  #: Metres.
    layer: NDArray[np.int64]  #: Shape (elements,).
    materials: Sequence[Material]  #: Of each layer.
    contact: NDArray[np.int64]  #: Facets that may touch the obstacle.
    held: NDArray[np.int64]  #: Facets that do not move.
    penalty: float  #: Contact stiffness, Pa/m of the undeformed surface.

    def __post_init__(self) -> None:
        skfem = finite_elements()
        self.basis = skfem.Basis(self.mesh, skfem.ElementVector(skfem.ElementQuad2()), intorder=ORDER)
        self.inner = skfem.Basis(self.mesh, skfem.ElementQuad1DG(), intorder=ORDER)
        self.skin = skfem.FacetBasis(
            self.mesh, skfem.ElementVector(skfem.ElementQuad2()), facets=self.contact, intorder=TOUCH
        )
        self.merge = self._merged()
        on_axis = self.mesh.facets_satisfying(lambda x: np.abs(x[0]) < 1e-9, boundaries_only=True)
        still = [self.basis.get_dofs(self.held).all()]
        if on_axis.size:
            still.append(self.basis.get_dofs(on_axis).all("u^1"))
        self.fixed = np.unique(np.concatenate(still))
        self.compliance = np.array([m.compliance for m in self.materials])[self.layer][:, None]
        self._shape = self._strains_of_shapes()

    def _merged(self) -> csr_matrix:
        """Pressures of a soft body's elements from those at the corners of each layer."""
        corners = self.mesh.t[:4]
        keys = np.stack([corners, np.broadcast_to(self.layer, corners.shape)]).reshape(2, -1)
        _, place = np.unique(keys, axis=1, return_inverse=True)
        rows = self.inner.element_dofs.reshape(-1)
        place = np.ravel(place)
        return csr_matrix((np.ones(rows.size), (rows, place)), shape=(self.inner.N, place.max() + 1))

    def _strains_of_shapes(self) -> Array:
        """Strains of a soft body's elements per displacement, shape (18, 5, elements, points)."""
        radius = self.basis.global_coordinates()[0]
        parts = []
        for (shape,) in self.basis.basis:
            g, v = np.asarray(shape.grad), np.asarray(shape)
            parts.append(np.stack([g[0, 0], g[0, 1], g[1, 0], g[1, 1], v[0] / radius]))
        return np.stack(parts)

    def rest(self) -> State:
        """Rest state of a soft body, in which nothing touches."""
        points = self.skin.global_coordinates()[0]
        return State(np.zeros(self.basis.N), np.zeros(self.merge.shape[1]), np.zeros(points.shape))

    def strain(self, state: State) -> Array:
        """Strain of a soft body: five numbers of the deformation gradient, shape (5, elements, points)."""
        local = state.displacement[self.basis.element_dofs]
        one = np.array([1.0, 0.0, 0.0, 1.0, 1.0])[:, None, None]
        return np.asarray(one + np.einsum("aikq,ak->ikq", self._shape, local))

    def energy_density(self, strain: Array) -> Jet:
        """Energy density of a soft body at each point, Pa, with derivatives."""
        value = np.zeros(strain.shape[1:])
        gradient, hessian = np.zeros((5, *value.shape)), np.zeros((5, 5, *value.shape))
        for number, material in enumerate(self.materials):
            mine = self.layer == number
            part = material.isochoric(strain[:, mine])
            value[mine], gradient[:, mine], hessian[:, :, mine] = part.value, part.gradient, part.hessian
        return Jet(value, gradient, hessian)

    @property
    def _measure(self) -> Array:
        return np.asarray(2.0 * np.pi * np.asarray(self.basis.global_coordinates()[0]) * self.basis.dx)

    def pressures(self, state: State) -> Array:
        """Pressure multiplier p of a soft body at each point, Pa; the pressure of a fluid is -p."""
        return np.asarray(self.inner.interpolate(self.merge @ state.pressure))

    def energy(self, state: State) -> float:
        """Elastic energy of a soft body, J."""
        density = self.energy_density(self.strain(state)).value
        return float(np.sum((density + 0.5 * self.compliance * self.pressures(state) ** 2) * self._measure))

    def gap(self, state: State, obstacle: Obstacle) -> tuple[Array, Array]:
        """Clearance (m) and radius (m) at points of a soft body's skin; negative where they overlap."""
        u = np.asarray(self.skin.interpolate(state.displacement))
        x = np.asarray(self.skin.global_coordinates())
        radius = x[0] + u[0]
        return x[1] + u[1] - obstacle.level - 0.5 * obstacle.curvature * radius**2, radius

    def touch(self, state: State, obstacle: Obstacle) -> Array:
        """Contact pressure at points of a soft body's skin, Pa of the undeformed surface."""
        return np.maximum(0.0, state.multiplier - self.penalty * self.gap(state, obstacle)[0])

    def force(self, state: State, obstacle: Obstacle) -> float:
        """Force of a soft body on the obstacle along the axis, N."""
        ring = 2.0 * np.pi * np.asarray(self.skin.global_coordinates()[0]) * self.skin.dx
        return float(np.sum(self.touch(state, obstacle) * ring))

    def residual(self, state: State, obstacle: Obstacle) -> tuple[Array, tuple[Jet, Jet, Array]]:
        """Residual of a soft body's balance, and what the derivative needs."""
        strain, p = self.strain(state), self.pressures(state)
        energy, volume = self.energy_density(strain), invariants(strain)[2]
        stress = (energy.gradient + p * volume.gradient) * self._measure
        force = _gathered(np.einsum("aikq,ikq->ak", self._shape, stress), self.basis)
        force += self._push(state, obstacle)
        swell = (volume.value - 1.0 - self.compliance * p) * self._measure
        shapes = np.stack([np.asarray(shape) for (shape,) in self.inner.basis])
        kept = self.merge.T @ _gathered(np.einsum("akq,kq->ak", shapes, swell), self.inner)
        return np.concatenate([force, kept]), (energy, volume, p)

    def tangent(self, state: State, obstacle: Obstacle, known: tuple[Jet, Jet, Array]) -> csc_matrix:
        """Derivative of a soft body's residual, sparse and symmetric."""
        energy, volume, p = known
        stiffness = (energy.hessian + p * volume.hessian) * self._measure
        shapes = np.stack([np.asarray(shape) for (shape,) in self.inner.basis])
        half = np.einsum("ijkq,bjkq->bikq", stiffness, self._shape)
        K = _spread(np.einsum("aikq,bikq->abk", self._shape, half, optimize=True), self.basis, self.basis)
        swell = np.einsum("aikq,ikq->akq", self._shape, volume.gradient * self._measure)
        G = _spread(np.einsum("bkq,akq->bak", shapes, swell), self.inner, self.basis)
        C = _spread(np.einsum("akq,bkq->abk", shapes, shapes * (self.compliance * self._measure)), *[self.inner] * 2)
        G = self.merge.T @ G
        K = K + self._touch_stiffness(state, obstacle)
        return csc_matrix(bmat([[K, G.T], [G, -(self.merge.T @ C @ self.merge)]]))

    def _slopes(self, state: State, obstacle: Obstacle) -> tuple[Array, Array, Array]:
        """Derivatives of a soft body's gap by an element's displacements, and the measure."""
        radius = self.gap(state, obstacle)[1]
        values = np.stack([np.asarray(shape) for (shape,) in self.skin.basis])
        ring = 2.0 * np.pi * np.asarray(self.skin.global_coordinates()[0]) * self.skin.dx
        return values[:, 1] - obstacle.curvature * radius * values[:, 0], values[:, 0], ring

    def _push(self, state: State, obstacle: Obstacle) -> Array:
        slopes, _, ring = self._slopes(state, obstacle)
        return _gathered(-np.einsum("akq,kq->ak", slopes, self.touch(state, obstacle) * ring), self.skin)

    def _touch_stiffness(self, state: State, obstacle: Obstacle) -> csr_matrix:
        slopes, radial, ring = self._slopes(state, obstacle)
        pressure = self.touch(state, obstacle)
        stiff = self.penalty * (pressure > 0.0) * ring
        local = np.einsum("akq,bkq->abk", slopes, slopes * stiff)
        local += np.einsum("akq,bkq->abk", radial, radial * (obstacle.curvature * pressure * ring))
        return _spread(local, self.skin, self.skin)


def _gathered(local: Array, basis: Any) -> Array:  # noqa: ANN401
    """Vector of the whole soft body from those of the elements."""
    return np.asarray(np.bincount(basis.element_dofs.reshape(-1), local.reshape(-1), basis.N), dtype=float)


def _spread(local: Array, rows: Any, columns: Any) -> csr_matrix:  # noqa: ANN401
    """Sparse matrix of the whole soft body from those of the elements."""
    i = np.broadcast_to(rows.element_dofs[:, None], local.shape).reshape(-1)
    j = np.broadcast_to(columns.element_dofs[None], local.shape).reshape(-1)
    return csr_matrix((local.reshape(-1), (i, j)), shape=(rows.N, columns.N))
