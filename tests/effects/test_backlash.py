"""Backlash between motor and load, found along the motion of the motor alone; the machine is written out here."""

import numpy as np
import pytest

from vpm import Experiment, Model, diagnose
from vpm._core import soft_flights
from vpm.catalogue import EFFECTS
from vpm.discrepancy.screening.backlash_start import flights, only_compliant, read_off
from vpm.discrepancy.screening.candidates import Candidate
from vpm.identify import InverseDynamicsProblem
from vpm.numbers import Array

GAP, MASS, ROTOR, VISCOUS = 4e-4, 12.0, 3.0, 30.0
STIFFNESS, DAMPING = 1.5e6, 900.0
#: Contacts in which the link sways at 14 Hz, a fifth of critically damped, and the gap between these.
SOFT, SOFT_DAMPING, WIDE = 9.3e4, 420.0, 2e-3
TEXT = f"""name = "axis"
gravity = [0.0, 0.0, -9.81]

[bodies.body]
mass = {{ value = {MASS * 1.05}, uncertainty = {MASS * 0.1}, unit = "kg" }}

[joints.axis]
type = "prismatic"
parent = "world"
child = "body"
axis = [1.0, 0.0, 0.0]
rotor_inertia = {ROTOR}

[actuators.drive]
joint = "axis"
gain = {{ value = 1.0, unit = "N/N" }}
command_unit = "N"

[[effects]]
type = "viscous_friction"
at = "axis"
viscous = {{ value = {VISCOUS * 0.95}, uncertainty = {VISCOUS * 0.1}, unit = "N s/m" }}
"""


def record(
    gap: float, seed: int, seconds: float = 6.0, stiffness: float = STIFFNESS, damping: float = DAMPING
) -> Experiment:
    """A motor of which the link behind hangs in two contacts, pushed about by a position loop, at 1 kHz."""
    random = np.random.default_rng(seed)
    fine, step = 20, 5e-5
    time = 1e-3 * np.arange(round(seconds / 1e-3))
    phases = random.uniform(0.0, 6.28, 3)
    rates = 2.0 * np.pi * np.array([0.5, 1.1, 2.3])
    path = (np.array([[0.08], [0.03], [0.01]]) * np.sin(rates[:, None] * time + phases[:, None])).sum(0)
    path = (path - path[0]) * np.clip(time, 0.0, 1.0) ** 2
    q = v = link = rate = 0.0
    readings, commands, last = np.zeros(time.size), np.zeros(time.size), 0.0
    for k in range(time.size):
        readings[k] = 1e-6 * round((q + 3e-7 * random.standard_normal()) / 1e-6)
        speed, last = (readings[k] - last) / 1e-3, readings[k]
        effort = commands[k] = 800.0 * (10.0 * (path[k] - readings[k]) - speed)
        for _ in range(fine):
            twist = q - link
            beyond = twist - min(max(twist, -0.5 * gap), 0.5 * gap)
            push = stiffness * beyond + damping * (v - rate) if beyond else 0.0
            push = push if push * beyond > 0.0 else 0.0
            v += step * (effort - VISCOUS * v - push) / ROTOR
            rate += step * push / MASS
            q, link = q + step * v, link + step * rate
    data = {"axis.position": readings, "drive.command": commands}
    return Experiment.from_arrays(time, data, units={"axis.position": "m", "drive.command": "N"}, name=f"log {seed}")


@pytest.fixture(scope="module")
def loose() -> tuple[Experiment, ...]:
    """Two records of a machine with play."""
    return record(GAP, 1), record(GAP, 2)


def test_flights_show_the_gap_best_where_it_is(loose: tuple[Experiment, ...]) -> None:
    model = Model.from_toml(TEXT)
    data = InverseDynamicsProblem(model, loose[:1])
    residual, _ = data.evaluate(model, model.theta)
    gaps = GAP * np.array([0.25, 0.5, 0.8, 1.0, 1.25, 2.0, 4.0])
    loose_model = model.with_effect("backlash", at="axis", gap=GAP, stiffness=1.0)
    added = flights(loose_model, "axis", data, gaps, np.full(7, 14.0), np.full(7, 0.5))
    left = np.sum((residual[:, None] + added) ** 2, axis=0)
    assert int(np.argmin(left)) in {2, 3, 4}
    assert left.min() < 0.6 * np.sum(residual**2)


