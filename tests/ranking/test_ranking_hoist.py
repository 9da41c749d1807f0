"""A load on a rope below a driven trolley, whose swing of 0.24 Hz dies away slowly: equations by hand."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import vpm
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.numbers import Array
from vpm.rank_command import lines_of
from vpm.ranking.own_vibration import below_own_vibration
from vpm.ranking.parameter_priors import Sizes
from vpm.ranking.settings import Settings
from vpm.ranking.substitute_records import shown
from vpm.ranking.tracked_records import TrackedRecords

TROLLEY, LOAD, ROPE, DROOP = 450.0, 600.0, 4.5, 6000.0  # kg, m, N s/m
AIR = 359.0  # N m s/rad: a hundredth of the critical damping of the swing
STEP, FINE, COUNT = 0.04, 4, 1000

CRANE = """
name = "crane"
gravity = [0.0, 0.0, -9.81]
[bodies.trolley]
mass = {{ value = 420.0, uncertainty = 60.0, min = 100.0 }}
[bodies.load]
mass = 600.0
center_of_mass = [0.0, 0.0, {{ value = -4.4, uncertainty = 0.15 }}]
inertia = [40.0, 40.0, 40.0, 0.0, 0.0, 0.0]
[joints.travel]
type = "prismatic"
parent = "world"
child = "trolley"
axis = [1.0, 0.0, 0.0]
[joints.sway]
type = "revolute"
parent = "trolley"
child = "load"
axis = [0.0, -1.0, 0.0]
[actuators.inverter]
joint = "travel"
gain = {{ value = 5500.0, unit = "N s/m", uncertainty = 800.0 }}
command_unit = "m/s"
[[effects]]
type = "viscous_friction"
at = "travel"
viscous = {{ value = 5500.0, uncertainty = 800.0 }}
{air}
"""
DESCRIBED = '[[effects]]\ntype = "viscous_friction"\nat = "sway"\nviscous = { value = 300.0, uncertainty = 100.0 }'


def rate(state: Array, command: float, wind: float) -> Array:
    """Lagrange's equations of the trolley and of the load, at ``x + l sin q`` and ``-l cos q``, in ``wind`` (N)."""
    _, angle, speed, turning = state
    lever = LOAD * ROPE * np.cos(angle)
    mass = np.array([[TROLLEY + LOAD, lever], [lever, 40.0 + LOAD * ROPE**2]])
    away = LOAD * ROPE * np.sin(angle) * turning**2
    push, fall = wind * np.array([1.0, ROPE * np.cos(angle)]), 9.81 * LOAD * ROPE * np.sin(angle)
    force = np.array([DROOP * (command - speed) + away, -fall - AIR * turning]) + push
    return np.append(state[2:], np.linalg.solve(mass, force))


@cache
def driven(seed: int, gust: float = 0.0) -> Experiment:
    """Record of 40 s under held commands, with noise of a laser and of a camera, and a gust (N) from 12 s to 20 s."""
    random = np.random.default_rng(seed)
    time = STEP * np.arange(COUNT)
    command = np.interp(time, np.linspace(0.0, 40.0, 17), random.uniform(-0.8, 0.8, 17))
    states, h = np.zeros((COUNT, 4)), STEP / FINE
    for k in range(COUNT - 1):
        state, wind = states[k], gust * np.sin(np.pi * (time[k] - 12.0) / 8.0) ** 2 * (12.0 < time[k] < 20.0)
        for _ in range(FINE):  # the method of Runge and Kutta
            one = rate(state, command[k], wind)
            two = rate(state + 0.5 * h * one, command[k], wind)
            three = rate(state + 0.5 * h * two, command[k], wind)
            four = rate(state + h * three, command[k], wind)
            state = state + h / 6.0 * (one + 2.0 * two + 2.0 * three + four)
        states[k + 1] = state
    noise = random.standard_normal((COUNT, 2)) * [3e-4, 5e-4]
    place, angle = (states[:, :2] + noise).T
    read = {"travel.position": place, "sway.position": angle, "inverter.command": command}
    units = {"travel.position": "m", "sway.position": "rad", "inverter.command": "m/s"}
    return Experiment.from_arrays(time, read, units, name=f"log {seed}")


