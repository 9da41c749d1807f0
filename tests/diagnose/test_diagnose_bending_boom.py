"""Diagnosis of a boom that bends on its cylinder: the ram's force depends on how it bends, so no efforts follow."""

import numpy as np
import pytest

import vpm
from vpm.experiment import Experiment
from vpm.ranking.settings import Settings
from vpm.ranking.substitute_records import shown, why_unbalanced
from vpm.ranking.tracked_records import TrackedRecords

STEP = 0.01
#: A jib of 6 m, which sways with some 2 Hz below its hook, luffed by a cylinder under its foot.
BOOM = vpm.Model.from_toml("""
name = "crane boom"
gravity = [0.0, 0.0, -9.81]
[bodies.foot]
mass = 60.0
center_of_mass = [0.3, 0.0, 0.0]
inertia = [2.0, 5.0, 5.0, 0.0, 0.0, 0.0]
[joints.luff]
type = "revolute"
parent = "world"
child = "foot"
axis = [0.0, -1.0, 0.0]
[beams.jib]
parent = "foot"
translation = [0.6, 0.0, 0.0]
rotation = [0.0, 1.5707963267948966, 0.0]
length = 6.0
level = "modal(1)"
deforms = ["bending_x"]
material = { young = 205e9, density = 7850 }
section = { shape = "tube", outer = 0.12, inner = 0.108 }
damping = { ratios = [0.02] }
[bodies.hook]
mass = { value = 40.0, uncertainty = 8.0 }
inertia = [0.5, 0.5, 0.5, 0.0, 0.0, 0.0]
[joints.clamp]
type = "fixed"
parent = "jib"
child = "hook"
[lines.ram]
from = { parent = "world", point = [0.25, 0.0, -0.9] }
to = { parent = "foot", point = [0.6, 0.0, -0.08] }
[supplies.pump]
pressure = { value = 180.0, unit = "bar" }
tank_pressure = { value = 2.0, unit = "bar" }
oil = { bulk_modulus = 1.2e9 }
[actuators.valve]
type = "hydraulic"
line = "ram"
supply = "pump"
command_unit = "V"
retracted_length = 0.6
friction = { viscous = 1500.0 }
[actuators.valve.valve]
flow_gain = 4.7e-8
stroke = 10.0
spool = "static"
[actuators.valve.cylinder]
bore = 0.05
rod = 0.028
stroke = 0.7
line_a = 2e-4
line_b = 2e-4
""")
DRY = 400.0


def lifted(seed: int) -> Experiment:
    """Record of a boom with dry friction at its pin, by the laws of the package in tenths of a step."""
    random, time = np.random.default_rng(seed), STEP * np.arange(500)
    phase = random.uniform(0.0, 2.0 * np.pi, 2)
    volts = np.minimum(time, 1.0) * (3.0 * np.sin(1.5 * time + phase[0]) + 2.0 * np.sin(4.0 * time + phase[1]))
    signals = {"valve.command": volts, "luff.position": np.full_like(time, 0.4)}
    machine = BOOM.with_effect("coulomb_friction", "luff", coulomb=DRY).with_parameters({"hook.mass": 43.0})
    asked = Experiment.from_arrays(time, signals, model=BOOM, name=f"lift {seed}")
    run = vpm.simulate(machine, asked, substeps=10)
    noise = {"luff.position": 2e-5, "valve.pressure_a": 1e4, "valve.pressure_b": 1e4}
    read = {name: run[name] + size * random.standard_normal(time.size) for name, size in noise.items()}
    return Experiment.from_arrays(time, {"valve.command": volts, **read}, model=BOOM, name=f"lift {seed}")


def test_a_ram_answers_to_how_its_boom_bends() -> None:
    """Its substitute machine is rigid, with efforts as large as the weight of the boom."""
    assert "the actuator valve answers to the bending of jib" in why_unbalanced(BOOM)
    assert why_unbalanced(BOOM.at("rigid")) == ""
    record = lifted(1)
    problem = shown(BOOM, TrackedRecords(BOOM, [record], Settings(), None))
    _, applied, required = problem.effort(BOOM, BOOM.theta, 0)
    tube = 7850.0 * np.pi / 4.0 * (0.12**2 - 0.108**2) * 6.0
    weight = 9.81 * (60.0 * 0.3 + tube * 3.6 + 40.0 * 6.6) * np.mean(np.cos(record["luff.position"]))
    for efforts in (applied, required):
        assert np.mean(efforts[:, 0]) == pytest.approx(weight, rel=0.1)


def test_friction_of_its_pin_is_named() -> None:
    """Of friction, a load and a leak: 400 N m beside a weight of 4 kN m."""
    tried = ["coulomb_friction", "bias_force", "internal_leakage"]
    why = vpm.diagnose(BOOM, lifted(1), lifted(2), effects=tried, check=False)
    assert [(one.name, one.site) for one in why.effects] == [("coulomb_friction", "luff")]
    assert why.model.parameters["luff.friction.coulomb"].value == pytest.approx(DRY, rel=0.03)
    assert any("answers to the bending of jib" in note for note in why.notes)
