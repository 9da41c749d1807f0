"""What a motion is worth for the parameters of a model: the cost that the design of trajectories makes least."""

from __future__ import annotations

import numpy as np

from vpm.excitation.base_parameters import parameter_scales, regressor
from vpm.excitation.fourier import at_rest, bound_grid, motion_at, within_limits
from vpm.excitation.limits import JointLimits
from vpm.model import Model
from vpm.numbers import Array

#: Weight of an effort beyond its limit, in the logarithm of the criterion.
PENALTY = 20.0

#: Share of the way from the middle of the range to its ends that the offset may take.
OFFSET_SHARE = 0.8


class Worth:
    """Cost of a motion that is written as a vector: offset, cosines and sines of every joint, in no units."""

    def __init__(
        self,
        model: Model,
        limits: list[JointLimits],
        period: float,
        harmonics: int,
        names: tuple[str, ...],
        criterion: str,
    ) -> None:
        self.criterion = criterion
        self.model, self.limits, self.names = model, limits, names
        self.fundamental = 1.0 / period
        self.harmonics = max(harmonics, 1)
        self.size = len(limits) * (1 + 2 * self.harmonics)
        self._scales = parameter_scales(model, names)
        count, _ = bound_grid(self.harmonics)
        self._time = np.arange(count) * period / count
        efforts = np.array([limit.effort for limit in limits])
        self._largest = np.where(np.isfinite(efforts), efforts, 1.0)
        self._bounded = np.isfinite(efforts)

    def motion(self, point: Array) -> tuple[Array, Array, Array]:
        """Motion whose worth is computed: offset and coefficients, from rest and within limits."""
        table = point.reshape(len(self.limits), -1)
        low, high = np.array([limit.position for limit in self.limits]).T
        offset = 0.5 * (low + high) + 0.5 * OFFSET_SHARE * (high - low) * np.tanh(table[:, 0])
        cosine, sine = at_rest(table[:, 1 : 1 + self.harmonics], table[:, 1 + self.harmonics :])
        return offset, *within_limits(self.fundamental, offset, cosine, sine, self.limits)

    def cost(self, point: Array) -> float:
        """Worth of a motion: logarithm of the criterion, and a penalty for too large efforts."""
        shape = self.motion(point)
        excess = max(0.0, self.effort_share(*shape) - 1.0)
        values = self.singular_values(*shape)
        if values[-1] <= 0.0:
            return float("inf")
        # The determinant as the mean over the parameters, so that the penalty weighs the same in both.
        told = np.log(values[0] / values[-1]) if self.criterion == "condition" else -np.mean(np.log(values))
        return float(told) + PENALTY * excess

    def condition(self, offset: Array, cosine: Array, sine: Array) -> float:
        """Condition number of the scaled regressor over one period: a motion's worth."""
        values = self.singular_values(offset, cosine, sine)
        return float(values[0] / values[-1]) if values[-1] > 0.0 else float("inf")

    def singular_values(self, offset: Array, cosine: Array, sine: Array) -> Array:
        """Singular values behind a motion's worth, of the scaled regressor, the largest first."""
        states = motion_at(self._time, self.fundamental, offset, cosine, sine)
        columns = regressor(self.model, *states, self.names) * self._scales / self._largest[:, None]
        rows = columns.reshape(-1, len(self.names)) / np.sqrt(self._time.size)
        return np.asarray(np.linalg.svd(rows, compute_uv=False))

    def effort_share(self, offset: Array, cosine: Array, sine: Array) -> float:
        """Largest effort as a share of its limit, beside a motion's worth; zero where none is given."""
        if not self._bounded.any():
            return 0.0
        effort = self.effort(*motion_at(self._time, self.fundamental, offset, cosine, sine))
        return float(np.max(np.abs(effort[:, self._bounded]) / self._largest[self._bounded]))

    def effort(self, position: Array, velocity: Array, acceleration: Array) -> Array:
        """Efforts (N, n) that a motion needs, beside its worth."""
        inputs = np.zeros((len(position), len(self.model.inputs)))
        core, theta = self.model.core, self.model.theta
        return core.inverse_dynamics(theta, position, velocity, acceleration, inputs, 1.0, [])[0]
