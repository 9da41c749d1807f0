"""A two-link arm in gravity simulated without vpm: the textbook equations in closed form, ten steps to a sample.

Lagrange's equations of two links in a vertical plane (M. Spong, S. Hutchinson, M. Vidyasagar, *Robot Modeling and
Control*, section 6.4), angles counted downwards from the horizontal, driven by PD control with gravity feed-forward.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vpm.experiment import Experiment
from vpm.model import Model

Array = NDArray[np.float64]

DT, FINE, GRAVITY = 0.002, 10, 9.81
GAINS = np.array([5.0, 3.0])
PROPORTIONAL, DERIVATIVE = np.array([120.0, 60.0]), np.array([12.0, 5.0])

MODEL = """
name = "two-link arm"
gravity = [0.0, 0.0, -9.81]

[bodies.upper]
mass = 3.0
center_of_mass = [{ value = 0.20, unit = "m", uncertainty = 0.03, min = 0.05, max = 0.5 }, 0.0, 0.0]
inertia = [0.03, { value = 0.04, unit = "kg m^2", uncertainty = 0.02 }, 0.06, 0.0, 0.0, 0.0]

[bodies.lower]
mass = 2.0
center_of_mass = [{ value = 0.18, unit = "m", uncertainty = 0.03, min = 0.05, max = 0.5 }, 0.0, 0.0]
inertia = [0.02, { value = 0.03, unit = "kg m^2", uncertainty = 0.02 }, 0.04, 0.0, 0.0, 0.0]

[joints.shoulder]
type = "revolute"
parent = "world"
child = "upper"
axis = [0.0, 1.0, 0.0]

[joints.elbow]
type = "revolute"
parent = "upper"
child = "lower"
axis = [0.0, 1.0, 0.0]
translation = [0.4, 0.0, 0.0]

[actuators.first]
joint = "shoulder"
gain = { value = 5.0, unit = "N m/A" }
command_unit = "A"

[actuators.second]
joint = "elbow"
gain = { value = 3.0, unit = "N m/A" }
command_unit = "A"

[[effects]]
type = "viscous_friction"
at = "shoulder"
viscous = { value = 0.4, unit = "N m s/rad", uncertainty = 0.3 }

[[effects]]
type = "viscous_friction"
at = "elbow"
viscous = { value = 0.2, unit = "N m s/rad", uncertainty = 0.2 }
"""


@dataclass(frozen=True)
class Arm:
    """What the arm really is; zero means that the effect is not there. Drives are ``late`` by tenths of a sample."""

    masses: tuple[float, float] = (3.0, 2.0)
    centres: tuple[float, float] = (0.215, 0.17)
    inertias: tuple[float, float] = (0.045, 0.028)
    length: float = 0.4
    viscous: tuple[float, float] = (0.35, 0.25)
    coulomb: tuple[float, float] = (0.0, 0.0)
    bias: tuple[float, float] = (0.0, 0.0)
    delay: int = 0
    late: tuple[int, int] = (0, 0)
    noise: float = 2e-5

    def weight(self, q: Array) -> Array:
        """Effort that holds the arm still at ``q``."""
        (m1, m2), (c1, c2) = self.masses, self.centres
        second = m2 * c2 * np.cos(q[0] + q[1])
        return -GRAVITY * np.array([(m1 * c1 + m2 * self.length) * np.cos(q[0]) + second, second])

    def acceleration(self, q: Array, v: Array, effort: Array) -> Array:
        """Angular accelerations under an effort on the joints."""
        (m1, m2), (c1, c2), (i1, i2), length = self.masses, self.centres, self.inertias, self.length
        cosine, sine = np.cos(q[1]), np.sin(q[1])
        m22 = m2 * c2**2 + i2
        m12 = m22 + m2 * length * c2 * cosine
        m11 = m1 * c1**2 + i1 + m22 + m2 * (length**2 + 2.0 * length * c2 * cosine)
        turning = m2 * length * c2 * sine * np.array([-(2.0 * v[0] + v[1]) * v[1], v[0] ** 2])
        friction = np.array(self.viscous) * v + np.array(self.coulomb) * np.tanh(v / 1e-3) + np.array(self.bias)
        load = effort - turning - self.weight(q) - friction
        determinant = m11 * m22 - m12**2
        both = np.array([m22 * load[0] - m12 * load[1], m11 * load[1] - m12 * load[0]])
        return np.asarray(both / determinant, dtype=np.float64)


def midpoint(arm: Arm, q: Array, v: Array, effort: Array, step: float) -> tuple[Array, Array]:
    """One step of second order: what a step of first order gets wrong is more than the noise lets parameters be known.

    Efforts that lag by half a step pass for inertia and friction, 6e-4 N m s/rad and 3e-5 kg m² at a tenth of ``DT``.
    """
    slope = arm.acceleration(q + 0.5 * step * v, v + 0.5 * step * arm.acceleration(q, v, effort), effort)
    return q + step * v + 0.5 * step**2 * slope, v + step * slope


def record(arm: Arm, seconds: float, seed: int) -> Experiment:
    """One record of the arm following three sines on each joint."""
    generator = np.random.default_rng(seed)
    phase = generator.uniform(0.0, 2.0 * np.pi, (2, 3))
    frequency = np.array([[0.23, 0.51, 1.1], [0.31, 0.67, 1.3]])
    amplitude = np.array([[0.5, 0.25, 0.08], [0.6, 0.3, 0.1]])
    count = round(seconds / DT)
    time = DT * np.arange(count)
    ramp = np.clip(time, 0.0, 1.0) ** 2 * (3.0 - 2.0 * np.clip(time, 0.0, 1.0))
    waves = np.sum(amplitude[:, :, None] * np.sin(2.0 * np.pi * frequency[:, :, None] * time + phase[:, :, None]), 1)
    target = ramp * (waves - waves[:, :1])
    positions, commands = np.zeros((count, 2)), np.zeros((count, 2))
    q, v = np.zeros(2), np.zeros(2)
    before = q
    late = arm.delay * FINE + np.array(arm.late)
    for k in range(count):
        y = q + arm.noise * generator.standard_normal(2)
        speed, before = (y - before) / DT, y
        feedback = PROPORTIONAL * (target[:, k] - y) - DERIVATIVE * speed
        positions[k], commands[k] = y, (feedback + arm.weight(y)) / GAINS
        for step in range(FINE):
            held = np.diag(commands[np.maximum((k * FINE + step - late) // FINE, 0)])
            q, v = midpoint(arm, q, v, GAINS * held, DT / FINE)
    channels = {
        "shoulder.position": positions[:, 0],
        "elbow.position": positions[:, 1],
        "first.command": commands[:, 0],
        "second.command": commands[:, 1],
    }
    units = {name: "rad" if name.endswith("position") else "A" for name in channels}
    return Experiment.from_arrays(time, channels, units=units, name=f"arm {seed}")


def nominal() -> Model:
    """What its builder believes: centres, inertias and friction are off, and the hidden effects are missing."""
    return Model.from_toml(MODEL)
