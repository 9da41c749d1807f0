"""Residuals of effort relative to the effort that the drives deliver, where parameters of the drives are free.

A balance of effort gets smaller with the gain of its drives: the least sum of squares belongs to a machine without
forces. The commands were measured, not the efforts. Their density is that of the residual times the derivative of
effort by command, and what maximises it makes the residual least in units of the delivered effort (J. Nocedal and S.
Wright, *Numerical Optimization*, 2nd ed., 10.4, for errors of what was measured; G. Seber and C. Wild, *Nonlinear
Regression*, 2003, 2.8, for the determinant that a change of variables brings).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from vpm.identify.balance import InverseDynamicsProblem
from vpm.model import Model

Array = NDArray[np.float64]

#: Share of a parameter by which it is moved to see what it does to the size of efforts; the error is its square.
DIFFERENCE = 1e-4


class RelativeProblem(InverseDynamicsProblem):
    """A balance of effort, each joint divided by what its drives deliver over what they delivered before the fit.

    Parameters
    ----------
    data : InverseDynamicsProblem
    drives : sequence of str
        Parameters that change what drives deliver.
    """

    def __init__(self, data: InverseDynamicsProblem, drives: Sequence[str]) -> None:
        vars(self).update(vars(data))
        self._drives = tuple(drives)
        self._before = self._strengths(data.nominal, data.nominal.theta)

    def evaluate(
        self, model: Model, theta: Array, columns: Sequence[int] = (), origin: Array | None = None
    ) -> tuple[Array, Array]:
        """Residual and its derivative, relative to the delivered effort; see :class:`Problem`.

        So is what is expected: where all forces are larger, that is as well.
        """
        residual, jacobian = super().evaluate(model, theta, columns, origin)
        residual = residual + self.expected
        strengths = self._strengths(model, theta)
        slopes = {
            place: self._slope(model, theta, column) / strengths
            for place, column in enumerate(columns)
            if model.parameter_names[column] in self._drives
        }
        for record in range(len(self.motions)):
            for joint, block in enumerate(self.efforts(record)):
                rows, ratio = block.samples, self._before[joint] / strengths[joint]
                residual[rows] *= ratio
                jacobian[rows] *= ratio
                for place, slope in slopes.items():
                    jacobian[rows, place] -= residual[rows] * slope[joint]
        return residual - self.expected, jacobian

    def _strengths(self, model: Model, theta: Array) -> Array:
        """Size of what drives deliver at each joint; 1 where that is nothing, as at joints without a drive."""
        strengths = self.strengths(model, theta)
        return np.where(strengths > 0.0, strengths, 1.0)

    def _slope(self, model: Model, theta: Array, column: int) -> Array:
        """Derivative of the strengths by one parameter."""
        step, sides = DIFFERENCE * (abs(theta[column]) or 1.0), []
        for sign in (1.0, -1.0):
            moved = theta.copy()
            moved[column] += sign * step
            sides.append(self._strengths(model, moved))
        return np.asarray((sides[0] - sides[1]) / (2.0 * step))


def relative_to_drives(
    model: Model, data: InverseDynamicsProblem, free: Sequence[str], ties: Mapping[str, str]
) -> InverseDynamicsProblem:
    """The balance relative to what drives deliver, if a parameter of a drive is free that nothing logged holds.

    Pressures of a cylinder hold its areas and valves. A current holds no torque constant.
    """
    moved = {*free, *(follower for follower, leader in ties.items() if leader in free)}
    held = {channel.partition(".pressure")[0] for channel in data.shown if ".pressure" in channel}
    drives = [name for name in model.actuators if name not in held]
    mine = [name for name in sorted(moved) if name.partition(".")[0] in drives]
    return RelativeProblem(data, mine) if mine else data
