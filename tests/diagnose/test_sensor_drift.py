"""Straight lines in what a model leaves of a channel: a drifting sensor, or oil that leaks."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import vpm
from vpm.discrepancy.diagnosis import ChannelGap
from vpm.discrepancy.noise.sensor_drift import sensor_drifts
from vpm.identify import InverseDynamicsProblem

RIG = vpm.Model.load(Path(__file__).parents[2] / "examples" / "servo_cylinder" / "rig.toml")
TIME = 1e-4 * np.arange(6000)
PRESSURE = "servo.pressure_a"


def swung(rate: float) -> vpm.Experiment:
    """A slide on its cylinder, with the pressure of one chamber."""
    command = vpm.Experiment.from_arrays(TIME, {"servo.command": 2e-3 * np.sin(rate * TIME)}, model=RIG)
    run = vpm.simulate(RIG, command, integrator="rosenbrock")
    held = {name: run[name] for name in ("axis.position", PRESSURE, "servo.pressure_b")}
    return vpm.Experiment.from_arrays(TIME, {**held, "servo.command": command["servo.command"]}, model=RIG)


def test_a_pressure_that_leaves_its_prediction_along_a_straight_line_is_no_drift() -> None:
    """Where nothing else flows, a leak q moves the pressure of a volume V by beta q t / V (Merritt 1967, 3.2)."""
    problem = InverseDynamicsProblem(RIG, [swung(20.0)])
    assert PRESSURE in problem.shown
    ramp, floor = 1e6, 1e3  # Pa in a record, Pa
    residual = np.zeros(max(block.samples.stop for block in problem.blocks))
    for block in problem.blocks:
        if block.channel == PRESSURE:
            residual[block.samples] = block.weight * ramp * block.time / TIME[-1]
    left = ChannelGap(ramp, ramp, ramp, floor, "Pa", 1e7, "inverse_dynamics")
    gap = dict.fromkeys(problem.shown, left)
    assert sensor_drifts(RIG, [(problem, residual)], gap, 2.0) == []
