"""What parameters do to the first state of a record: equilibria of flexible links, chambers at rest, sensors undone.

A simulation begins where a log suggests, and that depends on parameters: a softer link hangs lower before it is let go.
The core differentiates the steps that it takes; what the first state adds comes from differences here.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Share of a parameter, and of a state, by which they are moved; errors of the differences are its square.
DIFFERENCE = 1e-4


def first_state_slopes(
    begin: Callable[[Array], Array], theta: Array, columns: Sequence[int], fixed: Sequence[int] = ()
) -> dict[int, Array]:
    """Derivative of the first state by parameters, for those that move it.

    Parameters
    ----------
    begin : callable
        First state (nx,) at parameters.
    theta : ndarray
    columns : sequence of int
        Parameters in question.
    fixed : sequence of int
        States that nothing moves, because they are known or fitted.

    Returns
    -------
    dict
        ``{place in columns: derivative (nx,)}``.
    """
    found = {}
    for k, column in enumerate(columns):
        step, sides = DIFFERENCE * (abs(theta[column]) or 1.0), []
        for sign in (1.0, -1.0):
            moved = theta.copy()
            moved[column] += sign * step
            try:
                sides.append(begin(moved))
            except ValueError:  # no machine, or no equilibrium there
                break
        if len(sides) < 2:
            continue
        slope = (sides[0] - sides[1]) / (2.0 * step)
        slope[list(fixed)] = 0.0
        if np.any(slope):
            found[k] = slope
    return found


def add_first_state(
    jacobian: Array, outputs: Callable[[Array], Array], state: Array, slopes: dict[int, Array], theta: Array
) -> None:
    """Add what the first state does to outputs (n, channels) to their derivative (n, channels, k), in place.

    Parameters
    ----------
    jacobian : ndarray
    outputs : callable
        Outputs of a simulation from a first state.
    state : ndarray, shape (nx,)
    slopes : dict
        Of `first_state_slopes`.
    theta : ndarray, shape (k,)
        Parameters in question, for the size of the difference.
    """
    for k, slope in slopes.items():
        step = DIFFERENCE * (abs(theta[k]) or 1.0)
        ahead, behind = (outputs(state + sign * step * slope) for sign in (1.0, -1.0))
        jacobian[:, :, k] += (ahead - behind) / (2.0 * step)
