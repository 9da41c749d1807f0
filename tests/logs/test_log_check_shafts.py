"""Checks of joints whose angles are worked out from encoders of the shafts of a differential."""

from pathlib import Path

import numpy as np
import pytest

import vpm
from vpm.experiment import Experiment

MODEL = vpm.Model.from_toml("""
    name = "differential"
    gravity = [0.0, 0.0, -9.81]
    bodies.table = { mass = 1.0, inertia = [0.02, 0.02, 0.02, 0.0, 0.0, 0.0] }
    bodies.disc = { mass = 1.0, inertia = [0.005, 0.005, 0.005, 0.0, 0.0, 0.0] }
    joints.near = { type = "revolute", parent = "world", child = "table", axis = [0.0, 0.0, 1.0] }
    joints.far = { type = "revolute", parent = "world", child = "disc", axis = [0.0, 0.0, 1.0] }
    transmissions.left = { ratios = { near = 10.0, far = 10.0 } }
    transmissions.right = { ratios = { near = 10.0, far = -10.0 } }
    actuators.one = { transmission = "left", gain = 1.0, command_unit = "N m" }
    actuators.two = { transmission = "right", gain = 1.0, command_unit = "N m" }
""")
COUNT = 2.0 * np.pi / 1024


def test_a_joint_that_rests_while_both_shafts_turn_alike_is_no_frozen_sensor() -> None:
    """Both counters step at the same samples then, and their difference stays exactly what it is."""
    step = 1e-3
    time = step * np.arange(6000)
    near, far = np.sin(2.0 * time) + 0.4 * np.sin(5.0 * time), 0.3 * np.sin(3.0 * time) * np.sin(0.7 * time)
    rest = np.clip(time - 3.0, 0.0, 0.05)
    far = np.interp(time - rest, time, far)
    efforts = [inertia * np.gradient(np.gradient(q, step), step) for inertia, q in ((0.02, near), (0.005, far))]
    values = {
        "left.position": COUNT * np.round(10.0 * (near + far) / COUNT),
        "right.position": COUNT * np.round(10.0 * (near - far) / COUNT),
        "one.command": (efforts[0] + efforts[1]) / 20.0,
        "two.command": (efforts[0] - efforts[1]) / 20.0,
    }
    log = Experiment.from_arrays(time, values, {}, name="log", model=MODEL)
    assert "frozen" not in [one.kind for one in vpm.check_log(MODEL, log, workers=1).findings]


FINGER = """
name = "finger"
gravity = [0.0, 0.0, -9.81]
bodies.inner = { mass = 0.5, center_of_mass = [0.1, 0.0, 0.0], inertia = [0.0, 2e-3, 2e-3, 0.0, 0.0, 0.0] }
bodies.outer = { mass = 0.3, center_of_mass = [0.1, 0.0, 0.0], inertia = [0.0, 1e-3, 1e-3, 0.0, 0.0, 0.0] }
joints.base = { type = "revolute", parent = "world", child = "inner", axis = [0.0, -1.0, 0.0] }
joints.tip = { type = "revolute", parent = "inner", child = "outer", axis = [0.0, -1.0, 0.0], translation = [0.2,0,0] }
transmissions.belt = { ratios = { base = 0.7, tip = 1.0 } }
actuators.first = { joint = "base", gain = 1.0, command_unit = "N m" }
actuators.second = { transmission = "belt", gain = 1.0, command_unit = "N m" }
channels.time = { column = "t", unit = "s" }
channels."base.position" = { column = "one", unit = "rad" }
channels."belt.position" = { column = "two", unit = "rad" }
channels."first.command" = { column = "u", unit = "N m" }
channels."second.command" = { column = "v", unit = "N m" }
"""


def test_a_late_shaft_that_tells_a_joint_beside_another_is_found(tmp_path: Path) -> None:
    """The joint alone is never late as the shaft is, for the other joint turns the shaft, too."""
    model, random = vpm.Model.from_toml(FINGER), np.random.default_rng(1)
    time, late = 2e-3 * np.arange(4000), 6
    base, tip = (
        0.8 * np.sin(4.0 * time) + 0.2 * np.sin(13.0 * time),
        0.9 * np.sin(5.0 * time) + 0.2 * np.sin(11.0 * time),
    )
    pose = np.column_stack([base, tip])
    speed = np.gradient(pose, 2e-3, axis=0)
    moved = zip(pose, speed, np.gradient(speed, 2e-3, axis=0), strict=True)
    efforts = np.array([model.inverse_dynamics(*one) for one in moved])
    belt = tip + 0.7 * base
    read = np.column_stack([base, np.append(np.full(late, belt[0]), belt[:-late])])
    read += 1e-4 * random.standard_normal(read.shape)
    columns = np.column_stack([time, read, efforts[:, 0] - 0.7 * efforts[:, 1], efforts[:, 1]])
    np.savetxt(tmp_path / "log.csv", columns, delimiter=",", header="t,one,two,u,v", comments="")
    log = Experiment.load(tmp_path / "log.csv", model=model)
    (one,) = vpm.check_log(model, log, workers=1).mistakes
    assert one.sentence.startswith("belt.position comes")
    assert one.delay == pytest.approx(2e-3 * late, abs=1e-3)
    assert one.lines["belt.position"].startswith('"belt.position" = { column = "two", unit = "rad", delay = 0.01')
