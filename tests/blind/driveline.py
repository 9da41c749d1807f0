"""Joints with their drives: rotor, gear with play or compliance, and the links behind, many cases side by side.

Steps are those of a leapfrog: positions by half a step, forces there with the velocity extrapolated to the middle,
velocities by a whole step, dry friction as an impulse that at most stops the joint, positions by the other half. It is
of second order where nothing sticks or hits.
"""

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from blind.loads import Array, Column, JointLoads, clip, stack

#: Sweeps over the joints in which their impulses of dry friction settle; they start from those of the step before.
SWEEPS = 4


class Links(Protocol):
    """What hangs behind the joints."""

    def inertia(self, q: Array) -> tuple[Array, ...]:
        """Mass matrix: (m11,) of one joint or (m11, m12, m22) of two, each of shape (columns,)."""

    def load(self, q: Array, v: Array) -> Array:
        """Effort that the links need without acceleration: gravity and velocity terms, shape (joints, columns)."""


class Driveline:
    """Motion of one or two joints; the encoder sits at the motor."""

    def __init__(self, joints: Sequence[str], columns: Sequence[Column], links: Links, step: float) -> None:
        shape = (len(joints), len(columns))
        self.links, self.step = links, step
        self.loads = JointLoads(joints, columns, step)
        self.rotor = stack(columns, joints, "rotor") + stack(columns, joints, "rotor_inertia.inertia")
        compliance = stack(columns, joints, "joint_compliance.stiffness")
        play = stack(columns, joints, "backlash.stiffness")
        self.stiffness = compliance + play
        self.damping = stack(columns, joints, "joint_compliance.damping") + stack(columns, joints, "backlash.damping")
        self.half_gap = 0.5 * stack(columns, joints, "backlash.gap")
        self.soft = self.stiffness > 0.0
        self.any_soft, self.any_play = bool(self.soft.any()), bool(self.half_gap.any())
        self.q, self.v, self.a = stack(columns, joints, "start"), np.zeros(shape), np.zeros(shape)
        self.motor_q, self.motor_v, self.motor_a = self.q, self.v, self.a
        self.impulse = np.zeros(shape)
        self.diagonal = np.where(self.soft, 0.0, self.rotor)
        self.safe_rotor = np.where(self.soft, self.rotor, 1.0)

    @property
    def encoder(self) -> Array:
        """True position of the motors, in coordinates of the joints."""
        return self.motor_q

    def gear(self, twist: Array, rate: Array) -> Array:
        """Effort through a soft gear; within the play there is none, and a contact only pushes."""
        if not self.any_play:
            return self.stiffness * twist + self.damping * rate
        beyond = twist - clip(twist, -self.half_gap, self.half_gap)
        effort = self.stiffness * beyond + self.damping * rate
        pushing = (self.half_gap == 0.0) | (effort * beyond > 0.0)
        return np.where(pushing, effort, 0.0)

    def advance(self, effort: Array, time: float) -> None:
        """One step under an effort of the drives, shape (joints, columns)."""
        h = self.step
        half = 0.5 * h
        q, v = self.q + half * self.v, self.v + half * self.a
        if self.any_soft:
            motor_q, motor_v = self.motor_q + half * self.motor_v, self.motor_v + half * self.motor_a
        else:
            motor_q, motor_v = q, v
        middle = time + half
        push = effort - self.loads.smooth(motor_q, motor_v, middle, effort)
        dry = self.loads.dry(motor_q, motor_v, middle, effort)
        drive = push
        if self.any_soft:
            through = self.gear(motor_q - q, motor_v - v)
            drive = np.where(self.soft, through, push)
            new_motor = self.motor_v + h * (push - through) / self.safe_rotor
            if dry is not None:
                brake = h * dry / self.safe_rotor
                new_motor = new_motor - clip(new_motor, -brake, brake)
        limit = None if dry is None else h * np.where(self.soft, 0.0, dry)
        new = self._velocities(q, h * (drive - self.links.load(q, v)), limit)
        self.a = (new - self.v) / h
        self.q, self.v = q + half * new, new
        if self.any_soft:
            new_motor = np.where(self.soft, new_motor, new)
            self.motor_a = (new_motor - self.motor_v) / h
            self.motor_q, self.motor_v = np.where(self.soft, motor_q + half * new_motor, self.q), new_motor
        else:
            self.motor_q, self.motor_v, self.motor_a = self.q, self.v, self.a

    def _velocities(self, q: Array, impulse: Array, limit: Array | None) -> Array:
        """Velocities after an impulse, with dry friction impulses of at most ``limit``."""
        inertia = self.links.inertia(q)
        if len(inertia) == 1:
            mass = inertia[0] + self.diagonal
            free = self.v + impulse / mass
            if limit is None:
                return np.asarray(free)
            brake = limit / mass
            return np.asarray(free - clip(free, -brake, brake))
        m11, m12, m22 = inertia[0] + self.diagonal[0], inertia[1], inertia[2] + self.diagonal[1]
        determinant = m11 * m22 - m12 * m12
        w11, w12, w22 = m22 / determinant, -m12 / determinant, m11 / determinant
        first, second = self.v[0] + w11 * impulse[0] + w12 * impulse[1], self.v[1] + w12 * impulse[0] + w22 * impulse[1]
        if limit is None:
            return np.array([first, second])
        one, two = clip(self.impulse, -limit, limit)
        first, second = first + w11 * one + w12 * two, second + w12 * one + w22 * two
        for _ in range(SWEEPS):
            change = clip(one - first / w11, -limit[0], limit[0]) - one
            one, first, second = one + change, first + w11 * change, second + w12 * change
            change = clip(two - second / w22, -limit[1], limit[1]) - two
            two, first, second = two + change, first + w12 * change, second + w22 * change
        self.impulse = np.array([one, two])
        return np.array([first, second])


class Driven(Driveline):
    """The driveline with the gains of its drives."""

    def __init__(
        self, joints: Sequence[str], columns: Sequence[Column], links: Links, step: float, gain: Array
    ) -> None:
        super().__init__(joints, columns, links, step)
        self.gain = gain

    def outputs(self) -> Array:
        return self.encoder

    def advance(self, command: Array, time: float) -> None:
        super().advance(self.gain * command, time)
