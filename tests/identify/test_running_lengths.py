"""What moves the end of a spring runs on between samples, while commands of controllers are held."""

from pathlib import Path

import numpy as np

from vpm import Experiment, Model, Setup, identify, simulate

#: A wheel of 40 kg on a tyre of 190 kN/m above a road whose height is measured, with a drive that a controller holds.
STAND = """
name = "wheel on a road"
gravity = [0.0, 0.0, 0.0]
[bodies.wheel]
mass = 40.0
[joints.height]
type = "prismatic"
parent = "world"
child = "wheel"
axis = [0.0, 0.0, 1.0]
[lines.tyre]
from = { parent = "world", point = [0.0, 0.0, -0.3] }
to = { parent = "wheel" }
[actuators.road]
type = "spring_damper"
line = "tyre"
stiffness = 190e3
free_length = 0.3
damping = { value = 300.0, uncertainty = 100.0 }
[actuators.motor]
joint = "height"
gain = 1.0
command_unit = "1"
"""
EVERY = 40


def recorded(model: Model) -> Experiment:
    """Every fortieth sample of a run at 20 kHz, in which the road runs on and the motor's command is held."""
    time = np.arange(40_001) / 20e3
    road = np.sum([2e-3 * np.sin(2.0 * np.pi * f * time + f) for f in (3.0, 5.3, 8.1)], axis=0)
    held = np.repeat(200.0 * np.sin(2.0 * np.pi * 4.1 * time[::EVERY]), EVERY)[: time.size]
    columns = {"road.command": road, "motor.command": held}
    run = simulate(model, Experiment.from_arrays(time, columns, model=model), "free_run")
    few = {name: values[::EVERY] for name, values in columns.items()}
    return Experiment.from_arrays(
        time[::EVERY], {**few, "height.position": run["height.position"][::EVERY]}, model=model
    )


def test_a_measured_road_does_not_come_half_a_sample_late(tmp_path: Path) -> None:
    """A road that is held comes 1 ms late. The fit then takes a quarter of the tyre's damping for less phase."""
    (path := tmp_path / "stand.toml").write_text(STAND)
    model = Model.load(path)
    log = recorded(model)

    def damping(setup: Setup) -> float:
        return float(identify(model, [log], mode="free_run", setup=setup).model.parameters["road.damping"].value)

    assert abs(damping(Setup()) - 300.0) < 10.0
    assert damping(Setup(hold="zero_order")) < 250.0
