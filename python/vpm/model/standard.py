"""Standard inertial parameters of bodies: those in which efforts are linear."""

import numpy as np

from vpm.numbers import Array

#: The ten standard parameters of a body, in this order, and their units.
STANDARD = (
    "mass",
    "first_moment.x",
    "first_moment.y",
    "first_moment.z",
    *(f"origin_inertia.{entry}" for entry in ("xx", "yy", "zz", "xy", "xz", "yz")),
)
UNITS = ("kg", *("kg m",) * 3, *("kg m^2",) * 6)
#: The same of a model file, where inertia is about the centre of mass.
OF_FILE = (
    "mass",
    *(f"center_of_mass.{axis}" for axis in "xyz"),
    *(f"inertia.{entry}" for entry in ("xx", "yy", "zz", "xy", "xz", "yz")),
)
#: A body of 1 kg with its centre of mass in the origin; some inertia, because the core moves no joint without.
PLAIN = np.array([1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0])


def standard_parameters(mass: float, center: Array, inertia: Array) -> Array:
    """Standard parameters (10,): mass, first moment, moments of inertia about the frame's origin.

    - ``center``: shape (3,)
    - ``inertia``: shape (6,); about the centre of mass: xx yy zz xy xz yz, entries of the matrix
    """
    shift = mass * (float(center @ center) * np.eye(3) - np.outer(center, center))
    x, y, z = 0, 1, 2
    entries = shift[[x, y, z, x, x, y], [x, y, z, y, z, z]]
    return np.array([mass, *(mass * center), *(inertia + entries)])


def of_file(ten: Array) -> Array:
    """Mass, centre of mass and moments of inertia about it, (10,), of standard parameters: a model file's numbers."""
    center = ten[1:4] / ten[0]
    return np.array([ten[0], *center, *(2.0 * ten[4:] - standard_parameters(float(ten[0]), center, ten[4:])[4:])])
