"""Solids of one isotropic material by quadratic finite elements of scikit-fem."""

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import scipy.sparse as sp

from vpm.errors import ReductionError, needs
from vpm.numbers import Array
from vpm.reduction.structure import Interface, Structure


def finite_elements(module: str = "skfem") -> ModuleType:
    """Library for finite elements: scikit-fem, a module of it, or meshio."""
    with needs("meshio" if module == "meshio" else "scikit-fem", "fem"):
        return import_module(module)


#: Meshes, tensors and modules of scikit-fem, which has no types.
Mesh = Any
Tensor = Any

#: Gauss rules of this order integrate products of two gradients of quadratic functions.
_ORDER = 4
#: Most displacements of a solid: beyond that the factorisation takes minutes and gigabytes.
_LARGEST = 200_000


def box_mesh(size: tuple[float, ...], elements: tuple[int, ...]) -> Mesh:
    """Mesh of a box-shaped solid: hexahedra from x, y = -half to half its sizes, and from z = 0.

    ``size``: along x, y and z (m); ``elements``: along x, y and z.
    """
    fem = finite_elements()
    (width, height, length), (a, b, c) = size, elements
    lines = (
        np.linspace(-0.5, 0.5, a + 1) * width,
        np.linspace(-0.5, 0.5, b + 1) * height,
        np.linspace(0.0, length, c + 1),
    )
    return fem.MeshHex.init_tensor(*lines)


def read_mesh(path: Path, scale: float) -> Mesh:
    """Mesh of a solid from a file that meshio reads: Abaqus and CalculiX, Nastran, Gmsh, VTK.

    ``scale``: length of its unit (m).
    """
    fem, _ = finite_elements(), finite_elements("meshio")
    if not path.is_file():
        raise ReductionError(f"{path} does not exist; check the path of the mesh")
    try:
        mesh = fem.Mesh.load(str(path))
    except (Exception, SystemExit) as error:  # readers of some thirty formats  # noqa: BLE001
        raise ReductionError(f"{path} cannot be read as a mesh ({str(error)[:80] or type(error).__name__})") from None
    if mesh.dim() != 3 or not isinstance(mesh, fem.MeshTet1 | fem.MeshHex1):
        raise ReductionError(
            f"{path} holds a {type(mesh).__name__}, but a solid needs tetrahedra or hexahedra; mesh it so"
        )
    return mesh.scaled(scale)


def solid(
    mesh: Mesh,
    interfaces: Callable[[Array], tuple[Interface, ...]],
    *,
    young: float,
    poisson: float = 0.3,
    density: float,
) -> Structure:
    """Matrices of a solid, with quadratic displacements in its elements.

    - ``mesh``: tetrahedra or hexahedra, in m
    - ``interfaces``: from the places of the nodes, shape (N, 3), to the interfaces
    - ``young``, ``poisson``, ``density``: SI
    """
    fem, tensors = finite_elements(), finite_elements("skfem.helpers")
    element = fem.ElementHex2() if isinstance(mesh, fem.MeshHex1) else fem.ElementTetP2()
    scalar = fem.Basis(mesh, element, intorder=_ORDER)
    if 3 * scalar.N > _LARGEST:
        raise ReductionError(f"the solid has {3 * scalar.N} displacements, more than {_LARGEST}; mesh it coarser")
    basis = scalar.with_element(fem.ElementVector(element))
    shear = 0.5 * young / (1.0 + poisson)
    first = young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson))

    def stress(strain: Tensor) -> Tensor:
        return 2.0 * shear * strain + first * tensors.eye(tensors.trace(strain), 3)

    def stiffness(u: Tensor, v: Tensor, _: Tensor) -> Tensor:
        return tensors.ddot(stress(tensors.sym_grad(u)), tensors.sym_grad(v))

    def mass(u: Tensor, v: Tensor, _: Tensor) -> Tensor:
        return density * u * v

    def forces(v: Tensor, w: Tensor) -> Tensor:
        return tensors.ddot(w["stress"], tensors.sym_grad(v))

    def stretching(one: Array, other: Array) -> Array:
        a, b = (np.asarray(basis.interpolate(field).grad) for field in (one, other))
        product = np.einsum("kiab,kjab->ijab", a, b)
        return np.asarray(
            fem.LinearForm(forces).assemble(basis, stress=stress(0.5 * (product + product.transpose(1, 0, 2, 3))))
        )

    nodes = np.ascontiguousarray(scalar.doflocs.T)
    full = sp.kron(sp.csr_array(fem.BilinearForm(mass).assemble(scalar)), sp.eye_array(3), format="csr")
    return Structure(
        sp.csr_array(fem.BilinearForm(stiffness).assemble(basis)),
        sp.csr_array(full),
        nodes,
        interfaces(nodes),
        stretching,
    )
