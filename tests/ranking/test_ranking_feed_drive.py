"""A feed drive whose screw gives way: an encoder on its motor, a scale on its table."""

from __future__ import annotations

from functools import cache
from math import exp, tanh

import numpy as np
import pytest
from scipy.signal import butter, freqz, sosfilt

import vpm
from vpm.experiment import Experiment, read_noise
from vpm.model import Model
from vpm.numbers import Array

MOTOR, TABLE, STIFFNESS, DAMPING = 60.0, 30.0, 2e6, 400.0  # kg, kg, N/m, N s/m
DRY, OIL = (60.0, 30.0), (150.0, 60.0)  # N, N s/m: of the motor, of the table
TURNING, STRIBECK = 1e-3, 4e-3  # m/s
NOISE = 1e-7  # m
OVER = 1.2e-5  # m: way over which the spring turns its resistance round
FINE, RATE = 1e-4, 500  # s, Hz

NOMINAL = """
name = "feed drive"
gravity = [0.0, 0.0, 0.0]
[bodies.table]
mass = { value = 27.0, uncertainty = 4.0, min = 5.0 }
[joints.axis]
type = "prismatic"
parent = "world"
child = "table"
axis = [1.0, 0.0, 0.0]
rotor_inertia = { value = 68.0, uncertainty = 9.0, min = 20.0 }
[actuators.motor]
joint = "axis"
gain = 1.0
command_unit = "N"
"""
RUBS = """
[[effects]]
type = "coulomb_friction"
at = "axis"
side = "{side}"
coulomb = {{ value = {dry}, uncertainty = {half_dry} }}
[[effects]]
type = "viscous_friction"
at = "axis"
side = "{side}"
viscous = {{ value = {oil}, uncertainty = {half_oil} }}
"""
GIVES_WAY = """
[[effects]]
type = "joint_compliance"
at = "axis"
stiffness = { value = 2.3e6, uncertainty = 5e5 }
damping = { value = 300.0, uncertainty = 200.0 }
"""


def rubs(side: str, dry: float, oil: float) -> str:
    return RUBS.format(side=side, dry=dry, half_dry=0.5 * dry, oil=oil, half_oil=0.5 * oil)


WHOLE = Model.from_toml(NOMINAL + rubs("motor", 80.0, 180.0))
SPLIT = Model.from_toml(NOMINAL + GIVES_WAY + rubs("motor", 50.0, 130.0) + rubs("link", 26.0, 70.0))


@cache
def moved(
    seed: int, excess: float = 0.0, every: int = 1, noise: float = NOISE, lost: float = 0.0, hiss: float = 0.0
) -> tuple[Array, Array]:
    """Readings (N, 2) of both sides and forces (N,) of a drive under position control, ``every`` times as often."""
    random = np.random.default_rng(seed)
    step, count = round(1.0 / (RATE * every * FINE)), 5 * RATE * every
    starts = np.linspace(0.0, 4.5, 12)
    ways = np.append(random.uniform(0.01, 0.05, 6), random.uniform(5e-4, 2e-3, 6)) * random.choice([-1.0, 1.0], 12)
    time = np.arange(count) / (RATE * every)
    share = np.clip((time[:, None] - starts) / 0.35, 0.0, 1.0)
    goals = (share**3 * (10.0 - 15.0 * share + 6.0 * share**2)) @ random.permutation(ways)
    x = v = y = w = total = bristle = 0.0
    read, forces = np.empty((count, 2)), np.empty(count)
    for k, goal in enumerate(goals):
        read[k] = x, y
        error = 40.0 * (goal - x) - v
        total += error * step * FINE
        forces[k] = force = 12000.0 * (error + 40.0 * total) + hiss * random.standard_normal()
        for _ in range(step):
            between = STIFFNESS * (x - y) + DAMPING * (v - w) + lost * bristle
            bristle += FINE * (v - w - abs(v - w) * bristle) / OVER  # P. Dahl 1968
            dry = DRY[1] + excess * exp(-((w / STRIBECK) ** 2))
            v += FINE * (force - between - DRY[0] * tanh(v / TURNING) - OIL[0] * v) / MOTOR
            w += FINE * (between - dry * tanh(w / TURNING) - OIL[1] * w) / TABLE
            x, y = x + FINE * v, y + FINE * w
    return read + noise * random.standard_normal(read.shape), forces


def logged(model: Model, read: Array, forces: Array) -> Experiment:
    channels = {
        "axis.position": read[:, 0],
        "axis_deflection.position": read[:, 1] - read[:, 0],
        "motor.command": forces,
    }
    return Experiment.from_arrays(np.arange(len(forces)) / RATE, channels, model=model)


def test_friction_of_a_whole_axis_is_on_both_sides_of_what_gives_way() -> None:
    """Else a table far too heavy for the file takes the place of friction at the motor, and leaves no error."""
    ranking = vpm.rank(
        WHOLE,
        [logged(WHOLE, *moved(1))],
        [logged(WHOLE, *moved(2))],
        effects=["joint_compliance", "viscous_friction", "coulomb_friction"],
        workers=1,
    )
    values = {name: parameter.value for name, parameter in ranking.model.parameters.items()}
    assert {(one.effect, one.side) for one in ranking.effects} >= {
        ("joint_compliance", "motor"),
        ("coulomb_friction", "motor"),
    }
    assert abs(values["axis.friction.coulomb"] - DRY[0]) < 0.2 * DRY[0]
    assert abs(values["table.mass"] - 27.0) < 2.0 * 4.0


