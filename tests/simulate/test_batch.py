"""Batches: the same as one after the other, failures as values, stopped by Ctrl-C."""

import time

import numpy as np
import pytest

from interrupting import pressed
from two_link_arm import Arm, nominal, record
from vpm.batch import Trial, simulate_batch
from vpm.errors import DivergedError, ExperimentError, ModelError, SimulationError
from vpm.experiment import Experiment
from vpm.simulate import Run, Setup, simulate


@pytest.fixture(scope="module")
def log() -> Experiment:
    return record(Arm(), 2.0, 1)


def test_a_batch_is_the_same_as_one_after_the_other(log: Experiment) -> None:
    model = nominal()
    changes = [{"elbow.friction.viscous": 0.1 * k} for k in range(1, 7)]
    seen: list[tuple[int, int]] = []
    runs = simulate_batch(
        model, [log, *(Trial(log, change) for change in changes)], workers=3, progress=lambda *n: seen.append(n)
    )
    alone = [simulate(model, log), *(simulate(model.with_parameters(change), log) for change in changes)]
    assert runs == alone
    assert seen[-1] == (7, 7)


def test_initial_states_are_given_by_name(log: Experiment) -> None:
    (run,) = simulate_batch(nominal(), [Trial(log, initial_state={"elbow.position": 0.5})], progress=True)
    assert isinstance(run, Run)
    assert run["elbow.position"][0] == 0.5


def test_a_trial_that_fails_is_an_error_in_the_list(log: Experiment) -> None:
    empty = Experiment.from_arrays(
        log.time, {"shoulder.position": log["shoulder.position"]}, units={"shoulder.position": "rad"}, name="empty"
    )
    trials = [
        Trial(log),
        Trial(empty),
        Trial(log, {"shoulder.friction.viscous": 1e7}),
        Trial(log, {"no.such": 1.0}),
        Trial(log, initial_state=[np.nan, 0.0, 0.0, 0.0]),
    ]
    good, missing, diverged, unknown, wrong = simulate_batch(nominal(), trials, setup=Setup("rk4"))
    assert isinstance(good, Run)
    assert isinstance(missing, ExperimentError)
    assert isinstance(diverged, DivergedError)
    assert isinstance(diverged.run, Run)
    assert isinstance(unknown, ModelError)
    assert isinstance(wrong, SimulationError)
    assert "initial_state[0]" in str(wrong)


def test_nonsense_is_refused(log: Experiment) -> None:
    with pytest.raises(SimulationError, match="choose one of"):
        simulate_batch(nominal(), [log], "backwards")
    with pytest.raises(SimulationError, match="at least 1"):
        simulate_batch(nominal(), [log], workers=0)


def test_ctrl_c_stops_all_trials(log: Experiment) -> None:
    trials = [log] * 8
    begin = time.process_time()
    with pytest.raises(KeyboardInterrupt), pressed(0.3):
        simulate_batch(nominal(), trials, workers=2, setup=Setup("rk4", substeps=100_000))
    assert time.process_time() - begin < 3.0
