"""An accelerometer that is read less often than the drive gets commands: it jumps with them, and lines do not."""

from pathlib import Path

import numpy as np
import pytest

from vpm import Experiment
from vpm.model import ChannelEntry, Model
from vpm.ranking.between_readings import between_readings
from vpm.ranking.settings import Settings
from vpm.ranking.tracked_records import TrackedRecords, Tracker

SLIDE = """
name = "slide"
gravity = [0.0, 0.0, 0.0]
[bodies.carriage]
mass = 2.0
inertia = [0.1, 0.1, 0.1, 0.0, 0.0, 0.0]
[joints.axis]
type = "prismatic"
parent = "world"
child = "carriage"
axis = [1.0, 0.0, 0.0]
[actuators.drive]
joint = "axis"
gain = 1.0
command_unit = "N"
[imus.chip]
parent = "carriage"
"""
TABLE = {
    "time": ChannelEntry(column="t", unit="s"),
    "axis.position": ChannelEntry(column="x", unit="m"),
    "drive.command": ChannelEntry(column="F", unit="N"),
    "chip.ax": ChannelEntry(column="a", unit="m/s^2"),
}
STEP, COUNT, MASS = 0.004, 1500, 2.0


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Experiment:
    """Position and acceleration of a mass by Newton's law, forces held from sample to sample; every third read."""
    force = 5.0 * np.sin(3.0 * STEP * np.arange(COUNT)) + np.random.default_rng(1).normal(size=COUNT)
    speed = np.append(0.0, np.cumsum(force[:-1])) * STEP / MASS
    place = np.append(0.0, np.cumsum(speed[:-1] * STEP + 0.5 * force[:-1] / MASS * STEP**2))
    rows = [
        f"{STEP * k!r},{x!r},{f!r},{'' if k % 3 else repr(f / MASS)}"
        for k, (x, f) in enumerate(zip(place.tolist(), force.tolist(), strict=True))
    ]
    path: Path = tmp_path_factory.mktemp("log") / "log.csv"
    path.write_text("\n".join(["t,x,F,a", *rows]), encoding="utf-8")
    return Experiment.load(path, TABLE, irregular="interpolate")


def test_the_right_model_leaves_nothing_of_an_accelerometer_that_is_read_less_often(log: Experiment) -> None:
    tracked = TrackedRecords(Model.from_toml(SLIDE), [log], Settings())
    residual, _ = tracked.follow(tracked.model, tracked.model.theta, Tracker(1.0))
    chip = residual[250:-3, tracked.records[0].channels.index("chip.ax")]
    assert np.sqrt(np.mean(chip**2)) < 1e-3 * np.std(log["chip.ax"])


def test_derivatives_pass_as_outputs_do(log: Experiment) -> None:
    values = np.random.default_rng(2).normal(size=(len(log), 2))
    both = between_readings(log, "chip.ax", values)
    for column in range(2):
        np.testing.assert_array_equal(both[:, column], between_readings(log, "chip.ax", values[:, column]))
    np.testing.assert_allclose(both[3:-3:3], values[3:-3:3], atol=1e-9)


def test_a_record_keeps_the_times_of_its_readings(log: Experiment, tmp_path: Path) -> None:
    part = log.trim(1.0, 3.0).align({"chip.ax": 0.1})
    assert part.read_at["chip.ax"][1] == pytest.approx(3.0 * STEP - 0.1)
    log.save(tmp_path / "log.npz")
    assert Experiment.load(tmp_path / "log.npz") == log
    assert "chip.ax" not in log.with_channel("chip.ax", log["chip.ax"], "m/s^2").read_at
    assert not log.resample(100.0).read_at
