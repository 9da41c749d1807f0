"""What steps damp, as every way of simulating says it: of a mass on a spring, whose runs show it."""

from __future__ import annotations

import copy
from pathlib import Path

import numpy as np
import pytest

from vpm.batch import Trial, simulate_batch
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.scenario import Scenario
from vpm.simulate import Resolution, Run, Setup, simulate
from vpm.stepping import Simulation

STEP, SECONDS, HERTZ = 1e-3, 0.2, 200.0

CARRIAGE = f"""
name = "carriage"
gravity = [0.0, 0.0, 0.0]
[bodies.carriage]
mass = 2.0
[joints.axis]
type = "prismatic"
parent = "world"
child = "carriage"
axis = [1.0, 0.0, 0.0]
[actuators.drive]
joint = "axis"
gain = 1.0
[[effects]]
type = "spring"
at = "axis"
stiffness = {2.0 * (2.0 * np.pi * HERTZ) ** 2}
rest = 0.0
"""


@pytest.fixture
def model(tmp_path: Path) -> Model:
    path = tmp_path / "carriage.toml"
    path.write_text(CARRIAGE, encoding="utf-8")
    return Model.load(path)


def silence(seconds: float = SECONDS) -> Experiment:
    time = STEP * np.arange(round(seconds / STEP))
    return Experiment.from_arrays(time, {"drive.command": np.zeros(time.size)}, units={"drive.command": "N"}, name="-")


def kept(run: Run) -> float:
    """Amplitude at the end of a run by that at its beginning."""
    amplitude = np.hypot(run["axis.position"], run["axis.velocity"] / (2.0 * np.pi * HERTZ))
    return float(amplitude[-1] / amplitude[0])


def found(steps: Resolution | None) -> Resolution:
    assert steps is not None
    return steps


def told(run: Run) -> float:
    """What the one mode of a run is said to keep."""
    steps = found(run.resolution)
    assert steps.integrator == "linearly_implicit"
    assert steps.frequencies == pytest.approx([HERTZ], rel=1e-6)
    assert steps.limit < HERTZ
    return float(steps.left[0])


def worked_out(run: Run) -> bool:
    return "_modes" in vars(run.resolution)


def test_a_run_says_what_its_steps_leave_also_when_loaded(model: Model, tmp_path: Path) -> None:
    state = model.state({"axis.position": 1e-3})
    run = simulate(model, silence(), integrator="linearly_implicit", initial_state=state)
    assert not worked_out(run)
    # The first and the last amplitude are not taken at the same phase of the numerical vibration: a few percent.
    assert np.log(told(run)) == pytest.approx(np.log(kept(run)), rel=0.1)
    assert told(run) < 0.5
    run.save(tmp_path / "run.npz")
    for again in (Run.load(tmp_path / "run.npz"), copy.deepcopy(run)):
        assert again == run
        assert str(again.resolution) == str(run.resolution)


def test_a_run_that_nobody_asked_is_saved_with_it(model: Model, tmp_path: Path) -> None:
    run = simulate(model, silence(), integrator="linearly_implicit", initial_state=model.state({"axis.position": 1e-3}))
    run.save(tmp_path / "run.npz")
    assert told(Run.load(tmp_path / "run.npz")) == told(run)


def test_a_simulation_says_it_of_runs_and_of_a_second(model: Model) -> None:
    sim = Simulation(model, STEP, integrator="linearly_implicit", state={"axis.position": 1e-3})
    run = sim.run(np.zeros((round(SECONDS / STEP), 1)))
    assert np.log(told(run)) == pytest.approx(np.log(kept(run)), rel=0.1)
    assert sim.resolution.left[0] == pytest.approx(told(run) ** (1.0 / SECONDS), rel=1e-6)
    assert Simulation(model, STEP, integrator="adaptive").resolution.limit == np.inf


def test_runs_of_a_batch_say_it_each_of_its_own_machine(model: Model) -> None:
    slow = {"axis.spring.stiffness": 2.0 * (2.0 * np.pi * 2.0) ** 2}
    state = {"axis.position": 1e-3}
    trials = [Trial(silence(), initial_state=state), Trial(silence(), slow, state)]
    fast, resolved = simulate_batch(model, trials, setup=Setup("linearly_implicit"))
    assert isinstance(fast, Run)
    assert isinstance(resolved, Run)
    assert not worked_out(fast)
    assert not worked_out(resolved)
    assert np.log(told(fast)) == pytest.approx(np.log(kept(fast)), rel=0.1)
    assert not found(resolved.resolution).frequencies.size


def test_a_scenario_says_it_beside_its_numbers(model: Model, tmp_path: Path) -> None:
    document = {
        "scenario": "plucked",
        "duration": SECONDS,
        "time_step": STEP,
        "integrator": "linearly_implicit",
        "initial": {"axis.position": 1e-3},
        "runs": [{"name": "bare", "model": "carriage.toml"}],
    }
    result = Scenario.from_dict(document, folder=tmp_path).run()
    assert model.name == result["bare"].model_name
    assert np.log(told(result["bare"])) == pytest.approx(np.log(kept(result["bare"])), rel=0.1)
    assert f"note: {result['bare'].resolution}" in str(result)
