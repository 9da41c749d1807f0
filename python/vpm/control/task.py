"""The equations of an inversion: a machine, inputs that move it, and as many outputs that follow a target."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from vpm.control.target import TargetMotion
from vpm.errors import SimulationError, check_known
from vpm.model import Model
from vpm.numbers import Array

#: Step of difference quotients of fourth order, rad or m: its fourth power is as small as what rounding leaves.
STEP = 1e-3
#: Axes of a marker's output.
AXES = {"x": 3, "y": 4, "z": 5}


class Answer(NamedTuple):
    """What the machine does to follow: accelerations (N, n), inputs (N, m), and derivatives of both by (q, v)."""

    acceleration: Array
    inputs: Array
    acceleration_by_state: Array


@dataclass(frozen=True, eq=False)
class Task:
    """A machine whose outputs follow a target, as many as there are inputs."""

    model: Model
    inputs: tuple[str, ...]  #: Actuators at work.
    outputs: tuple[str, ...]  #: Joints' positions, ``"joint_1.position"``, and markers' coordinates, ``"tip.x"``.

    def __post_init__(self) -> None:
        """Check the names of an inversion task."""
        refuse_loops(self.model, "a feed-forward")
        known = self.model.inputs
        check_known(self.inputs, known, SimulationError, "inputs:", "is unknown")
        if len(self.inputs) != len(self.outputs):
            raise SimulationError(
                f"the outputs ({', '.join(self.outputs)}) cannot be prescribed with the inputs "
                f"({', '.join(self.inputs)}); give one output for each input, or name the inputs at work"
            )
        possible = [f"{joint}.position" for joint in self.model.joints]
        possible += [f"{marker}.{axis}" for marker in self.model.markers for axis in AXES]
        check_known(self.outputs, possible, SimulationError, "output:", "cannot be prescribed")
        if self.model.core.n_states != 2 * len(self.model.coordinates):
            held = ", ".join(self.model.internal_names)
            raise SimulationError(
                f"{self.model.name}: drives with states of their own ({held}) cannot be inverted; "
                "give the model drives that deliver at once, and let theirs follow the force"
            )
        kinds = {name: self.model.actuator_type(name) for name in self.model.actuators}
        other = [f"{name} ({kind})" for name, kind in kinds.items() if kind != "ideal"]
        if other:
            raise SimulationError(
                f"{self.model.name}: {', '.join(other)} gives an effort that is not in proportion to its command, and "
                "a feed-forward would leave it out; take an effect in its place, such as a spring, or vpm.optimise"
            )

    # ---- the machine -------------------------------------------------------------------------------------------------

    @cached_property
    def columns(self) -> list[int]:
        """Places of a task's inputs among those of the model."""
        return [self.model.inputs.index(name) for name in self.inputs]

    def levers(self, q: Array) -> Array:
        """Efforts on all coordinates per unit of each task input (N, n, m)."""
        if self._constant is not None:
            return np.broadcast_to(self._constant, (len(q), *self._constant.shape))
        return np.array([self._lever(row) for row in q])

    @cached_property
    def _constant(self) -> Array | None:
        """Levers of a task where they are the same in two poses that no symmetry joins."""
        n = len(self.model.coordinates)
        poses = np.random.default_rng(1).uniform(-0.3, 0.3, (2, n))
        poses[:, len(self.model.joints) :] = 0.0
        first, second = (self._lever(pose) for pose in poses)
        same = np.abs(first - second).max() <= 1e-9 * np.abs(first).max()
        return first if same else None

    def _lever(self, q: Array) -> Array:
        n = len(q)
        _, by_inputs, _, _ = self.model.core.linearize(
            self.model.theta, np.concatenate([q, np.zeros(n)]), self.model.command()
        )
        return np.asarray(self.model.mass_matrix(q) @ by_inputs[n:][:, self.columns])

    # ---- the outputs -------------------------------------------------------------------------------------------------

    def values(self, q: Array) -> Array:
        """Outputs of a task that follow the target (N, m)."""
        poses = {name: self.model.forward_kinematics(name, q) for name in self._markers}
        columns = [
            q[:, self.model.joints.index(owner)] if end == "position" else poses[owner][:, AXES[end] - 3, 3]
            for owner, end in self._parts
        ]
        return np.column_stack(columns)

    def jacobian(self, q: Array) -> Array:
        """Derivative of a task's outputs by the coordinates (N, m, n)."""
        tables = {name: self.model.jacobian(name, q) for name in self._markers}
        unit = np.eye(q.shape[1])
        rows = [
            np.broadcast_to(unit[self.model.joints.index(owner)], q.shape)
            if end == "position"
            else tables[owner][:, AXES[end]]
            for owner, end in self._parts
        ]
        return np.stack(rows, axis=1)

    def curvature(self, q: Array) -> Array:
        """Second derivative of a task's outputs (N, m, n, n), by differences of exact Jacobians."""
        n = q.shape[1]
        if not self._markers:
            return np.zeros((len(q), len(self.outputs), n, n))

        def way(step: Array) -> Array:
            return self.jacobian(q + step) - self.jacobian(q - step)

        columns = [8.0 * way(step) - way(2.0 * step) for step in STEP * np.eye(n)]
        return np.stack(columns, axis=-1) / (12.0 * STEP)

    @cached_property
    def _parts(self) -> list[tuple[str, str]]:
        split = (name.rpartition(".") for name in self.outputs)
        return [(owner, end) for owner, _, end in split]

    @cached_property
    def _markers(self) -> list[str]:
        return list(dict.fromkeys(owner for owner, end in self._parts if end in AXES))

    # ---- the machine that follows ------------------------------------------------------------------------------------

    def follow(self, target: TargetMotion, times: Array, states: Array, stiffness: float) -> Answer:
        """Accelerations and inputs by which a task's outputs follow the target.

        Law: ``M a + h = B u``, ``J a + (dJ/dt) v = y_d'' + 2 k (y_d' - J v) + k^2 (y_d - y)``: input-output
        linearisation (A. Isidori, "Nonlinear Control Systems", 1995, section 5.1), whose errors die out at the rate
        ``k``, 1/s. Of the derivatives, what the levers and the curvature change by is left out.
        """
        model = self.model
        n, m = len(model.coordinates), len(self.outputs)
        q, v = states[:, :n], states[:, n:]
        value, rate, second = target.at(times)
        J, H, B = self.jacobian(q), self.curvature(q), self.levers(q)
        turning = np.einsum("kmij,kj->kmi", H, v)
        error, slip = self.values(q) - value, np.einsum("kmn,kn->km", J, v) - rate
        wanted = second - 2.0 * stiffness * slip - stiffness**2 * error - np.einsum("kmi,ki->km", turning, v)
        both = np.zeros((len(q), n + m, n + m))
        both[:, :n, :n], both[:, :n, n:], both[:, n:, :n] = model.mass_matrix(q), -B, J
        bias = model.inverse_dynamics(q, v, np.zeros_like(q))
        found = self._solved(both, np.concatenate([-bias, wanted], axis=1)[:, :, None], times)[:, :, 0]
        a, u = found[:, :n], found[:, n:]
        near = model.inverse_dynamics_derivatives(q, v, a)
        slope = np.zeros((len(q), n + m, 2 * n))
        slope[:, :n, :n], slope[:, :n, n:] = near.by_position, near.by_velocity
        slope[:, n:, :n] = np.einsum("kmij,kj->kmi", H, a) + 2.0 * stiffness * turning + stiffness**2 * J
        slope[:, n:, n:] = 2.0 * turning + 2.0 * stiffness * J
        by_state = -self._solved(both, slope, times)
        return Answer(a, u, by_state[:, :n])

    def _solved(self, both: Array, right: Array, times: Array) -> Array:
        try:
            found = np.linalg.solve(both, right)
        except np.linalg.LinAlgError:
            found = np.full(right.shape, np.nan)
        if not np.isfinite(found).all():
            bad = ~np.isfinite(found).reshape(len(found), -1).all(axis=1)
            at = float(times[bad][0])
            raise SimulationError(
                f"{self.model.name}: at {at:.4g} s the inputs do not move {', '.join(self.outputs)} independently, or "
                "the machine runs away; keep the motion off singular poses, or choose other outputs"
            )
        return np.asarray(found)


def task_of(model: Model, output: str | Sequence[str] | None, inputs: Sequence[str] | None) -> Task:
    """The task from what users name: by default all inputs, and the joints that they act on."""
    at_work = tuple(model.inputs if inputs is None else inputs)
    if isinstance(output, str):
        axes = tuple(f"{output}.{axis}" for axis in AXES)
        return Task(model, at_work, axes if output in model.markers else (output,))
    if output is not None:
        return Task(model, at_work, tuple(output))
    return Task(model, at_work, tuple(f"{joint}.position" for joint in model.joints))


def refuse_loops(model: Model, what: str) -> None:
    """Refuse a task of machines with closed loops, whose coordinates do not move one by one."""
    if model.loops:
        raise SimulationError(
            f"{model.name}: {what} is not known for machines with closed loops ({', '.join(model.loops)}); design it "
            "on model.linearize, which has the free coordinates alone"
        )
