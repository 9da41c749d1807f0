"""A ripple with hundreds of waves on the way: only where the shaft is slow do the samples show it."""

from __future__ import annotations

import numpy as np
import pytest

import vpm
from vpm.experiment import Experiment

INERTIA, FRICTION = 2e-3, 1e-3  # kg m^2, N m s/rad
PERIOD, COSINE, SINE = 2.0 * np.pi / 12.0, 0.008, -0.005  # rad, N m

SHAFT = """
    name = "shaft"
    gravity = [0.0, 0.0, 0.0]
    [bodies.rotor]
    mass = 1.0
    inertia = [0.002, 0.002, { value = 0.0022, unit = "kg m^2", uncertainty = 0.0004 }, 0.0, 0.0, 0.0]
    [joints.shaft]
    type = "revolute"
    parent = "world"
    child = "rotor"
    axis = [0.0, 0.0, 1.0]
    [actuators.drive]
    joint = "shaft"
    gain = 1.0
    command_unit = "N m"
    [[effects]]
    type = "viscous_friction"
    at = "shaft"
    viscous = 0.001
"""


def record() -> Experiment:
    """Turns of the shaft over 240 waves, at 60 waves/s in the mean, and the torque by the closed form."""
    random, time = np.random.default_rng(6), 2e-3 * np.arange(8000)
    sizes, turns = np.array([45.0, 20.0]), np.array([0.9, 2.3])
    angles = turns * time[:, None] + np.array([0.3, 1.1])
    q = (sizes * np.sin(angles)).sum(1)
    w, a = (sizes * turns * np.cos(angles)).sum(1), -(sizes * turns**2 * np.sin(angles)).sum(1)
    phase = 2.0 * np.pi * q / PERIOD
    torque = INERTIA * a + FRICTION * w + COSINE * np.cos(phase) + SINE * np.sin(phase)
    torque += random.normal(scale=2e-3, size=time.size)
    values = {"shaft.position": q + random.normal(scale=1e-6, size=time.size), "drive.command": torque}
    return Experiment.from_arrays(time, values, {"shaft.position": "rad", "drive.command": "N m"})


def test_a_ripple_of_hundreds_of_waves_is_named_with_its_period() -> None:
    effects = ["torque_ripple", "coulomb_friction", "spring"]
    why = vpm.diagnose(vpm.Model.from_toml(SHAFT), record(), effects=effects, check=False, workers=1)
    assert [(effect.name, effect.site) for effect in why.effects] == [("torque_ripple", "shaft")]
    values = {name: parameter.value for name, parameter in why.model.parameters.items()}
    assert values["shaft.ripple.period"] == pytest.approx(PERIOD, rel=1e-3)
    assert values["shaft.ripple.cosine"] == pytest.approx(COSINE, abs=1e-3)
    assert values["shaft.ripple.sine"] == pytest.approx(SINE, abs=1e-3)
