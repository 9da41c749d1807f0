"""Records of cylinders that begin abruptly: chambers along the motion keep nothing of a wrong first state."""

import numpy as np

import vpm
from vpm.identify import InverseDynamicsProblem, gaps
from vpm.model import Model

RIG = "examples/servo_cylinder/rig.toml"
#: Of a press: so much oil behind a narrow valve keeps an error for some 40 ms.
PRESS = {
    "slide.mass": 400.0,
    "servo.cylinder.bore": 0.063,
    "servo.cylinder.rod": 0.036,
    "servo.cylinder.stroke": 0.25,
    "servo.retracted_length": -0.125,
    "servo.cylinder.line_a": 4e-5,
    "servo.cylinder.line_b": 4e-5,
    "servo.valve.flow_gain": 5.3e-5,
    "servo.valve.frequency": 300.0,
}
#: Current, A, and frequency, rev/s: its first sample is its largest.
CURRENT, FREQUENCY = 2e-3, 1.0


def _record(rig: Model) -> vpm.Experiment:
    """Log of a slide at rest whose valve opens at its first sample."""
    time = 1e-3 * np.arange(3000)
    command = CURRENT * np.cos(2.0 * np.pi * FREQUENCY * time)
    record = vpm.Experiment.from_arrays(time, {"servo.command": command}, model=rig)
    run = vpm.simulate(rig, record, integrator="adaptive(1e-8)")
    for channel in ("axis.position", "servo.pressure_a", "servo.pressure_b"):
        record = record.with_channel(channel, run[channel], rig.channel_unit(channel))
    return record


def test_chambers_keep_nothing_of_a_wrong_first_state() -> None:
    """Nobody knows where the spool was before the first sample; oil that it lets in would stay for ten times as long.

    The exact model leaves no more of a record without noise than the filter does of a start as sharp as that.
    """
    rig = Model.load(RIG).with_parameters(PRESS)
    problem = InverseDynamicsProblem(rig, [_record(rig)], cutoff=120.0)
    residual, _ = problem.evaluate(rig, rig.theta)
    _, share, *_ = gaps(problem, residual)["servo.pressure_a"]
    assert share < 1e-4
