"""Springs with hysteresis: what they remember of the motion before a record."""

import numpy as np

import vpm
from vpm import Experiment, Model
from vpm.ranking.settings import Settings
from vpm.ranking.tracked_records import TrackedRecords, Tracker
from vpm.simulate import Setup

#: An arm under gravity behind a soft gear, whose deflection is read.
ARM = Model.from_toml("""
    name = "arm behind a gear"
    gravity = [0.0, 0.0, -9.81]
    [bodies.arm]
    mass = 8.0
    center_of_mass = [0.05, 0.0, 0.0]
    inertia = [0.1, 0.15, 0.15, 0.0, 0.0, 0.0]
    [joints.axis]
    type = "revolute"
    parent = "world"
    child = "arm"
    axis = [0.0, -1.0, 0.0]
    [actuators.motor]
    joint = "axis"
    gain = 1.0
    command_unit = "N m"
    [controllers.servo]
    type = "pd"
    actuator = "motor"
    measures = "axis.position"
    proportional = 200.0
    derivative = 20.0
    [[effects]]
    type = "viscous_friction"
    at = "axis"
    viscous = 1.0
    [[effects]]
    type = "joint_compliance"
    at = "axis"
    stiffness = { value = 6000.0, uncertainty = 1000.0 }
    damping = 5.0
    inertia = 0.2
    [[effects]]
    type = "hysteresis"
    at = "axis_deflection"
    force = 2.0
    displacement = 1.5e-4
""")


def record(seed: int) -> Experiment:
    """Three seconds of moves after one before; gravity never changes its sign, so that nothing is forgotten."""
    time, draw = 1e-3 * np.arange(5000), np.random.default_rng(seed)
    before, moves = draw.uniform(0.7, 1.0), 0.6 * np.sin(3.0 * (time - 2.0)) * np.sin(draw.uniform(2.0, 3.0) * time)
    course = np.where(time < 2.0, before * np.sin(np.pi * time / 2.0) ** 2, moves)
    log = Experiment.from_arrays(time, {"motor.reference": course}, model=ARM)
    run = vpm.simulate(ARM, log, "closed_loop")
    noise = {"axis.position": 1e-6, "axis_deflection.position": 1e-6, "motor.command": 0.0}
    read = {name: run[name] + size * draw.standard_normal(len(time)) for name, size in noise.items()}
    return Experiment.from_arrays(time, read, model=ARM, name=f"moves {seed}").trim(2.0, 5.0)


def test_first_readings_tell_what_a_spring_remembers() -> None:
    log = record(1)
    tracked = TrackedRecords(ARM, [log], Settings(), Setup())
    place = tracked.records[0].channels.index("axis_deflection.position")
    for band in Settings().bands:
        left, _ = tracked.follow(ARM, ARM.theta, Tracker(band))
        assert np.sqrt(np.mean(left[500:, place] ** 2)) < 0.01 * np.sqrt(np.mean(log["axis_deflection.position"] ** 2))


def test_a_spring_that_was_loaded_before_the_record_is_named() -> None:
    """The inverse-dynamics residual begins without memory: it would give another force."""
    nominal = ARM.without_effect("hysteresis", at="axis_deflection")
    why = vpm.diagnose(nominal, [record(1)], [record(2)], effects=["hysteresis", "coulomb_friction"])
    assert [(one.name, one.site) for one in why.effects] == [("hysteresis", "axis_deflection")], why.summary
    force, way, _ = why.effects[0].parameters
    assert abs(force.value / 2.0 - 1.0) < 0.02
    assert abs(way.value / 1.5e-4 - 1.0) < 0.02
    assert any("remembers of the motion before each record" in note for note in why.notes)
