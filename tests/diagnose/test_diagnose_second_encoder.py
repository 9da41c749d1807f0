"""Axes whose load has an encoder of its own: the way between both is logged as a deflection."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import vpm

#: Masses before and behind the screw (kg), its stiffness (N/m) and damping (N s/m), friction of both sides (N).
MOTOR, TABLE, STIFFNESS, DAMPING = 20.0, 10.0, 2e5, 60.0
#: Speed within which dry friction turns round, m/s, and the rate of the log, Hz.
ROUND, RATE, SECONDS = 1e-3, 500.0, 5.0
AXIS = f"""
name = "feed axis"
gravity = [0.0, 0.0, -9.81]
bodies.table = {{ mass = {{ value = 9.0, unit = "kg", uncertainty = 1.5 }} }}

[joints.axis]
type = "prismatic"
parent = "world"
child = "table"
axis = [1.0, 0.0, 0.0]
rotor_inertia = {MOTOR}

[actuators.drive]
joint = "axis"
gain = 1.0
command_unit = "N"

[[effects]]
type = "coulomb_friction"
at = "axis"
coulomb = {{ value = 25.0, unit = "N", uncertainty = 15.0 }}
"""


def logged(seed: int, before: float, behind: float, stiffness: float = STIFFNESS) -> vpm.Experiment:
    """Record of two masses with a spring between, and dry friction on either; equations of Newton, by scipy."""
    random = np.random.default_rng(seed)
    rates, phases = 2.0 * np.pi * np.array([0.35, 0.9, 1.7]), random.uniform(0.0, 6.0, 3)
    sizes = np.array([0.06, 0.02, 0.008])

    def reference(t: float) -> tuple[float, float]:
        return float(sizes @ np.sin(rates * t + phases)), float(sizes * rates @ np.cos(rates * t + phases))

    def force(t: float, x: float, v: float) -> float:
        where, speed = reference(t)
        return 2e4 * (where - x) + 1.2e3 * (speed - v)

    def moved(t: float, state: np.ndarray) -> list[float]:
        x, v, y, w = state
        spring = stiffness * (x - y) + DAMPING * (v - w)
        a = (force(t, x, v) - before * np.tanh(v / ROUND) - spring) / MOTOR
        return [v, a, w, (spring - behind * np.tanh(w / ROUND)) / TABLE]

    time = np.arange(0.0, SECONDS, 1.0 / RATE)
    where, speed = reference(0.0)
    start = [where, speed, where, speed]
    x, v, y, _ = solve_ivp(moved, (0.0, SECONDS), start, "LSODA", time, rtol=1e-8, atol=1e-10, max_step=2e-3).y
    pushed = np.array([force(*row) for row in zip(time, x, v, strict=True)])
    columns = {
        "axis.position": x + random.normal(0.0, 1e-6, time.size),
        "axis_deflection.position": y - x + random.normal(0.0, 0.2 / stiffness, time.size),
        "drive.command": pushed + random.normal(0.0, 0.3, time.size),
    }
    return vpm.Experiment.from_arrays(time, columns, model=vpm.Model.from_toml(AXIS))


@pytest.mark.parametrize("stiffness", [STIFFNESS, 100.0 * STIFFNESS])
def test_a_screw_bent_by_friction_of_the_table_is_compliant(stiffness: float) -> None:
    """All friction acts behind the screw: what it bends by follows the direction of motion.

    The stiffer one rings at 276 Hz, beyond what the log resolves, and bends by 3e-6 m at the most.
    """
    records = (logged(seed, 0.0, 30.0, stiffness) for seed in (1, 2))
    why = vpm.diagnose(vpm.Model.from_toml(AXIS), *records, effects=["joint_compliance", "hysteresis"], workers=1)
    assert why.verdict == "effect_found"
    assert [(one.name, one.site) for one in why.effects] == [("joint_compliance", "axis")]
    assert why.model.parameters["axis.compliance.stiffness"].value == pytest.approx(stiffness, rel=0.05)
    assert why.model.parameters["axis.link.friction.coulomb"].value == pytest.approx(30.0, rel=0.02)


def test_friction_on_either_side_of_a_screw_is_told_apart() -> None:
    """The file knows one friction: it is that of the table, and that of the motor is missing beside the screw."""
    records = (logged(seed, 12.0, 30.0) for seed in (3, 4))
    effects = ["joint_compliance", "coulomb_friction"]
    why = vpm.diagnose(vpm.Model.from_toml(AXIS), *records, effects=effects, workers=1)
    assert why.verdict == "effect_found"
    assert {(one.name, one.site) for one in why.effects} == {(name, "axis") for name in effects}
    values = {name: parameter.value for name, parameter in why.model.parameters.items()}
    assert values["axis.compliance.stiffness"] == pytest.approx(STIFFNESS, rel=0.05)
    assert values["axis.link.friction.coulomb"] == pytest.approx(30.0, rel=0.03)
    assert values["axis.friction.coulomb"] == pytest.approx(12.0, rel=0.1)


def test_a_deflection_of_noise_alone_hides_no_recalibration() -> None:
    """A stiff axis: the second encoder repeats the first one, and the mass of the file is wrong by a tenth."""

    def stiff(seed: int) -> vpm.Experiment:
        random, time = np.random.default_rng(seed), np.arange(0.0, SECONDS, 1.0 / RATE)
        rates, sizes = 2.0 * np.pi * np.array([0.35, 0.9, 1.7]), np.array([0.06, 0.02, 0.008])
        angles = rates * time[:, None] + random.uniform(0.0, 6.0, 3)
        force = -(MOTOR + TABLE) * np.sin(angles) @ (sizes * rates**2)
        force += 30.0 * np.tanh(np.cos(angles) @ (sizes * rates) / ROUND)
        columns = {
            "axis.position": np.sin(angles) @ sizes + random.normal(0.0, 1e-6, time.size),
            "axis_deflection.position": random.normal(0.0, 1e-6, time.size),
            "drive.command": force + random.normal(0.0, 0.3, time.size),
        }
        return vpm.Experiment.from_arrays(time, columns, model=vpm.Model.from_toml(AXIS))

    records, setup = (stiff(seed) for seed in (1, 2)), vpm.Setup(hold="first_order")
    effects = ["joint_compliance", "hysteresis"]
    why = vpm.diagnose(vpm.Model.from_toml(AXIS), *records, effects=effects, setup=setup, workers=1)
    assert (why.verdict, why.effects) == ("parameters_only", ())
    effort = why.gap["axis.effort"]
    assert f"{100.0 * effort.before / effort.signal:.2f} % before" in why.summary
