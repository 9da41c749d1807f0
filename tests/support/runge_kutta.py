"""The classical method of Runge and Kutta, with which witnesses move their machines."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def ahead(rates: Callable[..., Array], state: Array, step: float, *held: object) -> Array:
    """State after a step."""
    a = rates(state, *held)
    b = rates(state + 0.5 * step * a, *held)
    c = rates(state + 0.5 * step * b, *held)
    return state + step / 6.0 * (a + 2.0 * b + 2.0 * c + rates(state + step * c, *held))


def moved(
    accelerations: Callable[[Array, Array, Array], Array], q: Array, v: Array, effort: Array, h: float
) -> tuple[Array, Array]:
    """Place and speed after a step ``h`` under an effort that is held."""
    first = accelerations(q, v, effort)
    second = accelerations(q + 0.5 * h * v, v + 0.5 * h * first, effort)
    third = accelerations(q + 0.5 * h * v + 0.25 * h * h * first, v + 0.5 * h * second, effort)
    last = accelerations(q + h * v + 0.5 * h * h * second, v + h * third, effort)
    return q + h * v + h * h / 6.0 * (first + second + third), v + h / 6.0 * (first + 2.0 * second + 2.0 * third + last)
