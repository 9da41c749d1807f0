"""A differential wrist by hand-derived Lagrange equations, integrated by SciPy: two motors turn pitch and roll.

The machine is that of ``examples/wrist``: a fork that pitches about y, a hand that rolls about x of the fork, and two
shafts with a rotor each that turn with 50 pitch plus or minus 40 roll. With m the mass of the hand, e how far its
centre hangs below the roll axis, a how far out that begins, and I its moments of inertia,

    T = (J + m (a^2 + e^2 c^2) + Iy c^2 + Iz s^2) p'^2 / 2 - m a e s p' r' + (m e^2 + Ix) r'^2 / 2 + rotors,
    V = -g (M b sin p + m (a sin p + e c cos p)),    c = cos r, s = sin r.
"""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy.integrate import solve_ivp

from places import EXAMPLES
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.numbers import Array

FILE = EXAMPLES / "wrist" / "wrist.toml"
GRAVITY = 9.81
SHAFTS = ("left", "right")
#: Turn of each motor per turn of each joint: rows are motors.
RATIOS = np.array([[50.0, 40.0], [50.0, -40.0]])
#: Torque per current, N m/A.
TORQUE = 0.03
STEP = 2e-3
#: Speed within which dry friction of joints turns round, rad/s.
JOINT_TRANSITION = 0.01
#: A line of the encoders, rad.
LINE = 2.0 * np.pi / 4096


@dataclass(frozen=True)
class Wrist:
    """Numbers of the machine, SI; of the motors one for each.

    The friction of a motor is ``viscous w + coulomb tanh(w/transition)``, ``w`` its speed.
    """

    fork: float = 1.2
    arm: float = 0.05
    about_pitch: float = 3e-3 + 1.2 * 0.05**2
    mass: float = 0.6
    reach: float = 0.12
    below: float = 0.06
    hand: tuple[float, float, float] = (1.2e-3, 1.0e-3, 0.5e-3)
    rotors: tuple[float, float] = (2e-6, 2e-6)
    viscous: tuple[float, float] = (1.5e-5, 1.5e-5)
    coulomb: tuple[float, float] = (0.0, 0.0)
    transition: float = 0.5
    of_joints: tuple[float, float] = (0.0, 0.0)

    def mass_matrix(self, q: Array) -> Array:
        """Of pitch and roll, with the rotors as ``R^T J R``."""
        c, s, (x, y, z) = np.cos(q[1]), np.sin(q[1]), self.hand
        pitch = self.about_pitch + self.mass * (self.reach**2 + (self.below * c) ** 2) + y * c**2 + z * s**2
        both = -self.mass * self.reach * self.below * s
        rigid = np.array([[pitch, both], [both, self.mass * self.below**2 + x]])
        return np.asarray(rigid + RATIOS.T @ np.diag(self.rotors) @ RATIOS)

    def bias(self, q: Array, v: Array) -> Array:
        """What the joints need at constant speed: products of rates, and gravity."""
        c, s, (_, y, z) = np.cos(q[1]), np.sin(q[1]), self.hand
        pitch_by_roll = -2.0 * (self.mass * self.below**2 + y - z) * s * c
        both_by_roll = -self.mass * self.reach * self.below * c
        pitch = pitch_by_roll * v[0] * v[1] + both_by_roll * v[1] ** 2
        pitch -= GRAVITY * (self.fork * self.arm + self.mass * self.reach) * np.cos(q[0])
        pitch += GRAVITY * self.mass * self.below * c * np.sin(q[0])
        roll = -0.5 * pitch_by_roll * v[0] ** 2 + GRAVITY * self.mass * self.below * s * np.cos(q[0])
        return np.array([pitch, roll])

    def friction(self, v: Array) -> Array:
        """On the joints, of the motors and of the joints themselves."""
        w = RATIOS @ v
        of_motors = np.array(self.viscous) * w + np.array(self.coulomb) * np.tanh(w / self.transition)
        return np.asarray(-RATIOS.T @ of_motors - np.array(self.of_joints) * np.tanh(v / JOINT_TRANSITION))

    def acceleration(self, q: Array, v: Array, torques: Array) -> Array:
        """Under torques of the motors."""
        loads = RATIOS.T @ torques + self.friction(v) - self.bias(q, v)
        return np.asarray(np.linalg.solve(self.mass_matrix(q), loads))

    def energy(self, q: Array, v: Array) -> float:
        """Kinetic and potential, J."""
        height = (self.fork * self.arm + self.mass * self.reach) * np.sin(q[0])
        height += self.mass * self.below * np.cos(q[1]) * np.cos(q[0])
        return float(0.5 * v @ self.mass_matrix(q) @ v - GRAVITY * height)

    def after(self, state: Array, torques: Array, time: float) -> Array:
        """State after a time under constant torques."""

        def rates(_: float, x: Array) -> Array:
            return np.concatenate([x[2:], self.acceleration(x[:2], x[2:], torques)])

        return np.asarray(solve_ivp(rates, (0.0, time), state, method="DOP853", rtol=1e-10, atol=1e-12).y[:, -1])


def times(count: int, step: float) -> Array:
    """Of so many samples, s."""
    return np.asarray(step * np.arange(count), dtype=np.float64)


def model(**changes: object) -> Model:
    """The wrist of the example; changes of its content by dotted keys with ``__`` for dots."""
    content = Model.load(FILE).to_dict()
    for way, value in changes.items():
        *sections, key = way.split("__")
        table = content
        for section in sections:
            table = table[section]
        table[key] = value
    return Model.from_dict(content)


@lru_cache
def moved(wrist: Wrist = Wrist(), seed: int = 0, duration: float = 6.0) -> Experiment:
    """Motor positions and currents of a wrist that a controller moves about, as an encoder and a drive log them."""
    random, samples = np.random.default_rng(seed), round(duration / STEP)
    phases = random.uniform(0.0, 2.0 * np.pi, (2, 3))
    time = times(samples, STEP)
    swing = [
        0.7 * np.sin(2.3 * time + phase[0])
        + 0.35 * np.sin(5.9 * time + phase[1])
        + 0.1 * np.sin(14.0 * time + phase[2])
        for phase in phases
    ]
    wanted = RATIOS @ np.array(swing) * np.minimum(time, 1.0)
    state, seen, currents, before = np.zeros(4), np.empty((samples, 2)), np.empty((samples, 2)), np.zeros(2)
    for k in range(samples):
        seen[k] = LINE * np.round(RATIOS @ state[:2] / LINE + random.uniform(-0.5, 0.5, 2))
        rate, before = (seen[k] - before) / STEP, seen[k]
        currents[k] = np.clip(0.15 * (wanted[:, k] - seen[k]) - 0.002 * rate, -4.0, 4.0)
        state = wrist.after(state, TORQUE * currents[k], STEP)
    channels = [f"{name}.position" for name in SHAFTS] + [f"{name}_motor.command" for name in SHAFTS]
    data = np.column_stack([seen, currents])
    return Experiment(f"wrist {seed}", time, data, tuple(channels), ("rad", "rad", "A", "A"))


#: A wrist whose right motor rubs by more than the file says.
RUBBING = replace(Wrist(), coulomb=(0.0, 4e-3))
