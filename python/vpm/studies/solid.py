"""Linear elastic solids of bricks with 20 nodes, by the forms of scikit-fem."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vpm.numbers import Array
from vpm.reduction.solid import finite_elements

if TYPE_CHECKING:
    from skfem import MeshHex2

Facets = NDArray[np.int64]
#: Traction (Pa) at points of a face, shape (3, ...), from places, shape (3, ...).
Traction = Callable[[Array], Array]


@dataclass(frozen=True)
class Solid:
    """A linear elastic body."""

    mesh: MeshHex2  #: Metres; its edges may be curved.
    young: float  #: Pa.
    poisson: float

    @cached_property
    def basis(self) -> Any:  # noqa: ANN401
        """Basis of a solid's displacements: 20 nodes on each brick, as in the thesis."""
        skfem = finite_elements()
        return skfem.Basis(self.mesh, skfem.ElementVector(skfem.ElementHexS2()), intorder=4)

    @cached_property
    def stiffness(self) -> Any:  # noqa: ANN401
        """Stiffness matrix of a linear elastic solid, N/m."""
        from skfem.models.elasticity import lame_parameters, linear_elasticity

        return linear_elasticity(*lame_parameters(self.young, self.poisson)).assemble(self.basis).tocsc()

    def load(self, facets: Facets, traction: Traction) -> Array:
        """Forces of a traction on a solid's faces, N."""
        skfem = finite_elements()
        face = skfem.FacetBasis(self.mesh, self.basis.elem, facets=facets, intorder=4)

        def work(v: Any, w: Any) -> Array:  # noqa: ANN401
            return np.asarray(np.einsum("i...,i...", traction(np.asarray(w.x)), np.asarray(v)))

        return np.asarray(skfem.LinearForm(work).assemble(face))

    def solve(self, fixed: NDArray[np.int64], *loads: Array) -> list[Array]:
        """Solve a solid: displacements of all nodes (m) under each load, some held."""
        from scipy.sparse.linalg import splu

        free = np.setdiff1d(np.arange(self.basis.N), fixed)
        factors = splu(self.stiffness[free][:, free], permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
        answers = []
        for load in loads:
            moved = np.zeros(self.basis.N)
            moved[free] = factors.solve(load[free])
            answers.append(moved)
        return answers

    def corner_stress(self, displacement: Array) -> Array:
        """Stress of a solid at the corners of the bricks, Pa, their mean, shape (3, 3, corners)."""
        skfem = finite_elements()
        places = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)]).T
        at = skfem.Basis(self.mesh, self.basis.elem, quadrature=(places, np.ones(8)))
        local = at.interpolate(displacement)
        strain = 0.5 * (local.grad + np.swapaxes(local.grad, 0, 1))
        shear = self.young / (2.0 * (1.0 + self.poisson))
        first = self.young * self.poisson / ((1.0 + self.poisson) * (1.0 - 2.0 * self.poisson))
        stress = 2.0 * shear * strain + first * np.einsum("ii...", strain) * np.eye(3)[:, :, None, None]
        return self._mean_at_corners(np.asarray(at.global_coordinates()), stress)

    @cached_property
    def corners(self) -> Array:
        """Corners of a solid's bricks, m, shape (3, corners)."""
        return np.asarray(self.mesh.doflocs[:, : self.basis.nodal_dofs.shape[1]])

    def _mean_at_corners(self, places: Array, values: Array) -> Array:
        """Mean values at a solid's mesh corners from those of each brick."""
        around = self.corners[:, self.mesh.t[:8]]
        distance = ((places[:, :, :, None] - np.moveaxis(around, 1, 2)[:, :, None, :]) ** 2).sum(axis=0)
        number = np.take_along_axis(self.mesh.t[:8].T, distance.argmin(axis=2), axis=1)
        count = np.bincount(number.ravel(), minlength=self.corners.shape[1])
        mean = [
            [np.bincount(number.ravel(), values[i, j].ravel(), self.corners.shape[1]) / count for j in range(3)]
            for i in range(3)
        ]
        return np.array(mean)


def von_mises(stress: Array) -> Array:
    """Von Mises stress of a solid, of stresses of the shape (3, 3, ...)."""
    deviator = stress - np.einsum("ii...", stress) / 3.0 * np.eye(3).reshape(3, 3, *(1,) * (stress.ndim - 2))
    return np.asarray(np.sqrt(1.5 * np.einsum("ij...,ij...", deviator, deviator)))


def brick(first: Array, second: Array, third: Array) -> MeshHex2:
    """Solid box of bricks between the given planes, whose nodes can be moved."""
    skfem = finite_elements()
    return skfem.MeshHex2.from_mesh(skfem.MeshHex.init_tensor(first, second, third))


def moved(mesh: MeshHex2, places: Array) -> MeshHex2:
    """Mesh of a solid with its nodes at other places."""
    return finite_elements().MeshHex2(places, mesh.t)
