"""A ripple on a closed loop: efforts of all joints, by their speeds, show its period beside what the loop carries."""

import numpy as np
import pytest

import vpm
from vpm.discrepancy.screening.candidates import candidates
from vpm.model import Model
from vpm.ranking import Settings
from vpm.ranking.substitute_records import shown
from vpm.ranking.tracked_records import TrackedRecords

STEP, PERIOD, RIPPLE = 4e-3, 0.05, 0.5  # s, rad, N m


def swung() -> tuple[Model, vpm.Experiment]:
    """A parallelogram without a ripple, and the record of one with it: 0.5 beside the 14 N m that hold its weight."""
    model = Model.load("examples/loops/parallelogram.toml")
    rippled = model.with_effect("torque_ripple", at="left_crank", period=PERIOD, cosine=0.0, sine=RIPPLE)
    time = STEP * np.arange(1500)
    wanted = 0.5 + 0.35 * np.sin(1.1 * time) + 0.2 * np.sin(2.9 * time)
    simulation = vpm.Simulation(rippled, STEP, state={"left_crank.position": 0.5})
    rows = []
    for target in wanted:
        angle, speed = simulation["left_crank.position"], simulation["left_crank.velocity"]
        command = 0.3 * 9.81 * 3.0 * np.cos(angle) + 300.0 * (target - angle) - 25.0 * speed
        rows.append((angle, command))
        simulation.step([command])
    angle, command = np.array(rows).T
    columns = {"left_crank.position": angle, "motor.command": command}
    return model, vpm.Experiment.from_arrays(time, columns, model=model)


def test_the_period_of_a_ripple_shows_beside_the_forces_of_a_loop() -> None:
    model, record = swung()
    data = shown(model, TrackedRecords(model, [record], Settings()))
    residual, _ = data.evaluate(model, model.theta)
    (block,) = [one for one in data.blocks if one.channel == "left_crank.effort"]
    found = np.std(residual[block.samples]) / block.weight
    assert 0.3 * RIPPLE < found < 1.2 * RIPPLE / np.sqrt(2.0)  # a filter takes the fast part; weights would be 10 N m
    listed = candidates(model, data, residual, ["torque_ripple"])
    (ripple,) = [one for one in listed if one.site == "left_crank"]
    assert ripple.starts[0]["period"] == pytest.approx(PERIOD, rel=0.02)
