"""A planar arm with two links by the equations of a textbook, and its logs; nothing of the package is used.

Source: M. Spong, S. Hutchinson, M. Vidyasagar, *Robot Modeling and Control*, Wiley 2006, section 7.4: point masses at
the ends of light links of lengths l, angles q from the x axis, gravity along -y.
"""

from dataclasses import dataclass

import numpy as np

from runge_kutta import Array, moved

LENGTHS, MASSES, GAINS = (0.5, 0.4), (2.0, 1.0), (4.0, 2.5)
FILE = """
name = "textbook arm"
gravity = [0.0, -9.81, 0.0]
bodies.first = { mass = { value = 2.1, unit = "kg", uncertainty = 0.2, min = 0.0 }, center_of_mass = [0.5, 0.0, 0.0] }
bodies.second = { mass = { value = 0.95, unit = "kg", uncertainty = 0.1, min = 0.0 }, center_of_mass = [0.4, 0.0, 0.0] }
joints.one = { type = "revolute", parent = "world", child = "first", axis = [0.0, 0.0, 1.0] }
joints.two = { type = "revolute", parent = "first", child = "second", axis = [0, 0, 1], translation = [0.5, 0, 0] }
actuators.m1 = { joint = "one", gain = 4.0, command_unit = "A" }
actuators.m2 = { joint = "two", gain = 2.5, command_unit = "A" }
[channels]
time = { column = "t", unit = "s" }
"one.position" = { column = "q1", unit = "rad" }  # the encoder at the base
"two.position" = { column = "q2", unit = "rad" }
"m1.command" = { column = "i1", unit = "A" }
"m2.command" = { column = "i2", unit = "A" }
"""


@dataclass(frozen=True)
class Arm:
    """What is true of the machine beside its masses: dry friction (N m), strength of its drives, their delay (s)."""

    friction: tuple[float, float] = (0.0, 0.0)
    strength: float = 1.0
    delay: float = 0.0

    def accelerations(self, q: Array, v: Array, current: Array) -> Array:
        """Lagrange's equations of the textbook, solved."""
        (l1, l2), (m1, m2), g = LENGTHS, MASSES, 9.81
        both = m2 * l1 * l2
        mass = np.array(
            [
                [(m1 + m2) * l1**2 + m2 * l2**2 + 2.0 * both * np.cos(q[1]), m2 * l2**2 + both * np.cos(q[1])],
                [m2 * l2**2 + both * np.cos(q[1]), m2 * l2**2],
            ]
        )
        h = -both * float(np.sin(q[1]))
        swing = np.array([h * v[1] * (2.0 * v[0] + v[1]), -h * v[0] ** 2])
        lower = m2 * l2 * g * float(np.cos(q[0] + q[1]))
        weight = np.array([(m1 + m2) * l1 * g * np.cos(q[0]) + lower, lower])
        effort = self.strength * np.array(GAINS) * current - np.array(self.friction) * np.tanh(v / 0.02)
        return np.asarray(np.linalg.solve(mass, effort - swing - weight))


def log(arm: Arm, seed: int, *, seconds: float = 6.0, rate: float = 250.0, noise: float = 2e-5) -> dict[str, Array]:
    """Columns ``t``, ``q1``, ``q2`` (rad), ``i1``, ``i2`` (A) of a motion about a PD controller's reference."""
    drawn, dt, steps = np.random.default_rng(seed), 1.0 / rate, 8
    tones, phases = drawn.uniform(0.3, 1.2, (2, 3)), drawn.uniform(0.0, 2.0 * np.pi, (2, 3))
    time = np.arange(0.0, seconds, dt)

    def reference(t: float) -> Array:
        rise = 1.0 - float(np.exp(-t / 0.5))
        swings = np.sum(np.sin(2.0 * np.pi * tones * t + phases), axis=1)
        return np.asarray(np.array([-np.pi / 2.0, 0.3]) + rise * 0.25 * swings)

    q: Array = reference(0.0)
    v: Array = np.zeros(2)
    rows: list[Array] = []
    currents: list[Array] = [np.zeros(2)] * (1 + round(arm.delay / dt))
    for t in time:
        rows.append(q + noise * drawn.standard_normal(2))
        wanted = np.array([60.0, 40.0]) * (reference(t) - q) - np.array([8.0, 4.0]) * v
        currents.append(wanted / np.array(GAINS))
        current = currents[-1 - round(arm.delay / dt)]
        for _ in range(steps):
            q, v = moved(arm.accelerations, q, v, current, dt / steps)
    angles, sent = np.array(rows), np.array(currents[-len(time) :])
    return {"t": time, "q1": angles[:, 0], "q2": angles[:, 1], "i1": sent[:, 0], "i2": sent[:, 1]}


def text(columns: dict[str, Array]) -> str:
    """The log as a CSV file."""
    rows = "\n".join(",".join(f"{value:.9g}" for value in row) for row in zip(*columns.values(), strict=True))
    return f"{','.join(columns)}\n{rows}\n"
