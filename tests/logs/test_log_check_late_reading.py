"""A flywheel on a stiff shaft whose encoder answers late: its error shows at the motor, which is lighter."""

import numpy as np
import pytest

import vpm
from runge_kutta import ahead
from vpm.experiment import Experiment
from vpm.numbers import Array

ROTOR, WHEEL, SHAFT, DAMPING, DRAG = 0.02, 0.34, 190.0, 0.25, 0.05
STEP, FINE, LATE = 1e-3, 4, 5
MODEL = vpm.Model.from_toml(f"""
name = "flywheel bench"
gravity = [0.0, 0.0, 0.0]
[bodies.rotor]
mass = 5.0
inertia = [0.03, {{ value = 0.0215, uncertainty = 2e-3 }}, 0.03, 0.0, 0.0, 0.0]
[bodies.flywheel]
mass = 30.0
inertia = [0.4, {{ value = 0.35, uncertainty = 0.03 }}, 0.4, 0.0, 0.0, 0.0]
[joints.motor]
type = "revolute"
parent = "world"
child = "rotor"
axis = [0.0, 1.0, 0.0]
[joints.wheel]
type = "revolute"
parent = "world"
child = "flywheel"
axis = [0.0, 1.0, 0.0]
[transmissions.shaft]
ratios = {{ motor = 1.0, wheel = -1.0 }}
[actuators.servo]
joint = "motor"
command_unit = "N m"
gain = 1.0
[[effects]]
type = "spring"
at = "shaft"
stiffness = {{ value = 180.0, uncertainty = 19.0 }}
[[effects]]
type = "viscous_friction"
at = "shaft"
viscous = {DAMPING}
[[effects]]
type = "viscous_friction"
at = "wheel"
viscous = {{ value = 0.045, uncertainty = 5e-3 }}
""")


def rates(state: Array, effort: float) -> Array:
    """Rates of the angles and speeds of motor and wheel."""
    twist, twisting = state[0] - state[1], state[2] - state[3]
    pull = SHAFT * twist + DAMPING * twisting
    return np.array([state[2], state[3], (effort - pull) / ROTOR, (pull - DRAG * state[3]) / WHEEL])


def turned(late: int) -> Experiment:
    """Record of 6 s, with the wheel's encoder so many samples late."""
    random, time = np.random.default_rng(3), STEP * np.arange(6000)
    effort = 6.0 * np.sin(0.9 * time) + 2.0 * np.sin(4.0 * time + 1.0) + 0.5 * np.sin(19.0 * time + 2.0)
    state, angles = np.zeros(4), np.empty((2, time.size))
    for sample, given in enumerate(effort):
        angles[:, sample] = state[:2]
        for _ in range(FINE):
            state = ahead(rates, state, STEP / FINE, float(given))
    angles[1] = np.concatenate([np.zeros(late), angles[1][: time.size - late]])
    angles += 2e-4 * random.standard_normal(angles.shape)
    signals = {"motor.position": angles[0], "wheel.position": angles[1], "servo.command": effort}
    return Experiment.from_arrays(time, signals, model=MODEL, name="bench")


def test_a_late_reading_is_not_taken_for_an_early_one_beside_it() -> None:
    """A sensor may be late, which a diagnosis names; that the other is early would be a mistake of the log."""
    found = [one for one in vpm.check_log(MODEL, turned(LATE), workers=1).findings if one.kind == "delay"]
    assert [(one.channels, one.mistake) for one in found] == [(("wheel.position",), False)]
    assert found[0].delay == pytest.approx(LATE * STEP, abs=0.25e-3)


def test_readings_in_time_are_not_corrected() -> None:
    assert not [one for one in vpm.check_log(MODEL, turned(0), workers=1).findings if one.kind == "delay"]
