"""Search for the Fourier series whose motion tells the parameters of a model best."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Literal

import numpy as np

from vpm.errors import ExcitationError, check_known
from vpm.excitation.base_parameters import base_parameters, free_names, parameter_scales, regressor
from vpm.excitation.excitation import check_positive, clock
from vpm.excitation.fourier import FourierTrajectory, at_rest, bound_grid, motion_at, within_limits
from vpm.excitation.limits import JointLimits
from vpm.model import Model
from vpm.numbers import Array

#: Called with (evaluations so far, criterion of the best motion so far).
Progress = Callable[[int, float], None]

#: What can be made least: the condition number, or the inverse of the determinant.
CRITERIA = ("condition", "determinant")


def fourier_trajectory(
    model: Model,
    limits: Mapping[str, JointLimits],
    *,
    period: float,
    time_step: float,
    harmonics: int = 5,
    free: Sequence[str] | None = None,
    criterion: Literal["condition", "determinant"] = "condition",
    starts: int = 20,
    evaluations: int = 1500,
    seed: int = 0,
    progress: Progress | None = None,
) -> FourierTrajectory:
    """Design of a Fourier trajectory that tells base parameters best, within limits.

    Every joint moves on a finite Fourier series that begins at rest (J. Swevers et al., "Optimal robot excitation and
    identification", *IEEE Trans. Robotics and Automation* 13, 1997). The regressor is the exact derivative of the
    inverse dynamics by the base parameters. The search takes the best of random motions and goes on by an evolution
    strategy with one parent and the step size of the one-fifth rule (H.-P. Schwefel, *Evolution and Optimum Seeking*,
    1995); every motion that is tried is scaled to its limits first, so that limits hold whenever the search ends.

    Parameters
    ----------
    model : Model
        Rigid links and ideal actuators. Its values are the guess that the design is for.
    limits : mapping of str to JointLimits
        One for each joint. Range, speed and acceleration hold at all times, also between samples, by a bound for
        trigonometric polynomials; efforts hold on a grid of 24 points for each period of the highest harmonic.
    period : float
        s, a whole number of time steps.
    time_step : float
        s.
    harmonics : int
        At least 3, because two conditions at rest take one of each kind.
    free : sequence of str, optional
        Parameters to be identified; by default those with an uncertainty.
    criterion : {"condition", "determinant"}
        The condition number of the regressor, which is least where all combinations of parameters are seen equally
        well; it falls too where what is seen well is seen less. The determinant (``1 / sqrt(det W'W)`` is made least,
        the volume of the region of confidence) rewards every parameter that is seen better.
    starts, evaluations : int
        Random motions to begin with, and motions tried in all.
    seed : int
        The same seed gives the same motion.
    progress : callable, optional
        Called with the evaluations so far and the best criterion; ``KeyboardInterrupt`` ends the search.

    Returns
    -------
    FourierTrajectory
        One period, with ``J.position``, ``J.velocity``, ``J.acceleration`` and ``J.effort`` of each joint.

    Raises
    ------
    ExcitationError
        A joint has no limits, the numbers allow no motion, or no motion stays within the efforts.
    SimulationError
        The model has elastic coordinates or actuators that are not ideal.
    """
    names = free_names(model, free)
    check_positive(period, "period")
    if criterion not in CRITERIA:
        raise ExcitationError(f'criterion="{criterion}" is not known; choose "condition" or "determinant"')
    base = base_parameters(model, names).names
    search = Worth(model, _limits_of(model, limits), period, harmonics, base, criterion)
    time = clock(period, time_step, whole=True)
    if harmonics < 3 or 2 * harmonics >= time.size:
        raise ExcitationError(
            f"{harmonics} harmonics in {time.size} samples cannot be; give at least 3 and fewer than {time.size // 2}"
        )
    if not 1 <= starts <= evaluations:
        raise ExcitationError(
            f"{starts} starts of {evaluations} evaluations cannot be; give 1 <= starts <= evaluations"
        )
    rng = np.random.default_rng(seed)
    first = [rng.standard_normal(search.size) for _ in range(starts)]
    costs = []
    for count, point in enumerate(first, 1):
        costs.append(search.cost(point))
        if progress is not None:
            progress(count, float(np.exp(min(costs))))
    best = _evolve(search, first[int(np.argmin(costs))], min(costs), rng, (starts, evaluations), progress)
    return _result(search, best, time, np.array([search.condition(*search.motion(point)) for point in first]))


def _evolve(
    search: Worth,
    start: Array,
    cost: float,
    rng: np.random.Generator,
    counts: tuple[int, int],
    progress: Progress | None,
) -> Array:
    """Evolve a design by one parent and one child; one in five steps succeeds."""
    parent, step = start, 0.5
    for count in range(counts[0] + 1, counts[1] + 1):
        child = parent + step * rng.standard_normal(search.size)
        found = search.cost(child)
        if found < cost:
            parent, cost, step = child, found, min(step * np.exp(0.8 / 3.0), 2.0)
        else:
            step = max(step * np.exp(-0.2 / 3.0), 1e-4)
        if progress is not None:
            progress(count, float(np.exp(cost)))
    return parent


def _result(search: Worth, best: Array, time: Array, starts: Array) -> FourierTrajectory:
    model, joints = search.model, search.model.joints
    offset, cosine, sine = _within_effort(search, *search.motion(best))
    states = motion_at(time, search.fundamental, offset, cosine, sine)
    effort = search.effort(*states)
    quantities = ("position", "velocity", "acceleration", "effort")
    channels = tuple(f"{joint}.{quantity}" for joint in joints for quantity in quantities)
    data = np.stack([*states, effort], axis=2).reshape(time.size, -1)
    condition = search.condition(offset, cosine, sine)
    note = (
        f"Condition number {condition:.4g} for {len(search.names)} base parameters; random motions within the same "
        f"limits have {np.median(starts):.4g} in the median."
    )
    return FourierTrajectory(
        name=f"{model.name} excitation",
        time=time,
        data=data,
        channels=channels,
        units=tuple(_units(model)),
        notes=(note,),
        joints=tuple(joints),
        offset=offset,
        cosine=cosine,
        sine=sine,
        fundamental=search.fundamental,
        parameters=search.names,
        criterion=search.criterion,
        condition=condition,
        start_conditions=starts,
    )


def _units(model: Model) -> list[str]:
    """Units of a design's channels, joint by joint."""
    units = []
    for joint in model.joints:
        base = model.channel_unit(f"{joint}.position")
        units += [base, f"{base}/s", f"{base}/s^2", model.channel_unit(f"{joint}.effort")]
    return units


def _within_effort(search: Worth, offset: Array, cosine: Array, sine: Array) -> tuple[Array, Array, Array]:
    """Designed motion, made smaller until its efforts hold."""
    if search.effort_share(offset, cosine, sine) <= 1.0:
        return offset, cosine, sine
    low, high = 0.0, 1.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        holds = search.effort_share(offset, middle * cosine, middle * sine) <= 1.0
        low, high = (middle, high) if holds else (low, middle)
    if low < 1e-3:
        share = search.effort_share(offset, 0.0 * cosine, 0.0 * sine)
        raise ExcitationError(
            f"{search.model.name}: at rest in the best position that was found the effort is {share:.3g} times its "
            "limit; allow more effort, or give a range in which the machine can hold itself"
        )
    return offset, low * cosine, low * sine


def _limits_of(model: Model, limits: Mapping[str, JointLimits]) -> list[JointLimits]:
    check_known(limits, model.joints, ExcitationError, f"{model.name} has no joint")
    for joint in model.joints:
        if joint not in limits:
            raise ExcitationError(f'the joint "{joint}" has no limits; give its range, speed and acceleration')
    return [limits[joint] for joint in model.joints]


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
