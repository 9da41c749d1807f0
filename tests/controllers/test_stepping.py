"""Simulations that somebody else drives: the same machine as in a free run, for controllers."""

import numpy as np
import pytest
from numpy.typing import ArrayLike

from two_link_arm import nominal
from vpm.errors import DivergedError, ModelError, SimulationError
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.simulate import INTEGRATORS, simulate
from vpm.stepping import Simulation

STEP = 0.002


@pytest.fixture(scope="module")
def arm() -> Model:
    delayed = nominal().with_effect("input_delay", at="first", time=0.0053)
    return delayed.with_effect("actuator_lag", at="second", time_constant=0.03)


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_steps_are_those_of_a_free_run(arm: Model, integrator: str) -> None:
    time = STEP * np.arange(300)
    commands = np.column_stack([np.sin(9.0 * time), np.cos(7.0 * time)])
    channels = {"first.command": commands[:, 0], "second.command": commands[:, 1]}
    log = Experiment.from_arrays(time, channels, units=dict.fromkeys(channels, "A"), name="sines")
    start = arm.state({"shoulder.position": 0.4, "elbow.velocity": 0.2})
    free = simulate(arm, log, integrator=integrator, initial_state=start)
    sim = Simulation(arm, STEP, integrator=integrator, state=start)
    run = sim.run(commands[:-1])
    for channel in ("shoulder.position", "elbow.position", "shoulder.velocity", "elbow.velocity"):
        np.testing.assert_array_equal(run[channel], free[channel][1:])
    np.testing.assert_allclose(run.time, free.time[1:], atol=1e-12)
    np.testing.assert_array_equal(run["first.command"], commands[:-1, 0])
    sim.reset()
    assert sim.time == 0.0
    np.testing.assert_array_equal(sim.state, start)
    for row in commands[:20]:
        sim.step(row)
    assert sim["elbow.position"] == free["elbow.position"][20]


def test_a_controller_holds_the_arm_against_its_weight(arm: Model) -> None:
    target = np.array([-0.4, 0.3])
    gains = np.array([arm.parameters[f"{name}.gain"].value for name in arm.actuators])
    proportional, derivative = np.array([80.0, 40.0]), np.array([12.0, 5.0])

    def controller(sim: Simulation) -> ArrayLike:
        q = np.array([sim["shoulder.position"], sim["elbow.position"]])
        v = np.array([sim["shoulder.velocity"], sim["elbow.velocity"]])
        weight = arm.inverse_dynamics(target, np.zeros(2), np.zeros(2))
        effort: ArrayLike = (weight + proportional * (target - q) - derivative * v) / gains
        return effort

    run = Simulation(arm, STEP).run(controller, duration=4.0)
    np.testing.assert_allclose([run["shoulder.position"][-1], run["elbow.position"][-1]], target, atol=1e-3)
    assert run.time[-1] == pytest.approx(4.0)
    assert run.plot().axes


def test_commands_come_as_numbers_names_or_arrays(arm: Model) -> None:
    ends = []
    for command in ([0.5, 0.0], np.array([0.5, 0.0]), {"first": 0.5}, {"first.command": 0.5, "second": 0.0}):
        sim = Simulation(arm, STEP)
        for _ in range(5):
            sim.step(command)
        ends.append(sim.state)
    for end in ends[1:]:
        np.testing.assert_array_equal(end, ends[0])


def test_wrong_commands_leave_the_simulation_as_it_was(arm: Model) -> None:
    sim = Simulation(arm, STEP, state={"elbow.position": 0.1})
    with pytest.raises(SimulationError, match="inputs must have 2 entries, got 3"):
        sim.step([1.0, 2.0, 3.0])
    with pytest.raises(SimulationError, match="finite"):
        sim.step([np.nan, 0.0])
    with pytest.raises(SimulationError, match="one row per step"):
        sim.run(np.zeros((5, 3)))
    with pytest.raises(SimulationError, match="duration"):
        sim.run(lambda _: [0.0, 0.0])
    with pytest.raises(ModelError, match="no actuator"):
        sim.step({"third": 1.0})
    with pytest.raises(SimulationError, match=r"elbow\.position"):
        sim["elbow.positon"]
    assert sim.time == 0.0
    assert sim["elbow.position"] == 0.1


def test_settings_that_cannot_be_are_refused(arm: Model) -> None:
    with pytest.raises(SimulationError, match="time_step"):
        Simulation(arm, 0.0)
    with pytest.raises(SimulationError, match="integrator"):
        Simulation(arm, STEP, integrator="euler")
    with pytest.raises(ModelError, match="no state"):
        Simulation(arm, STEP, state={"knee.position": 1.0})


def test_a_diverged_simulation_names_the_way_on() -> None:
    stiff = nominal().with_parameters({"shoulder.friction.viscous": 1e5})
    sim = Simulation(stiff, STEP, integrator="rk4", state={"shoulder.velocity": 1.0})
    with pytest.raises(DivergedError, match="linearly_implicit"):
        sim.run(np.zeros((5000, 2)))
    sim.reset()
    sim.reset({"shoulder.velocity": 0.0})
    assert sim.time == 0.0
