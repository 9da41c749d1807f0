"""Where simulations begin joints that nobody measures or drives: where weights, springs and ropes hold them."""

import numpy as np
import pytest

import vpm
from vpm.experiment import Experiment
from vpm.initial import initial_state
from vpm.simplify.judge import reference_mode
from vpm.simulate import comparing_mode
from winch import LOAD, MODEL, RADIUS, ROPE, G, record

#: The rope of the machine as it is.
STRETCH = LOAD * G / ROPE
TRUE = MODEL.with_parameters({"load.mass": LOAD, "rope.spring.stiffness": ROPE})


def first(model: vpm.Model, log: Experiment) -> dict[str, float]:
    return dict(zip(model.state_names, initial_state(model, log, model.theta).tolist(), strict=True))


def test_a_load_on_a_rope_begins_below_its_drum() -> None:
    """At rest it hangs a stretch of m g/k below, and in mid-motion it goes with the drum."""
    for begins in (0, 700):
        log = record(1, begins=begins)
        state = first(TRUE, log)
        assert state["lift.position"] == pytest.approx(RADIUS * state["shaft.position"] - STRETCH, abs=1e-9)
        assert state["lift.velocity"] == pytest.approx(RADIUS * state["shaft.velocity"], rel=1e-4, abs=1e-6)
    assert abs(state["lift.velocity"]) > 0.1


def test_a_rest_knows_of_the_errors_of_the_encoder() -> None:
    """A zero that is off by 0.5 rad moves what is read, not what hangs."""
    log = record(1)
    read = log.with_channel("shaft.position", 1.1 * log["shaft.position"] + 0.5, "rad")
    text = TRUE.to_dict() | {"sensors": {"encoder": {"measures": "shaft.position"}}}
    sensed = vpm.Model.from_dict(text).with_effect("sensor_offset", "encoder", value=0.5)
    sensed = sensed.with_effect("sensor_gain", "encoder", value=1.1)
    assert first(sensed, read)["lift.position"] == pytest.approx(first(TRUE, log)["lift.position"], abs=1e-9)


def test_a_load_that_nothing_draws_back_begins_at_zero() -> None:
    """Nothing tells where a slide lies on which no force acts; nor does a log without any position tell of a rope."""
    text = TRUE.to_dict()
    text["gravity"] = [0.0, 0.0, 0.0]
    loose = vpm.Model.from_dict(text).without_effect("spring", "rope")
    assert first(loose, record(1))["lift.position"] == 0.0
    bare = Experiment.from_arrays(np.arange(50) * 2e-3, {"motor.command": np.zeros(50)}, model=TRUE, name="bare")
    assert first(TRUE, bare)["lift.position"] == 0.0


def test_a_free_run_follows_a_log_of_the_drum_alone() -> None:
    """The mode in which the two are compared where restarts would need the load's place.

    The log does not tell the first current either: what that is off makes the rope ring. A load at zero would stretch
    it by a metre, which is 25 kN.
    """
    log = record(1, samples=500)
    assert comparing_mode(TRUE, log) == "free_run"
    assert reference_mode(TRUE, [log], "data", None) == "free_run"
    run = vpm.simulate(TRUE, log, comparing_mode(TRUE, log))
    assert np.max(np.abs(run["cell.fz"] - log["cell.fz"])) < 0.05 * LOAD * G
    lift = RADIUS * log["shaft.position"] - STRETCH
    whole = log.with_channel("lift.position", lift, "m")
    assert comparing_mode(TRUE, whole) == "restarts"
    assert reference_mode(TRUE, [whole], "data", None) == "restarts"
