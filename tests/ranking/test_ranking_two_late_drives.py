"""Two late drives: what came in before both delays did is asked for again beside them."""

import numpy as np
import pytest

import vpm
from vpm.discrepancy.parallel_candidates import ParallelCandidates
from vpm.experiment import Experiment
from vpm.ranking.look import Look
from vpm.ranking.ranking_search import Search
from vpm.ranking.settings import Settings
from vpm.ranking.tried_effect import Trial

STEP, LATE, PARTS = 4e-3, 3, 8
STAGE = vpm.Model.from_toml("""
    name = "stage"
    gravity = [0.0, 0.0, 0.0]
    bodies.base = { mass = { value = 3.0, uncertainty = 0.3 } }
    bodies.top = { mass = { value = 1.0, uncertainty = 0.1 } }
    joints.low = { type = "prismatic", parent = "world", child = "base", axis = [1.0, 0.0, 0.0] }
    joints.high = { type = "prismatic", parent = "base", child = "top", axis = [1.0, 0.0, 0.0] }
    actuators.first = { joint = "low", gain = 1.0, command_unit = "N" }
    actuators.second = { joint = "high", gain = 1.0, command_unit = "N" }
    sensors.lower = { measures = "low.position" }
    sensors.upper = { measures = "high.position" }
    [[effects]]
    type = "viscous_friction"
    at = "low"
    viscous = { value = 6.0, uncertainty = 1.0 }
    [[effects]]
    type = "viscous_friction"
    at = "high"
    viscous = { value = 4.0, uncertainty = 1.0 }
""")


def late() -> Experiment:
    """Two masses, one on the other, of which both drives do what was asked three samples before."""
    random, time = np.random.default_rng(1), STEP * np.arange(2500)
    size, often, phase = (random.uniform(low, high, (2, 5, 1)) for low, high in ((1.0, 3.0), (0.2, 8.0), (0.0, 6.0)))
    asked = np.sum(size * np.sin(2.0 * np.pi * often * time + phase), axis=1).T
    place, speed, places = np.zeros(2), np.zeros(2), np.zeros((len(time), 2))
    for k in range(len(time)):
        places[k] = place
        for _ in range(PARTS):
            low, high = asked[max(k - LATE, 0)] - np.array([6.0, 4.0]) * speed
            base = (low - high) / 3.0
            speed = speed + STEP / PARTS * np.array([base, high - base])
            place = place + STEP / PARTS * speed
    read = places + 2e-6 * random.standard_normal(places.shape)
    columns = {"low.position": read[:, 0], "high.position": read[:, 1]}
    commands = {"first.command": asked[:, 0], "second.command": asked[:, 1]}
    return Experiment.from_arrays(time, {**columns, **commands}, model=STAGE, name="stage")


class Misled(Search):
    """A search that takes a lag of one drive first."""

    def _round(self, looks: list[Look]) -> tuple[Trial | None, list[Trial]]:  # type: ignore[override]
        best, tried = super()._round(looks)
        if looks[0].fitted.structure.effects:
            return best, tried
        lags = [trial for trial in tried if trial.key == ("actuator_lag", "first")]
        (lag,) = self.finished(lags[:1])
        return lag, [lag]


def test_a_lag_is_dropped_once_both_drives_are_late() -> None:
    tried, record = ["input_delay", "actuator_lag"], late()
    search = Misled(STAGE, [record], tried, Settings(), None, ParallelCandidates(1, None), lambda _: None, [record])
    ranking = search.run()
    assert ranking.rounds[0][0].effect == "actuator_lag"
    assert {(one.effect, one.site) for one in ranking.effects} == {("input_delay", "first"), ("input_delay", "second")}
    for one in ranking.effects:  # at the values that both have beside each other
        (value,) = one.values.values()
        assert value == ranking.model.parameters[f"{one.site}.delay.time"].value
        assert value == pytest.approx(LATE * STEP, rel=0.05)
