"""The pulp of a fingertip as a body of revolution, a block for comparison, and what Hertz says of both."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vpm.errors import VpmError
from vpm.numbers import Array
from vpm.reduction.solid import finite_elements
from vpm.studies.material import Material
from vpm.studies.soft import SoftBody


@dataclass(frozen=True)
class Finger:
    """Half a ball of tissue around a round bone."""

    #: Outer radius and that of the bone, m.
    radius: float
    bone: float
    #: Thicknesses, m.
    epidermis: float
    dermis: float
    #: Subcutaneous tissue, dermis and epidermis.
    tissue: Material
    skin: Material
    surface: Material
    held: bool  #: Whether the nail holds the tissue at the rim too; without it the bone alone holds.

    @property
    def thickness(self) -> float:
        """Thickness of all layers of the finger on the bone, m."""
        return self.radius - self.bone

    def body(self, fineness: int, *, pole: float = 0.0) -> SoftBody:
        """Finger as a body of finite elements.

        - ``fineness``: layers of elements through the epidermis; 12 times as many lie around the quarter
        - ``pole``: from 0 (even) to below 1: how much smaller elements get towards the pole
        """
        cuts = [self.bone, self.radius - self.epidermis - self.dermis, self.radius - self.epidermis, self.radius]
        if min(np.diff(cuts)) <= 0.0 or self.bone <= 0.0:
            raise VpmError(
                f"layers of {1e3 * (self.epidermis + self.dermis):.3g} mm leave no tissue between the radii "
                f"{1e3 * self.bone:.3g} and {1e3 * self.radius:.3g} mm; take a larger finger"
            )
        check_fineness(fineness)
        across = [np.linspace(a, b, n * fineness + 1)[1:] for a, b, n in zip(cuts, cuts[1:], (4, 1, 1), strict=False)]
        depth = np.concatenate([[self.bone], *across])
        share = np.linspace(0.0, 1.0, 12 * fineness + 1)
        angle = 0.5 * np.pi * (share if pole == 0.0 else np.expm1(share * pole) / np.expm1(pole))
        materials = (self.tissue, self.skin, self.surface)
        return _quarter(depth, angle, np.array(cuts[1:-1]), materials, self.held)

    def with_(self, **changes: object) -> Finger:
        """Copy of the finger with other values."""
        return replace(self, **changes)  # type: ignore[arg-type]


def check_fineness(fineness: int) -> None:
    """Refuse meshes of the finger's body without elements, and those that no machine holds."""
    if not 1 <= fineness <= 12:
        raise VpmError(f"a mesh of fineness {fineness} cannot be made; take a whole number from 1 to 12")


def _quarter(depth: Array, angle: Array, cuts: Array, materials: Sequence[Material], held: bool) -> SoftBody:
    skfem = finite_elements()
    flat = skfem.MeshQuad2.from_mesh(skfem.MeshQuad.init_tensor(depth, angle))
    layer = np.digitize(flat.doflocs[0][flat.t[:4]].mean(axis=0), cuts)
    inner, outer = depth[0], depth[-1]
    skin = flat.facets_satisfying(lambda x: np.abs(x[0] - outer) < 1e-9, boundaries_only=True)

    def holds(x: Array) -> NDArray[np.bool_]:
        return np.asarray((np.abs(x[0] - inner) < 1e-9) | ((np.abs(x[1] - angle[-1]) < 1e-9) & held))

    fixed = flat.facets_satisfying(holds, boundaries_only=True)
    r, turn = flat.doflocs
    round_ = skfem.MeshQuad2(np.stack([r * np.sin(turn), -r * np.cos(turn)]), flat.t)
    return SoftBody(round_, layer, materials, skin, fixed, _penalty(materials[-1], outer))


def block(height: float, contact: float, material: Material, fineness: int) -> SoftBody:
    """Flat layer to compare with the finger's body, elements small where it is touched.

    - ``height``: m; three times as wide
    - ``contact``: radius in which elements are smallest, m
    - ``fineness``: quarter of the elements within `contact`
    """
    skfem = finite_elements()
    check_fineness(fineness)
    near = np.linspace(0.0, contact, 4 * fineness + 1)
    radii = np.concatenate([near, _growing(contact, 3.0 * height, near[1])])
    heights = np.concatenate([near, _growing(contact, height, near[1])])
    mesh = skfem.MeshQuad2.from_mesh(skfem.MeshQuad.init_tensor(radii, heights))
    touched = mesh.facets_satisfying(lambda x: (np.abs(x[1]) < 1e-12) & (x[0] < 3.0 * contact), boundaries_only=True)
    ground = mesh.facets_satisfying(lambda x: np.abs(x[1] - height) < 1e-12, boundaries_only=True)
    layer = np.zeros(mesh.nelements, dtype=np.int64)
    return SoftBody(mesh, layer, (material,), touched, ground, _penalty(material, contact))


def _growing(begin: float, end: float, first: float) -> Array:
    """Points in the finger's body from a place on, with steps that grow by about a quarter each."""
    count = max(1, int(np.ceil(np.log1p(0.25 * (end - begin) / first) / np.log(1.25))))
    steps = 1.25 ** np.arange(1, count + 1)
    return np.asarray(begin + (end - begin) * np.cumsum(steps) / steps.sum())


def _penalty(material: Material, length: float) -> float:
    """Contact stiffness well above the body's own, E over a length; rounds of augmented Lagrange do the rest."""
    return 300.0 * material.young / length


def hertz(way: float | Array, radius: float, young: float) -> tuple[Array, Array]:
    """Hertz' force (N) and contact radius (m) for the finger's body, constant volume (H. Hertz 1881).

    ``F = 4/3 E/(1 - 1/4) sqrt(R) d^(3/2)``, ``a = sqrt(R d)``.
    """
    way = np.asarray(way, dtype=float)
    return 16.0 / 9.0 * young * np.sqrt(radius) * way**1.5, np.sqrt(radius * way)


def layer_factor(share: float | Array) -> Array:
    """Force on a bonded layer as the finger's body over that of Hertz, ``share = sqrt(R d) / h`` up to 1.

    E. Dimitriadis et al., *Biophysical Journal* 82, 2002: 1 + 1.133 x + 1.283 x^2 + 0.769 x^3 + 0.0975 x^4.
    """
    x = np.asarray(share, dtype=float)
    return 1.0 + 1.133 * x + 1.283 * x**2 + 0.769 * x**3 + 0.0975 * x**4
