"""A winch: a motor turns a drum, a load hangs from it on a springy rope; encoder at the drum, load cell at the load."""

from functools import lru_cache

import numpy as np

from runge_kutta import ahead
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.numbers import Array

G, RADIUS, INERTIA, LOAD = 9.81, 0.14, 1.8, 60.0
ROPE, ROPE_DAMPING = 2.6e4, 300.0
RESISTANCE, TORQUE_PER_AMPERE, LAG = 0.35, 3.84, 4e-3
STEP, FINE = 2e-3, 4
ENCODER, CELL = 2e-5, 1.0
MODEL = Model.from_toml(f"""
name = "winch"
gravity = [0.0, 0.0, -{G}]
[bodies.drum]
mass = 40.0
inertia = [1.8, {{ value = {INERTIA}, uncertainty = 0.2 }}, 1.8, 0.0, 0.0, 0.0]
[bodies.load]
mass = {{ value = 61.0, uncertainty = 1.0 }}
[joints.shaft]
type = "revolute"
parent = "world"
child = "drum"
axis = [0.0, 1.0, 0.0]
[joints.lift]
type = "prismatic"
parent = "world"
child = "load"
axis = [0.0, 0.0, 1.0]
[transmissions.rope]
ratios = {{ shaft = {RADIUS}, lift = -1.0 }}
[actuators.motor]
type = "dc_motor"
joint = "shaft"
resistance = {RESISTANCE}
time_constant = {LAG}
torque_constant = {TORQUE_PER_AMPERE}
[load_cells.cell]
joint = "lift"
[[effects]]
type = "spring"
at = "rope"
stiffness = {{ value = 2.4e4, uncertainty = 2.6e3 }}
[[effects]]
type = "viscous_friction"
at = "rope"
viscous = {ROPE_DAMPING}
""")


@lru_cache
def record(seed: int, dry: float = 0.0, begins: int = 0, samples: int = 2000) -> Experiment:
    """Record from the laws, held commands of a proportional speed loop, beginning at a sample in mid-motion.

    ``dry``: N m, friction of the drum.
    """
    random = np.random.default_rng(seed)
    time, phase = STEP * np.arange(samples), random.uniform(0.0, 2.0 * np.pi, 3)
    wanted = 2.0 * np.sin(1.3 * time + phase[0]) + 1.5 * np.sin(4.1 * time + phase[1]) + np.sin(9.0 * time + phase[2])
    state = np.array([7.0, 0.0, RADIUS * 7.0 - LOAD * G / ROPE, 0.0, RADIUS * LOAD * G / TORQUE_PER_AMPERE])
    angles, pulls, volts = np.empty((3, samples))
    for sample in range(samples):
        angles[sample], pulls[sample] = state[0], _pull(state)
        volts[sample] = 25.0 * (wanted[sample] - state[1]) + RESISTANCE * RADIUS * LOAD * G / TORQUE_PER_AMPERE
        for _ in range(FINE):
            state = ahead(_rates, state, STEP / FINE, volts[sample], dry)
    signals = {
        "shaft.position": angles + ENCODER * random.standard_normal(samples),
        "motor.command": volts,
        "cell.fz": pulls + CELL * random.standard_normal(samples),
    }
    kept = {name: values[begins:] for name, values in signals.items()}
    return Experiment.from_arrays(1000.0 + time[begins:], kept, model=MODEL, name=f"winch {seed}")


def _pull(state: Array) -> float:
    angle, speed, height, climb, _ = state
    return float(ROPE * (RADIUS * angle - height) + ROPE_DAMPING * (RADIUS * speed - climb))


def _rates(state: Array, volts: float, dry: float) -> Array:
    _, speed, _, climb, current = state
    pull = _pull(state)
    turning = TORQUE_PER_AMPERE * current - RADIUS * pull - dry * np.tanh(speed / 0.01)
    building = ((volts - TORQUE_PER_AMPERE * speed) / RESISTANCE - current) / LAG
    return np.array([speed, turning / INERTIA, climb, pull / LOAD - G, building])