@pytest.mark.parametrize("described", [False, True])
def test_damping_of_a_slow_swing_is_named_and_not_where_it_is_described(described: bool) -> None:
    """A tracker of 1 Hz would hold the load in step, and damp its swing itself."""
    model = Model.from_toml(CRANE.format(air=DESCRIBED if described else ""))
    ranking = vpm.rank(model, [driven(1), driven(2)], workers=1)
    named = [] if described else [("viscous_friction", "sway")]
    assert [(one.effect, one.site) for one in ranking.effects] == named
    fitted = ranking.model.parameters["sway.friction.viscous"].value
    assert fitted == pytest.approx(AIR, rel=0.05)
    assert not ranking.notes


def test_a_gust_in_one_record_is_told() -> None:
    """A force of 144 N leans the load by 144/(600 g) = 0.024 rad: no law of the machine, and only one record has it."""
    model = Model.from_toml(CRANE.format(air=DESCRIBED))
    ranking = vpm.rank(model, [driven(1), driven(2, 144.0)], workers=1)
    assert not ranking.effects
    (note,) = ranking.notes
    assert note.startswith("log 2 leaves")
    assert "times the error of log 1 in sway.position" in note
    assert list(lines_of(ranking))[-1] == f"note: {note}"


def test_a_load_that_nothing_brings_back_keeps_the_trackers() -> None:
    """Without gravity the rope turns freely: rounding is no stiffness, and there is no vibration to be slower than."""
    free = Model.from_toml(CRANE.format(air=DESCRIBED).replace("-9.81", "0.0"))
    hanging = Model.from_toml(CRANE.format(air=DESCRIBED))
    logs = [driven(1)]
    assert below_own_vibration(Settings(), free, logs) == Settings()
    (slow, *_) = below_own_vibration(Settings(), hanging, logs).bands
    inertia = 40.0 + LOAD * 4.4**2  # of the model file's rope
    assert 2.0 * slow == pytest.approx(np.sqrt(LOAD * 9.81 * 4.4 / inertia) / (2.0 * np.pi), rel=1e-4)


def test_forces_at_a_load_are_as_large_as_its_inertia_where_it_moves() -> None:
    """At zero of the winch the load hangs in the pivot and has none: friction of the swing had no size there."""
    text = CRANE.format(air="").replace("[0.0, 0.0, { value = -4.4, uncertainty = 0.15 }]", "[0.0, 0.0, 0.0]")
    text = text.replace("[bodies.load]", "[bodies.rope]\nmass = 1.0\n[bodies.load]").replace(
        'child = "load"', 'child = "rope"'
    )
    winch = '[joints.winch]\ntype = "prismatic"\nparent = "rope"\nchild = "load"\naxis = [0.0, 0.0, -1.0]\n'
    lift = '[actuators.lift]\njoint = "winch"\ngain = 1.0\ncommand_unit = "N"\n'
    model = Model.from_toml(text + winch + lift)
    time = STEP * np.arange(COUNT)
    read = {
        "travel.position": 0.5 * np.sin(0.7 * time),
        "sway.position": 0.05 * np.sin(1.5 * time),
        "winch.position": ROPE + 0.3 * np.sin(0.5 * time),
        "inverter.command": 0.1 * np.cos(0.7 * time),
        "lift.command": -LOAD * 9.81 + np.zeros(COUNT),
    }
    tracked = TrackedRecords(model, [Experiment.from_arrays(time, read, {}, name="lifted", model=model)], Settings())
    effort, _, _ = Sizes(model, shown(model, tracked)).joints["sway"]
    assert effort == pytest.approx((40.0 + LOAD * ROPE**2) * 0.05 * 1.5**2 / np.sqrt(2.0), rel=0.1)
