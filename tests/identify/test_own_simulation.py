"""Fits of balances beside what these leave of the model's own simulation, on a pendulum that numpy integrates.

Its drive gives the torque that it is told, or is a motor with a winding that is told a voltage.
"""

from dataclasses import replace
from importlib import import_module
from typing import Any, cast

import numpy as np
import pytest

from fit_machines import sines
from nightly import at_night
from runge_kutta import ahead
from vpm import Experiment, Model, Setup, Simulation, identify
from vpm.errors import SimulationError
from vpm.identify import Fitting, InverseDynamicsProblem, gaps, profile_intervals
from vpm.identify.closed_loop_prediction import commands_to_draw, own_residual
from vpm.identify.estimation import _refine
from vpm.numbers import Array

DT, STEPS, NOISE, MACHINES = 0.002, 8, 2e-5, 40
#: Inertia about the hinge (kg m^2), viscous (N m s) and dry friction (N m).
TRUTH = {"pendulum.inertia.yy": 0.03, "hinge.friction.viscous": 0.12, "hinge.friction.coulomb": 0.25}
#: Weight at its lever (N m), and speed at which dry friction turns round (rad/s).
WEIGHT, TURN = 1.5, 0.01
MODEL = Model.from_toml(
    f"""
    name = "pendulum"
    gravity = [0.0, 0.0, -10.0]
    bodies.pendulum = {{ mass = 1.0, center_of_mass = [0.0, 0.0, -0.15], inertia = [0.01, 0.01, 0.01, 0.0, 0.0, 0.0] }}
    joints.hinge = {{ type = "revolute", parent = "world", child = "pendulum", axis = [0.0, 1.0, 0.0] }}
    actuators.drive = {{ joint = "hinge", gain = 1.0, command_unit = "N m" }}
    effects = [
        {{ type = "viscous_friction", at = "hinge", viscous = 0.1 }},
        {{ type = "coulomb_friction", at = "hinge", coulomb = 0.2, transition_velocity = {TURN} }},
    ]
    """
)
#: Resistance (Ohm), time constant of the winding (s), and torque per current behind the gear (N m/A).
RESISTANCE, WINDING, TORQUE = 2.0, 1e-3, 0.5
_MOTOR = {
    "type": "dc_motor",
    "joint": "hinge",
    "resistance": RESISTANCE,
    "time_constant": WINDING,
    "torque_constant": 0.1 * TORQUE,
    "back_emf": 0.1 * TORQUE,
    "gear_ratio": 10.0,
    "efficiency": 1.0,
    "command_unit": "V",
}
WITH_MOTOR = Model.from_dict({**MODEL.to_dict(), "actuators": {"drive": _MOTOR}})
#: Of the body about its own centre: the rest is its mass at the lever.
OWN = TRUTH["pendulum.inertia.yy"] - 1.0 * 0.15**2
FREE = tuple(TRUTH)
EXPECTED = np.array([OWN, *list(TRUTH.values())[1:]])


def logs(machines: int, seed: int, seconds: float = 12.0, motor: bool = False) -> list[Experiment]:
    """Logs of a pendulum under a controller, by the classical method of Runge and Kutta, side by side."""
    random, samples = np.random.default_rng(seed), round(seconds / DT)
    wanted = sines(random, samples, machines, 0.35, 0.25)
    inertia, viscous, dry = TRUTH.values()

    def rates(state: Array, command: Array) -> Array:
        q, v, current = state
        effort = TORQUE * current if motor else command
        winding = ((command - TORQUE * v) / RESISTANCE - current) / WINDING if motor else np.zeros(machines)
        return np.array([v, (effort - WEIGHT * np.sin(q) - viscous * v - dry * np.tanh(v / TURN)) / inertia, winding])

    state = np.zeros((3, machines))
    seen, commands = np.empty((samples, machines)), np.empty((samples, machines))
    for k in range(samples):
        seen[k] = state[0] + NOISE * random.standard_normal(machines)
        speed = (seen[k] - seen[k - 1]) / DT if k else np.zeros(machines)
        command = 12.0 * (wanted[k] - seen[k]) - 0.05 * speed
        commands[k] = command = command * RESISTANCE / TORQUE if motor else command
        for _ in range(STEPS):
            state = ahead(rates, state, DT / STEPS, command)
    time, model = DT * np.arange(samples), WITH_MOTOR if motor else MODEL
    return [
        Experiment.from_arrays(
            time, {"hinge.position": seen[:, n], "drive.command": commands[:, n]}, {}, name=f"log {n}", model=model
        )
        for n in range(machines)
    ]


@pytest.fixture(scope="module")
def some() -> list[Experiment]:
    return logs(MACHINES, seed=72)


