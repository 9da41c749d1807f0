"""What outputs of a machine should do over time: smooth, at rest before and after."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from vpm.errors import ExperimentError, SimulationError
from vpm.experiment import Experiment
from vpm.numbers import Array, array_of

#: Derivatives that are zero at both ends of a motion from rest to rest: an inversion asks for two, splines add two.
FLAT = 4
#: Degree of splines through points; their second derivatives are zero at both ends.
DEGREE = 5


@dataclass(frozen=True, eq=False)
class TargetMotion:
    """A motion of outputs that begins and ends at rest.

    Attributes
    ----------
    duration : float
        s; the motion begins at zero.
    coefficients : ndarray, shape (order, pieces, m)
    breaks : ndarray, shape (pieces + 1,)
        Pieces of polynomials, highest power first, as ``scipy.interpolate.PPoly`` has them.
    """

    duration: float
    coefficients: Array
    breaks: Array

    @classmethod
    def rest_to_rest(cls, start: ArrayLike, end: ArrayLike, duration: float) -> TargetMotion:
        """Target from one value to another: the flattest polynomial of degree 9.

        Parameters
        ----------
        start, end : array_like, shape (m,)
            m or rad.
        duration : float
            s.

        Raises
        ------
        SimulationError
            A number is not finite, or the shapes differ.
        """
        from scipy.interpolate import BPoly, PPoly

        first, last = (np.atleast_1d(array_of(given, "the target", SimulationError)) for given in (start, end))
        if first.shape != last.shape or first.ndim != 1:
            raise SimulationError(f"a target from {first.shape} to {last.shape} numbers is none; give as many for both")
        if not (np.isfinite(duration) and duration > 0.0):
            raise SimulationError(f"a motion of {duration} s is not possible; give a positive time")
        _check_finite(np.stack([first, last]))
        still = [np.zeros_like(first)] * FLAT
        shape = BPoly.from_derivatives([0.0, duration], [[first, *still], [last, *still]])
        pieces = PPoly.from_bernstein_basis(shape)
        return cls(float(duration), np.asarray(pieces.c), np.asarray(pieces.x))

    @classmethod
    def through(cls, times: ArrayLike, points: ArrayLike) -> TargetMotion:
        """Target through points: a spline of degree 5 from rest to rest; the first time becomes zero.

        Parameters
        ----------
        times : array_like, shape (N,)
            s, ascending.
        points : array_like, shape (N, m)

        Raises
        ------
        SimulationError
            The times do not ascend, a number is not finite, or the shapes do not go together.
        """
        from scipy.interpolate import PPoly, make_interp_spline

        grid = array_of(times, "the times of the target", SimulationError)
        table = array_of(points, "the points of the target", SimulationError)
        if grid.ndim != 1 or len(grid) < 2 or table.shape[:1] != grid.shape or table.ndim > 2:
            raise SimulationError(
                f"times of shape {grid.shape} and points of shape {table.shape} make no target; "
                "give at least two times, and one row of points for each"
            )
        table = table.reshape(len(grid), -1)
        _check_finite(table)
        if not (np.isfinite(grid).all() and (np.diff(grid) > 0.0).all()):
            raise SimulationError("the times of a target have to ascend; sort them, and leave out what stands twice")
        ends: Any = ([(1, 0.0), (2, 0.0)],) * 2  # the stubs of SciPy know single conditions only
        splines: list[Any] = [make_interp_spline(grid - grid[0], column, k=DEGREE, bc_type=ends) for column in table.T]
        pieces = [PPoly.from_spline(spline) for spline in splines]
        knots = pieces[0].x
        inside = np.flatnonzero(np.diff(knots) > 0.0)
        coefficients = np.stack([piece.c[:, inside] for piece in pieces], axis=-1)
        return cls(float(grid[-1] - grid[0]), coefficients, np.append(knots[inside], knots[-1]))

    @classmethod
    def from_log(cls, experiment: Experiment, channels: Sequence[str]) -> TargetMotion:
        """Target motion that channels of a log show, through every sample.

        Raises
        ------
        ExperimentError
            The log lacks a channel.
        """
        for name in channels:
            if name not in experiment:
                raise ExperimentError(
                    f'channels: "{name}" is not in {experiment.name}, which holds {", ".join(experiment.channels)}'
                )
        return cls.through(experiment.time, np.column_stack([experiment[name] for name in channels]))

    @property
    def width(self) -> int:
        """Number of outputs of a target."""
        return int(self.coefficients.shape[2])

    def at(self, times: ArrayLike) -> tuple[Array, Array, Array]:
        """Target values with first and second derivatives, each of shape (N, m); held before and after.

        Parameters
        ----------
        times : array_like, shape (N,)
            s.
        """
        from scipy.interpolate import PPoly

        given = np.atleast_1d(np.asarray(times, dtype=np.float64))
        moving = ((given > 0.0) & (given < self.duration))[:, None]
        inside = np.clip(given, 0.0, self.duration)
        pieces = PPoly(self.coefficients, self.breaks)
        value, rate, second = (np.asarray(pieces(inside, order)) for order in range(3))
        return value, np.where(moving, rate, 0.0), np.where(moving, second, 0.0)

    def __repr__(self) -> str:
        return f"TargetMotion({self.width} outputs, {self.duration:.4g} s)"


def _check_finite(values: Array) -> None:
    if not np.isfinite(values).all():
        raise SimulationError("a target with numbers that are not finite cannot be followed; take them out")
