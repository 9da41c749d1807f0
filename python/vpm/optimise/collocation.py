"""Radau's points of an interval, and the polynomials through them.

Source: E. Hairer, G. Wanner, "Solving Ordinary Differential Equations II", 2nd edition 1996, section IV.5: Radau IIA of
three stages has order five, and its last point is the end of the interval, so it is stiffly accurate.
"""

import numpy as np
from numpy.polynomial import legendre

from vpm.numbers import Array

#: Points in each interval.
STAGES = 3


def _points() -> Array:
    """Collocation points: roots of ``P_(s-1) - P_s`` on [0, 1], of which the last is 1."""
    coefficients = np.zeros(STAGES + 1)
    coefficients[STAGES - 1 :] = 1.0, -1.0
    return np.sort(0.5 * (legendre.legroots(coefficients).real + 1.0))


#: Where the points are, as shares of an interval.
POINTS = _points()
#: The same with the beginning of the interval in front.
NODES = np.concatenate([[0.0], POINTS])
_POWERS = np.linalg.inv(np.vander(NODES, increasing=True))


def values(at: Array) -> Array:
    """Collocation matrix (at, STAGES + 1) from a polynomial's node values to those at ``at``."""
    return np.asarray(np.vander(at, STAGES + 1, increasing=True) @ _POWERS)


def slopes(at: Array) -> Array:
    """Collocation matrix (at, STAGES + 1) from a polynomial's node values to slopes at ``at``."""
    powers = np.vander(at, STAGES + 1, increasing=True)
    grown = np.zeros_like(powers)
    grown[:, 1:] = powers[:, :-1] * np.arange(1, STAGES + 1)
    return np.asarray(grown @ _POWERS)


#: Derivatives at the points, shape (STAGES, STAGES + 1).
DERIVATIVE = slopes(POINTS)
#: Weights of the quadrature on the points, exact for polynomials of degree 4.
WEIGHTS = np.linalg.solve(np.vander(POINTS, increasing=True).T, 1.0 / np.arange(1, STAGES + 1))


def spread(mesh: Array) -> Array:
    """Collocation times of a mesh, each once, shape (STAGES * intervals + 1,)."""
    inner = mesh[:-1, None] + np.diff(mesh)[:, None] * POINTS
    return np.concatenate([mesh[:1], inner.ravel()])


def at_times(mesh: Array, states: Array, times: Array) -> tuple[Array, Array]:
    """States and rates at some times by the collocation polynomials of each interval.

    - ``mesh``: shape (K + 1,), s
    - ``states``: shape (STAGES * K + 1, nx), at `spread` of the mesh
    - ``times``: shape (N,), s
    - result: each of shape (N, nx)
    """
    interval = np.clip(np.searchsorted(mesh, times, side="right") - 1, 0, mesh.size - 2)
    width = np.diff(mesh)[interval]
    share = np.clip((times - mesh[interval]) / width, 0.0, 1.0)
    own = states[STAGES * interval[:, None] + np.arange(STAGES + 1)]
    found = np.einsum("nj,njx->nx", values(share), own)
    return found, np.einsum("nj,njx->nx", slopes(share), own) / width[:, None]