def test_what_a_decimating_logger_leaves_of_noise_shows_in_the_noise() -> None:
    """The gain of a Butterworth filter, and one where none is (S. Butterworth, 1930)."""
    read, forces = moved(3, every=2)
    sections = butter(4, 0.8 * RATE / 2.0, fs=2.0 * RATE, output="sos")
    kept = sosfilt(sections, np.column_stack([read, forces]), axis=0)[::2]
    frequency = np.array([0.1, 0.3, 0.34, 0.41, 0.47])
    zeros, poles = butter(4, 0.8 * RATE / 2.0, fs=2.0 * RATE)
    power = np.abs(freqz(zeros, poles, 0.5 * frequency, fs=1.0)[1]) ** 2
    for part, law in ((kept, power), (np.column_stack([read, forces])[::2], np.ones(5))):
        log = logged(SPLIT, part[:, :2], part[:, 2])
        assert np.max(np.abs(read_noise(log, "axis_deflection.position", frequency) - law)) < 0.25


def test_nothing_is_left_where_a_logger_filtered_all_channels_alike() -> None:
    """Noise of which a logger took the part above 200 Hz is noise all the same."""
    sections = butter(4, 0.8 * RATE / 2.0, fs=2.0 * RATE, output="sos")
    logs = []
    for seed in (3, 4):
        read, forces = moved(seed, every=2, noise=1e-6)
        kept = sosfilt(sections, np.column_stack([read, forces]), axis=0)[::2]
        logs.append(logged(SPLIT, kept[:, :2], kept[:, 2]))
    ranking = vpm.rank(SPLIT, logs[:1], logs[1:], effects=["coulomb_friction"], workers=1)
    gap = ranking.gaps["axis_deflection.position"]
    assert not ranking.effects
    assert gap.after < 1.3 * gap.noise
    assert gap.noise < 1.1 * np.sqrt(2.0 * 0.4) * 1e-6  # two readings, 200 of 500 Hz


@pytest.mark.parametrize("acts", [True, False])
def test_noise_of_a_held_command_is_missing_nowhere_unless_it_acts(acts: bool) -> None:
    """A read current rings a shaft in the model alone; one that hisses itself rings the machine, and is exact."""
    logs = []
    for seed in (9, 10):
        read, forces = moved(seed, hiss=4.0 if acts else 0.0)
        heard = forces if acts else forces + 4.0 * np.random.default_rng(seed).standard_normal(len(forces))
        logs.append(logged(SPLIT, read, heard))
    ranking = vpm.rank(SPLIT, logs[:1], logs[1:], effects=["coulomb_friction"], workers=1)
    gap = ranking.gaps["axis_deflection.position"]
    assert gap.after < 1.3 * gap.noise
    assert (gap.noise < 1.5 * np.sqrt(2.0) * NOISE) == acts


def test_a_named_effect_is_measured_by_a_tracker_that_follows_it() -> None:
    """Friction that falls with speed makes a slowly observed drive stick and slip, where its controller held it."""
    ranking = vpm.rank(
        SPLIT,
        [logged(SPLIT, *moved(5, excess=25.0))],
        [logged(SPLIT, *moved(6, excess=25.0))],
        effects=["stribeck_friction"],
        workers=1,
    )
    assert [(one.effect, one.side) for one in ranking.effects] == [("stribeck_friction", "link")]
    for gap in ranking.gaps.values():
        assert gap.after < 0.2 * gap.recalibrated


def test_a_spring_that_loses_force_in_itself_has_the_hysteresis_at_its_own_joint() -> None:
    """Dahl's law of the wind-up, not of the way of the table, which is ten thousand times as long."""
    ranking = vpm.rank(
        SPLIT,
        [logged(SPLIT, *moved(7, lost=20.0))],
        [logged(SPLIT, *moved(8, lost=20.0))],
        effects=["hysteresis", "cubic_spring"],
        workers=1,
    )
    assert [(one.effect, one.site) for one in ranking.effects] == [("hysteresis", "axis_deflection")]
    values = {name: parameter.value for name, parameter in ranking.model.parameters.items()}
    assert abs(values["axis_deflection.hysteresis.force"] - 20.0) < 2.0
    assert abs(values["axis_deflection.hysteresis.displacement"] - OVER) < 0.2 * OVER


def test_a_spring_where_the_file_has_a_backlash_is_refused_with_the_way_to_try_it() -> None:
    loose = GIVES_WAY.replace("joint_compliance", "backlash").replace("damping =", "gap = 1e-6\ncontact_damping =")
    model = Model.from_toml(NOMINAL + loose + rubs("motor", 50.0, 130.0) + rubs("link", 26.0, 70.0))
    records = (logged(model, *moved(seed)) for seed in (1, 2))
    why = vpm.diagnose(model, *records, effects=["joint_compliance"], check=False, workers=1)
    (refused,) = why.refused
    assert (refused.name, refused.site) == ("joint_compliance", "axis")
    assert "backlash at axis" in refused.reason
    assert "take that out of the model file" in refused.reason


def test_a_backlash_is_tried_in_series_with_a_spring_of_the_file() -> None:
    why = vpm.diagnose(
        SPLIT, logged(SPLIT, *moved(1)), logged(SPLIT, *moved(2)), effects=["backlash"], check=False, workers=1
    )
    (refused,) = why.refused
    assert (refused.name, refused.site) == ("backlash", "axis")
    assert "take that out" not in refused.reason