def test_the_gap_is_read_off_from_the_motor_alone(loose: tuple[Experiment, ...]) -> None:
    model = Model.from_toml(TEXT)
    data = InverseDynamicsProblem(model, loose[:1])
    found = read_off(model, ("body.mass",), data, Candidate(EFFECTS["backlash"], "axis", ({},))).starts[0]
    assert found["gap"] == pytest.approx(GAP, rel=0.15)


def test_a_play_between_hard_contacts_that_ring_is_found_as_wide_as_it_is() -> None:
    """Contacts at 60 Hz, a twentieth of critically damped: their bounces can be followed for no more than a few."""
    wide, hard = 1.5e-3, MASS * (2.0 * np.pi * 60.0) ** 2
    model = Model.from_toml(TEXT)
    data = InverseDynamicsProblem(model, [record(wide, 4, 4.0, hard, 0.1 * np.sqrt(hard * MASS))])
    found = read_off(model, ("body.mass",), data, Candidate(EFFECTS["backlash"], "axis", ({},))).starts[0]
    assert found["gap"] == pytest.approx(wide, rel=0.2)


def test_soft_contacts_are_read_off_as_soft_and_the_gap_between_them_is_not_widened() -> None:
    model = Model.from_toml(TEXT)
    data = InverseDynamicsProblem(model, [record(WIDE, 1, 4.0, SOFT, SOFT_DAMPING)])
    candidate = Candidate(EFFECTS["backlash"], "axis", ({},))
    soft, hard = (read_off(model, ("body.mass",), data, candidate, hard=each).starts[0] for each in (False, True))
    assert soft["gap"] == pytest.approx(WIDE, rel=0.03)
    assert soft["gap"] < hard["gap"]
    assert 0.5 * SOFT < soft["stiffness"] < 2.0 * SOFT
    assert hard["stiffness"] > 4.0 * SOFT


def test_contacts_that_wind_up_further_than_the_gap_are_a_spring(loose: tuple[Experiment, ...]) -> None:
    model = Model.from_toml(TEXT)
    data = InverseDynamicsProblem(model, loose[:1])
    stiff, soft = (model.with_effect("backlash", at="axis", gap=GAP, stiffness=k) for k in (1e6, 1e4))
    assert not only_compliant(stiff, "axis", data)
    assert "that is a spring" in only_compliant(soft, "axis", data)


@pytest.mark.nightly
def test_play_is_named_and_none_is_seen_where_there_is_none(loose: tuple[Experiment, ...]) -> None:
    model = Model.from_toml(TEXT)
    effects = ["backlash", "joint_compliance", "input_delay", "coulomb_friction"]
    why = diagnose(model, loose[:1], loose[1:], effects=effects)
    assert [(effect.name, effect.site) for effect in why.effects][:1] == [("backlash", "axis")]
    gap = next(p for p in why.effects[0].parameters if p.name == "gap")
    assert gap.value == pytest.approx(GAP, rel=0.15)
    tight = record(1e-9, 1), record(1e-9, 2)
    assert "backlash" not in {effect.name for effect in diagnose(model, tight[:1], tight[1:], effects=effects).effects}


def test_flights_are_those_of_one_step_after_the_other() -> None:
    generator = np.random.default_rng(5)
    pull = np.cumsum(generator.standard_normal(3000)) * 0.05
    gaps, rates, dampings = np.array([1e-5, 3e-4, 2e-3]), np.array([50.0, 90.0, 200.0]), np.array([0.5, 1.0, 0.2])
    swing = soft_flights(pull, gaps, rates, dampings, 1e-3)
    np.testing.assert_allclose(swing, step_by_step(pull, 0.5 * gaps, rates, dampings, 1e-3), rtol=1e-9, atol=1e-9)
    with pytest.raises(ValueError, match="give one of each"):
        soft_flights(pull, gaps, rates[:2], dampings, 1e-3)


def step_by_step(pull: Array, half: Array, rates: Array, dampings: Array, interval: float) -> Array:
    """All plays together, one sample after the other."""
    place, speed, swing = np.zeros_like(half), np.zeros_like(half), np.zeros((pull.size, half.size))
    for k, acceleration in enumerate(pull.tolist()):
        beyond = place - np.clip(place, -half, half)
        new = speed + interval * (acceleration - rates**2 * beyond)
        new = np.where(beyond == 0.0, new, new / (1.0 + 2.0 * interval * dampings * rates))
        swing[k], speed = (new - speed) / interval, new
        place = place + interval * speed
    return swing