@pytest.mark.nightly
def test_dry_friction_that_turns_round_biases_no_interval(some: list[Experiment]) -> None:
    """Of forty intervals at 95 %, fewer than 32 hold the truth with a chance of 1e-3."""
    fits = [identify(MODEL, log, FREE) for log in some]
    held = [(fit.intervals[:, 0] <= EXPECTED) & (fit.intervals[:, 1] >= EXPECTED) for fit in fits]
    assert np.all(np.sum(held, axis=0) >= 32)
    assert not [warning for fit in fits for warning in fit.warnings if "repeats with the motion" in warning]
    errors = [fit["pendulum.inertia.yy"] / OWN - 1.0 for fit in fits]
    assert np.sqrt(np.mean(np.square(errors))) < 1e-3  # 4e-3 by the residual alone


def test_inertias_that_nothing_shows_keep_nothing_from_being_compared(some: list[Experiment]) -> None:
    """They stay where they were, and the others come out as without them."""
    fit = identify(MODEL, some[0], (*FREE, "pendulum.inertia.xx", "pendulum.inertia.zz"))
    alone = identify(MODEL, some[0], FREE)
    np.testing.assert_allclose(fit.values, [*alone.values, 0.01, 0.01], rtol=1e-4)
    np.testing.assert_allclose(fit.std, [*alone.std, np.inf, np.inf], rtol=0.05)


def test_the_torque_constant_of_a_motor_does_not_collapse() -> None:
    """All forces are free with it: a balance of nothing with nothing would have no residual, and no motor."""
    (log,) = logs(1, seed=75, motor=True)
    fit = identify(WITH_MOTOR, log, ("drive.torque_constant", "pendulum.mass", *FREE))
    assert fit["drive.torque_constant"] == pytest.approx(0.1 * TORQUE, rel=0.05)
    assert np.isinf(fit.std[0])
    assert any("drive.torque_constant" in w and w.startswith("not identifiable") for w in fit.warnings)


SETTINGS = {"noise": Fitting(noise="estimated"), "loss": Fitting(loss="huber", starts=2)}


@pytest.mark.parametrize("name", at_night(SETTINGS, but=["noise"]))
def test_nor_does_it_where_settings_of_the_fit_are_given(some: list[Experiment], name: str) -> None:
    """Of 15 intervals fewer than 11 hold the truth with a chance of 6e-4; of the inertia the residual alone has 2."""
    fitting = SETTINGS[name]
    fits = [identify(MODEL, log, FREE, fitting=fitting) for log in some[:15]]
    held = [(fit.intervals[:, 0] <= EXPECTED) & (fit.intervals[:, 1] >= EXPECTED) for fit in fits]
    assert np.all(np.sum(held, axis=0) >= 11)
    assert all(fit.costs.size == fitting.starts and fit.ended == "converged" for fit in fits)


def test_a_profile_is_beside_the_own_simulation_too(some: list[Experiment]) -> None:
    """The balance is nearly linear in what is free: a profile ends where normal intervals do, around the same fit."""
    fit = identify(MODEL, some[0], FREE)
    assert fit.expected.size
    profiles = profile_intervals(fit, some[0])
    ends = np.array([[profile.low, profile.high] for profile in profiles])
    normal = fit.values[:, None] + 1.96 * fit.std[:, None] * np.array([-1.0, 1.0])
    assert np.all(np.abs(ends - normal) < 0.1 * fit.std[:, None])


def test_a_joint_without_an_encoder_is_simulated_at_rest_where_the_balance_has_it() -> None:
    """A load behind a spring, whose place nobody measures, begins at rest: all is left of the log but noise."""
    content = MODEL.to_dict()
    content["gravity"] = [0.0, 0.0, 0.0]
    content["bodies"]["load"] = {"mass": 1.0, "inertia": [0.01, 0.02, 0.01, 0.0, 0.0, 0.0]}
    turning = {"type": "revolute", "parent": "pendulum", "child": "load", "axis": [0.0, 1.0, 0.0]}
    content["joints"]["shaft"] = turning
    content["effects"] += [
        {"type": "spring", "at": "shaft", "stiffness": 20.0},
        {"type": "viscous_friction", "at": "shaft", "viscous": 0.05},
    ]
    model = Model.from_dict(content)
    sim, samples = Simulation(model, DT, integrator="adaptive(1e-8)"), 4000
    wanted = sines(np.random.default_rng(4), samples, 1, 0.35, 0.25)[:, 0]
    seen, commands = np.empty(samples), np.empty(samples)
    for k in range(samples):
        seen[k], commands[k] = sim["hinge.position"], 6.0 * (wanted[k] - sim["hinge.position"])
        sim.step([commands[k]])
    random = np.random.default_rng(5)
    columns = {"hinge.position": seen + NOISE * random.standard_normal(samples), "drive.command": commands}
    log = Experiment.from_arrays(DT * np.arange(samples), columns, model=model, name="behind")
    data = InverseDynamicsProblem(model, [log])
    own, left = own_residual(model, data), data.evaluate(model, model.theta)[0]
    assert own is not None
    assert np.std(left - own.expected) < 0.5 * np.std(left)


