"""A joint that a motor drives by its voltage: its torque constant, inertia and friction grow together unseen."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import vpm
from vpm.experiment import Experiment
from vpm.model import Model

RESISTANCE, CONSTANT, RATIO, ARM, DRY = 1.2, 0.05, 30.0, 0.30, 0.8  # Ohm, N m/A, 1, kg m^2, N m
STEP, COUNT = 0.004, 2000

#: Twice the torque constant would turn twice the inertia in the same way, against a friction that takes the rest of
#: what the voltage of the motor itself brakes.
FILE = f"""
name = "turntable"
gravity = [0.0, 0.0, 0.0]
[bodies.table]
mass = 5.0
inertia = [0.2, 0.2, {{ value = 0.27, uncertainty = 0.04 }}, 0.0, 0.0, 0.0]
[joints.hub]
type = "revolute"
parent = "world"
child = "table"
axis = [0.0, 0.0, 1.0]
[actuators.motor]
type = "dc_motor"
joint = "hub"
resistance = {RESISTANCE}
time_constant = 1e-4
torque_constant = {{ value = 0.046, uncertainty = 0.005 }}
gear_ratio = {RATIO}
rotor_inertia = {{ value = 1e-6, uncertainty = 1e-6 }}
[[effects]]
type = "viscous_friction"
at = "hub"
viscous = {{ value = 0.2, uncertainty = 0.2 }}
"""


@cache
def turned(seed: int, dry: float = DRY) -> Experiment:
    """Record of the table under a held voltage; its rotor weighs nothing, and its bearing rubs."""
    rng = np.random.default_rng(seed)
    time = STEP * np.arange(COUNT)
    tones = [(5.0, 0.25), (3.0, 0.7), (2.0, 1.6)]
    voltage = sum(a * np.sin(2.0 * np.pi * f * time + rng.uniform(0.0, 2.0 * np.pi)) for a, f in tones)

    def move(_: float, x: np.ndarray, u: float) -> list[float]:
        torque = RATIO * CONSTANT * (u - CONSTANT * RATIO * x[1]) / RESISTANCE
        return [x[1], (torque - 0.1 * x[1] - dry * np.tanh(x[1] / 0.02)) / ARM]

    states = [np.zeros(2)]
    for u in voltage[:-1]:
        states.append(solve_ivp(move, (0.0, STEP), states[-1], args=(u,), rtol=1e-8, atol=1e-10).y[:, -1])
    angle = np.array(states)[:, 0] + 2e-5 * rng.standard_normal(COUNT)
    values = {"motor.command": voltage, "hub.position": angle}
    return Experiment.from_arrays(time, values, model=Model.from_toml(FILE), name=f"table {seed}")


def test_a_fit_passes_a_bound_of_its_drive() -> None:
    """The rotor's inertia is zero: a fit rests on that bound, where no smaller value makes a machine."""
    free = ["motor.torque_constant", "motor.rotor_inertia"]
    known = {"table.inertia.zz": ARM + 0.002, "hub.friction.viscous": 0.1}
    fit = vpm.identify(Model.from_toml(FILE).with_parameters(known), turned(1, 0.0), free=free)
    assert fit["motor.rotor_inertia"] == pytest.approx(0.0, abs=1e-7)
    assert fit["motor.torque_constant"] == pytest.approx(CONSTANT, rel=0.01)


def test_a_size_is_known_as_well_as_the_constant_of_its_motor() -> None:
    model, tried = Model.from_toml(FILE), ["coulomb_friction", "bias_force", "spring", "dead_zone"]
    why = vpm.diagnose(model, turned(1), turned(2), effects=tried, check=False, workers=1)
    assert why.verdict == "effect_found"
    assert [(one.name, one.site) for one in why.effects] == [("coulomb_friction", "hub")]
    found = why.model.parameters
    share = found["motor.torque_constant"].value / CONSTANT
    assert found["hub.friction.coulomb"].value == pytest.approx(share * DRY, rel=0.05)
    assert found["table.inertia.zz"].value == pytest.approx(share * ARM, rel=0.05)
