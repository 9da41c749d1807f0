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


#: Mass, kg, drag, N s/m, and the ripple of an axis that never creeps.
TABLE, DRAG = 10.0, 20.0
LEAD, IN_PHASE, ACROSS = 0.004, 0.3, 0.4  # m, N
AXIS = """
    name = "axis"
    gravity = [0.0, 0.0, 0.0]
    bodies.table = { mass = { value = 9.0, unit = "kg", uncertainty = 1.0 } }
    joints.axis = { type = "prismatic", parent = "world", child = "table", axis = [1, 0, 0] }
    actuators.drive = { joint = "axis", gain = { value = 1.05, uncertainty = 0.05 }, command_unit = "N" }
    [[effects]]
    type = "viscous_friction"
    at = "axis"
    viscous = { value = 18.0, unit = "N s/m", uncertainty = 5.0 }
"""


def moved(seed: int) -> Experiment:
    """Motion 0.3 m from the zero position that passes up to 18 waves/s, and the force by the closed form."""
    random, time = np.random.default_rng(seed), np.arange(0.0, 6.0, 2.5e-3)
    sizes, turns = np.array([0.02, 0.006, 0.003]), 2.0 * np.pi * np.array([0.3, 0.7, 1.3])
    angles = turns * time[:, None] + random.uniform(0.0, 6.0, 3)
    q = 0.3 + np.sin(angles) @ sizes
    force = -TABLE * np.sin(angles) @ (sizes * turns**2) + DRAG * np.cos(angles) @ (sizes * turns)
    force += IN_PHASE * np.cos(2.0 * np.pi * q / LEAD) + ACROSS * np.sin(2.0 * np.pi * q / LEAD)
    noise = random.normal(0.0, (1e-6, 0.02), (time.size, 2)).T
    values = {"axis.position": q + noise[0], "drive.command": force + noise[1]}
    return Experiment.from_arrays(time, values, {"axis.position": "m", "drive.command": "N"})


def test_a_ripple_faster_than_the_band_of_exact_accelerations_is_named() -> None:
    """All forces are known but for one factor, of which the file says 5 %: that of the ripple is that of the mass."""
    model, setup = vpm.Model.from_toml(AXIS), vpm.Setup(hold="first_order")
    why = vpm.diagnose(model, moved(1), moved(2), effects=["torque_ripple"], setup=setup, check=False, workers=1)
    assert [(effect.name, effect.site) for effect in why.effects] == [("torque_ripple", "axis")]
    values = {name: parameter.value for name, parameter in why.model.parameters.items()}
    assert values["axis.ripple.period"] == pytest.approx(LEAD, rel=1e-3)
    ripple = np.hypot(values["axis.ripple.cosine"], values["axis.ripple.sine"])
    assert ripple / values["table.mass"] == pytest.approx(np.hypot(IN_PHASE, ACROSS) / TABLE, rel=0.01)
    assert values["drive.gain"] == pytest.approx(1.0, abs=0.1)  # two stated uncertainties