@pytest.mark.nightly
def test_nor_does_it_behind_a_motor() -> None:
    """Of twenty, fewer than 15 hold the truth with a chance of 3e-4; by the residual alone 17, 0 and 11 do."""
    fits = [identify(WITH_MOTOR, log, FREE) for log in logs(20, seed=73, motor=True)]
    held = [(fit.intervals[:, 0] <= EXPECTED) & (fit.intervals[:, 1] >= EXPECTED) for fit in fits]
    assert np.all(np.sum(held, axis=0) >= 15)
    assert not [warning for fit in fits for warning in fit.warnings if "repeats with the motion" in warning]


def test_a_delay_of_many_samples_holds_no_simulation_back() -> None:
    """A drive that is 20 samples late is drawn to its log as it would be without."""
    late = MODEL.with_effect("input_delay", at="drive", time=20 * DT)
    m = InverseDynamicsProblem(MODEL, logs(1, seed=74)).motions[0]
    prompt, patient = (commands_to_draw(model, m, 2.0 * np.pi * 0.3, 0.7) for model in (MODEL, late))
    np.testing.assert_allclose(patient, prompt, rtol=1e-9)


def test_what_is_left_of_a_log_is_what_was_expected(some: list[Experiment]) -> None:
    """At the true values nothing but noise is left beyond that."""
    true = MODEL.with_parameters(dict(zip(FREE, EXPECTED.tolist(), strict=True)))
    data = InverseDynamicsProblem(true, some[:1])
    left, own = data.evaluate(true, true.theta)[0], own_residual(true, data)
    assert own is not None
    assert np.std(left - own.expected) < 0.5 * np.std(left)
    assert np.array_equal(data.less(own.expected).evaluate(true, true.theta)[0], left - own.expected)


def test_the_error_that_is_told_is_that_of_the_log(some: list[Experiment]) -> None:
    fit = identify(MODEL, some[0], FREE)
    data = InverseDynamicsProblem(fit.model, some[:1])
    residual = data.evaluate(fit.model, fit.model.theta)[0]
    assert fit.after["hinge.effort"][0] == pytest.approx(gaps(data, residual)["hinge.effort"][0], rel=1e-9)


def test_a_fit_repeats_to_the_last_digit(some: list[Experiment]) -> None:
    first, second = (identify(MODEL, some[0], FREE) for _ in range(2))
    assert np.array_equal(first.values, second.values)


def test_nothing_is_expected_of_a_model_that_leaves_its_log(some: list[Experiment]) -> None:
    """Its drive pulls the other way, and no slow controller keeps it there."""
    heavy = MODEL.with_parameters({"hinge.friction.coulomb": 50.0})
    assert own_residual(heavy, InverseDynamicsProblem(heavy, some[:1])) is None


def test_nothing_is_expected_where_commands_run_between_samples(some: list[Experiment]) -> None:
    data = InverseDynamicsProblem(MODEL, some[:1], hold="first_order")
    assert own_residual(MODEL, data) is None
    fit = identify(MODEL, some[0], FREE, setup=Setup(hold="first_order"))
    assert np.all(np.isfinite(fit.std))


def test_another_record_is_compared_as_the_first_one_is(some: list[Experiment]) -> None:
    data = InverseDynamicsProblem(MODEL, some[:1])
    same = data.on([replace(some[0], name="again")])
    assert same.blocks == data.blocks
    np.testing.assert_array_equal(same.evaluate(MODEL, MODEL.theta)[0], data.evaluate(MODEL, MODEL.theta)[0])


def test_noise_beside_which_the_model_runs_away_leaves_the_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    """The error of a draw, which nobody asked for, ended the fit after its work."""
    asked = []

    def away(*_: object) -> Array:
        asked.append(1)
        raise SimulationError("the position leaves its bounds")

    log = logs(1, 3)[0]
    monkeypatch.setattr(import_module("vpm.identify.refitting"), "noisy", away)
    fit = identify(MODEL, log, free=FREE)
    assert asked
    assert np.all(np.abs(fit.values - EXPECTED) <= 5.0 * fit.std)


@pytest.mark.filterwarnings("error")
def test_a_fit_stays_where_the_first_step_ended_in_no_number() -> None:
    """Infinite times zero went on to linear algebra."""

    def astray(_: Array) -> tuple[Array, Array]:
        return np.array([np.inf, 1.0]), np.array([[0.0], [1.0]])

    start = np.array([0.5])
    assert _refine(cast("Any", astray), start, start - 1.0, start + 1.0, 1e-8, 10) is start
