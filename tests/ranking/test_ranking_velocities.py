"""Logs of tachometers alone: a motor, a torsion shaft and a flywheel, whose records are SciPy's and not the core's."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

import vpm
from vpm.experiment import Experiment
from vpm.model import Model

MOTOR, WHEEL, SHAFT, DAMPING = 0.07, 0.25, 60.0, 0.05  # kg m^2, N m/rad, N m s/rad: a resonance of 5.3 Hz
DRY, SMOOTH = 0.4, 0.02  # N m, and rad/s below which it turns round
FIRST = 6.0  # rad/s: the bench turns when the log begins
STEP, COUNT = 0.005, 1600
NOISE = 0.003  # rad/s

BENCH = f"""
name = "bench"
gravity = [0.0, 0.0, 0.0]
[bodies.hub]
mass = 1.0
[bodies.wheel]
mass = 20.0
inertia = [0.2, 0.2, {{ value = 0.28, uncertainty = 0.04 }}, 0.0, 0.0, 0.0]
[joints.motor]
type = "revolute"
parent = "world"
child = "hub"
axis = [0.0, 0.0, 1.0]
rotor_inertia = {{ value = 0.06, uncertainty = 0.01 }}
[joints.shaft]
type = "revolute"
parent = "hub"
child = "wheel"
axis = [0.0, 0.0, 1.0]
[actuators.drive]
joint = "motor"
gain = 1.0
command_unit = "N m"
[[effects]]
type = "spring"
at = "shaft"
stiffness = {{ value = 55.0, uncertainty = 10.0 }}
[[effects]]
type = "viscous_friction"
at = "shaft"
viscous = {{ value = {DAMPING}, uncertainty = 0.05 }}
"""


@cache
def bench(seed: int, dry: float = DRY) -> Experiment:
    """Record of both speeds under a held torque; the motor's bearing rubs."""
    rng = np.random.default_rng(seed)
    time = STEP * np.arange(COUNT)
    tones = [(4.0, 0.4), (2.0, 1.3), (1.0, 3.1)]
    torque = sum(a * np.sin(2.0 * np.pi * f * time + rng.uniform(0.0, 2.0 * np.pi)) for a, f in tones)

    def turned(_: float, x: np.ndarray, u: float) -> list[float]:
        twisted = SHAFT * x[0] + DAMPING * (x[1] - x[2])  # x: twist of the shaft, both speeds
        rubbing = dry * np.tanh(x[1] / SMOOTH)
        return [x[1] - x[2], (u - rubbing - twisted) / MOTOR, twisted / WHEEL]

    states = [np.array([0.0, FIRST, FIRST])]
    for u in torque[:-1]:
        run = solve_ivp(turned, (0.0, STEP), states[-1], args=(u,), rtol=1e-8, atol=1e-10)
        states.append(run.y[:, -1])
    motor, wheel = np.array(states)[:, 1:].T + NOISE * rng.standard_normal((2, COUNT))
    values = {"drive.command": torque, "motor.velocity": motor, "shaft.velocity": wheel - motor}
    return Experiment.from_arrays(time, values, model=Model.from_toml(BENCH), name=f"bench {seed}")


def test_a_run_begins_at_the_logged_speed() -> None:
    model = Model.from_toml(BENCH)
    run = vpm.simulate(model, bench(1), "free_run")
    assert run["motor.velocity"][0] == pytest.approx(FIRST, abs=5.0 * NOISE)
    assert run["motor.position"][0] == 0.0


def test_dry_friction_is_named_from_speeds_alone() -> None:
    why = vpm.diagnose(Model.from_toml(BENCH), bench(1), bench(2), workers=1)
    assert why.verdict == "effect_found"
    assert [(one.name, one.site) for one in why.effects] == [("coulomb_friction", "motor")]
    values = {name: why.model.parameters[name].value for name in why.model.parameters}
    assert values["motor.friction.coulomb"] == pytest.approx(DRY, rel=0.01)
    assert values["motor.rotor_inertia"] == pytest.approx(MOTOR, rel=0.01)
    assert values["wheel.inertia.zz"] == pytest.approx(WHEEL, rel=0.01)
    assert values["shaft.spring.stiffness"] == pytest.approx(SHAFT, rel=0.01)
    assert any("no position of motor and shaft" in note for note in why.notes)


def test_nothing_is_named_from_speeds_of_a_bench_that_misses_nothing() -> None:
    why = vpm.diagnose(Model.from_toml(BENCH), bench(3, 0.0), bench(4, 0.0), workers=1)
    assert why.verdict == "parameters_only"
    assert not why.effects
    # The hub weighs nothing about its axis, so that nothing could move behind a gap: the answer says what to describe.
    reasons = {(one.name, one.site): one.reason for one in why.refused}
    assert "give its body a rotational inertia" in reasons["backlash", "motor"]


FAST = 1000.0  # Hz; a scope that reads torques and speeds
#: Noise of a reading by the scope, N m and rad/s.
SHAKEN = {"drive.command": 0.2, "motor.velocity": 0.02, "shaft.velocity": 0.02}
LIGHT = 0.01  # N m s/rad: a shaft that rings for seconds


def scoped(seed: int, seconds: float = 16.0) -> Experiment:
    """Record of a scope whose bench rings as it begins, of which every tenth sample is kept behind a filter."""
    random, step = np.random.default_rng(seed), 1.0 / FAST
    time = np.arange(0.0, seconds, step)
    tones = [(4.0, 0.4), (2.0, 1.3), (1.0, 3.1)]
    turns = [2.0 * np.pi * f * time + random.uniform(0.0, 2.0 * np.pi) for _, f in tones]
    torque = np.array([a for a, _ in tones]) @ np.sin(turns)
    pull = np.array([SHAFT, LIGHT, -LIGHT])  # x: twist of the shaft, both speeds
    system = np.zeros((4, 4))
    system[:3] = [[0.0, 1.0, -1.0, 0.0], [*-pull / MOTOR, 1.0 / MOTOR], [*pull / WHEEL, 0.0]]
    # Exact while a torque holds (C. Van Loan, IEEE Trans. Automatic Control 23, 1978).
    moved = np.asarray(expm(system * step))
    states = [np.array([random.uniform(-0.05, 0.05), FIRST, FIRST])]
    for u in torque[:-1]:
        states.append(moved[:3, :3] @ states[-1] + moved[:3, 3] * u)
    motor, wheel = np.array(states)[:, 1:].T
    values = {"drive.command": torque, "motor.velocity": motor, "shaft.velocity": wheel - motor}
    values = {name: one + SHAKEN[name] * random.standard_normal(one.size) for name, one in values.items()}
    return Experiment.from_arrays(time, values, model=Model.from_toml(BENCH), name=f"scope {seed}").resample(0.1 * FAST)


@pytest.mark.parametrize("seed", [5, 6])
def test_nothing_is_missing_of_a_record_behind_an_anti_aliasing_filter(seed: int) -> None:
    """The filter leaves no noise above its edge; noise of the torque rings in the shaft, as its first twist does."""
    why = vpm.diagnose(Model.from_toml(BENCH), scoped(seed), workers=1)
    assert why.verdict == "parameters_only", why.summary
    assert why.model.parameters["shaft.spring.stiffness"].value == pytest.approx(SHAFT, rel=0.01)
    for gap in why.gap.values():  # what rings in a narrow band is some tenth more in one record than in another
        assert gap.after == pytest.approx(gap.noise_floor, rel=0.3)
