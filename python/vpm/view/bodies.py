"""Sizes of bodies from what a model knows of them: boxes of the same inertia, spheres of the same mass."""

import math

import numpy as np

from vpm.numbers import Array

#: Density of aluminium (kg/m^3), of which most links of robots are.
DENSITY = 2700.0
#: Density of light foam (kg/m^3): no part of a machine is lighter, and a box that is has made-up numbers behind it.
LIGHTEST = 10.0


def sphere_radius(mass: float) -> float:
    """Radius (m) of an aluminium sphere that shows a body of that mass (kg)."""
    return math.cbrt(3.0 * max(mass, 0.0) / (4.0 * math.pi * DENSITY))


def box_of(mass: float, inertia: Array) -> tuple[Array, Array] | None:
    """Uniform box that shows a body of the same inertia.

    A box of sides a, b, c has ``I_a = m (b^2 + c^2)/12`` about the direction of a, so ``a^2 = 6 (I_b + I_c - I_a)/m``.
    A side that vanishes, as of a thin rod, gets the thickness of as much aluminium as weighs the mass.

    ``mass``: kg; ``inertia``: shape (3, 3), about the centre of mass (kg m^2).

    - result ``axes``: shape (3, 3), row i is the direction of side i in the body
    - result ``size``: shape (3,), lengths of the sides (m)
    - result ``None``: where the body has no mass or no inertia, or the box were lighter than anything
    """
    if mass <= 0.0 or not np.any(inertia):
        return None
    moments, turned = np.linalg.eigh(inertia)
    size = np.sqrt(np.maximum(6.0 / mass * (np.sum(moments) - 2.0 * moments), 0.0))
    flat = size < 1e-3 * np.max(size)
    if np.any(flat):
        volume = mass / DENSITY / float(np.prod(size[~flat]))
        size[flat] = min(volume ** (1.0 / int(np.sum(flat))), float(np.max(size)))
    return None if mass < LIGHTEST * float(np.prod(size)) else (np.asarray(turned.T), size)
