"""Checks of joints whose angles are worked out from encoders of the shafts of a differential."""

import numpy as np

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
