"""Solids with closed forms, for the finite elements of the studies."""

import numpy as np

from vpm.numbers import Array
from vpm.studies.solid import Solid, brick, moved

#: Radii of a curved bar, m; it is bent by 1 N m per metre of its width.
INNER, OUTER = 1.0, 2.0


def golovin(radius: Array | float) -> Array:
    """Hoop stress of a curved bar under pure bending, Pa (Timoshenko and Goodier, section 29)."""
    a2, b2, ratio = INNER**2, OUTER**2, np.log(OUTER / INNER)
    r = np.asarray(radius, dtype=float)
    scale = (b2 - a2) ** 2 - 4.0 * a2 * b2 * ratio**2
    terms = -a2 * b2 / r**2 * ratio + b2 * np.log(r / OUTER) + a2 * np.log(INNER / r) + b2 - a2
    return np.asarray(-4.0 / scale * terms)


CURVED = float(golovin(INNER))


def curved_bar(fineness: int) -> tuple[float, float]:
    """Hoop stress on the inner side, and the largest error of it anywhere over its largest value."""
    count = 2 * fineness
    flat = brick(
        np.linspace(INNER, OUTER, count + 1), np.linspace(0.0, 0.5 * np.pi, 2 * count + 1), np.array([0.0, 0.5])
    )
    root = flat.facets_satisfying(lambda x: np.abs(x[1]) < 1e-9, boundaries_only=True)
    end = flat.facets_satisfying(lambda x: np.abs(x[1] - 0.5 * np.pi) < 1e-9, boundaries_only=True)
    r, angle, z = flat.doflocs
    solid = Solid(moved(flat, np.stack([r * np.cos(angle), r * np.sin(angle), z])), 1.0, 0.0)

    def bending(x: Array) -> Array:
        return np.stack([-golovin(np.hypot(x[0], x[1])), 0.0 * x[0], 0.0 * x[0]])

    dofs, (x, y, z) = solid.basis.nodal_dofs, solid.corners
    corner = (np.abs(y) < 1e-9) & (np.abs(x - INNER) < 1e-9)
    fixed = np.concatenate([solid.basis.get_dofs(root).all("u^2"), dofs[2][np.abs(z) < 1e-9], dofs[0][corner]])
    (moved_,) = solid.solve(np.unique(fixed), solid.load(end, bending))
    turn = np.arctan2(y, x)
    hoop = np.stack([-np.sin(turn), np.cos(turn)])
    found = np.einsum("ik,ijk,jk->k", hoop, solid.corner_stress(moved_)[:2, :2], hoop)
    exact = golovin(np.hypot(x, y))
    middle = (np.abs(np.hypot(x, y) - INNER) < 1e-9) & (np.abs(turn - 0.25 * np.pi) < 1e-9)
    return float(found[middle].mean()), float(np.abs(found - exact).max() / np.abs(exact).max())
