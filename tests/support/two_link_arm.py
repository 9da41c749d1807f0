"""A two-link arm in gravity simulated without vpm: the textbook equations in closed form, ten steps to a sample.

Lagrange's equations of two links in a vertical plane (M. Spong, S. Hutchinson, M. Vidyasagar, *Robot Modeling and
Control*, section 6.4), angles counted downwards from the horizontal, driven by PD control with gravity feed-forward.
"""

from dataclasses import dataclass
from math import cos, sin, tanh

import numpy as np

from model_texts import two_links
from vpm.experiment import Experiment
from vpm.model import Model

Pair = tuple[float, float]

DT, FINE, GRAVITY = 0.002, 10, 9.81
GAINS = np.array([5.0, 3.0])
PROPORTIONAL, DERIVATIVE = np.array([120.0, 60.0]), np.array([12.0, 5.0])

UPPER = """mass = 3.0
center_of_mass = [{ value = 0.20, unit = "m", uncertainty = 0.03, min = 0.05, max = 0.5 }, 0.0, 0.0]
inertia = [0.03, { value = 0.04, unit = "kg m^2", uncertainty = 0.02 }, 0.06, 0.0, 0.0, 0.0]"""
LOWER = """mass = 2.0
center_of_mass = [{ value = 0.18, unit = "m", uncertainty = 0.03, min = 0.05, max = 0.5 }, 0.0, 0.0]
inertia = [0.02, { value = 0.03, unit = "kg m^2", uncertainty = 0.02 }, 0.04, 0.0, 0.0, 0.0]"""
MODEL = (
    two_links(UPPER, LOWER, "[0.4, 0.0, 0.0]", axis="[0.0, 1.0, 0.0]", gravity="[0.0, 0.0, -9.81]")
    + """
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
)


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

    def weight(self, q: Pair) -> Pair:
        """Effort that holds the arm still at ``q``."""
        (m1, m2), (c1, c2) = self.masses, self.centres
        second = -GRAVITY * m2 * c2 * cos(q[0] + q[1])
        return second - GRAVITY * (m1 * c1 + m2 * self.length) * cos(q[0]), second

    def acceleration(self, q: Pair, v: Pair, effort: Pair) -> Pair:
        """Angular accelerations under an effort on the joints."""
        (m1, m2), (c1, c2), (i1, i2), length = self.masses, self.centres, self.inertias, self.length
        coupling = m2 * length * c2
        m22 = m2 * c2**2 + i2
        m12 = m22 + coupling * cos(q[1])
        m11 = m1 * c1**2 + i1 + m22 + m2 * length**2 + 2.0 * coupling * cos(q[1])
        turning = coupling * sin(q[1])
        weights = self.weight(q)
        first = effort[0] + turning * (2.0 * v[0] + v[1]) * v[1] - weights[0] - self.friction(0, v[0])
        second = effort[1] - turning * v[0] ** 2 - weights[1] - self.friction(1, v[1])
        determinant = m11 * m22 - m12**2
        return (m22 * first - m12 * second) / determinant, (m11 * second - m12 * first) / determinant

    def friction(self, joint: int, speed: float) -> float:
        """Effort that a joint loses at a speed."""
        return self.viscous[joint] * speed + self.coulomb[joint] * tanh(speed / 1e-3) + self.bias[joint]


def midpoint(arm: Arm, q: Pair, v: Pair, effort: Pair, step: float) -> tuple[Pair, Pair]:
    """One step of second order: what a step of first order gets wrong is more than the noise lets parameters be known.

    Efforts that lag by half a step pass for inertia and friction, 6e-4 N m s/rad and 3e-5 kg m² at a tenth of ``DT``.
    """
    half, (a, b) = 0.5 * step, arm.acceleration(q, v, effort)
    there, then = (q[0] + half * v[0], q[1] + half * v[1]), (v[0] + half * a, v[1] + half * b)
    a, b = arm.acceleration(there, then, effort)
    after = q[0] + step * v[0] + half * step * a, q[1] + step * v[1] + half * step * b
    return after, (v[0] + step * a, v[1] + step * b)


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
    q: Pair = (0.0, 0.0)
    v: Pair = (0.0, 0.0)
    before = np.array(q)
    late = [arm.delay * FINE + tenths for tenths in arm.late]
    for k in range(count):
        y = np.array(q) + arm.noise * generator.standard_normal(2)
        speed, before = (y - before) / DT, y
        feedback = PROPORTIONAL * (target[:, k] - y) - DERIVATIVE * speed
        positions[k], commands[k] = y, (feedback + np.array(arm.weight((y[0], y[1])))) / GAINS
        for step in range(FINE):
            first, second = (
                float(GAINS[joint] * commands[max((k * FINE + step - late[joint]) // FINE, 0), joint])
                for joint in (0, 1)
            )
            q, v = midpoint(arm, q, v, (first, second), DT / FINE)
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
