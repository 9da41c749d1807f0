"""A turntable with dry friction that sticks, in a slow record and in one three thousand times as fast."""

from __future__ import annotations

from functools import cache

import numpy as np

import vpm
from vpm.experiment import Experiment
from vpm.model import Model

INERTIA, DRY, OIL = 80.0, 14.0, 9.0  # kg m^2, N m, N m s/rad
NOISE = 2.5e-7  # rad
FINE = 1e-3  # s: the controller's sample; torques are held for it

TURNTABLE = """
name = "turntable"
gravity = [0.0, 0.0, 0.0]
[bodies.table]
mass = 300.0
inertia = [70.0, 70.0, { value = 70.0, uncertainty = 10.0, min = 20.0 }, 0.0, 0.0, 0.0]
[joints.axis]
type = "revolute"
parent = "world"
child = "table"
axis = [0.0, 0.0, 1.0]
[actuators.motor]
joint = "axis"
gain = 1.0
command_unit = "N m"
[[effects]]
type = "viscous_friction"
at = "axis"
viscous = { value = 10.0, uncertainty = 4.0 }
[[effects]]
type = "coulomb_friction"
at = "axis"
coulomb = { value = 12.0, uncertainty = 4.0 }
"""


@cache
def turned(size: float, period: float, rate: int, seconds: float) -> Experiment:
    """Record under speed control: ``INERTIA v' = u - OIL v - DRY sign(v)``; it sticks at rest."""
    random = np.random.default_rng(1)
    each, count = round(1.0 / (rate * FINE)), round(seconds * rate)
    place = speed = total = torque = 0.0
    read = np.empty((count, 2))
    for k in range(count * each):
        time = k * FINE
        goal = size * np.sin(2.0 * np.pi * time / period)
        rate_of_goal = 2.0 * np.pi / period * size * np.cos(2.0 * np.pi * time / period)
        error = rate_of_goal + 8.0 * (goal - place) - speed
        if k % each == 0:  # the log holds what the motor does until its next line
            total += error * each * FINE
            torque = 480.0 * error + 2400.0 * total
            read[k // each] = place, torque
        before, free = speed, speed + FINE * (torque - OIL * speed) / INERTIA
        speed = np.sign(free) * max(abs(free) - FINE * DRY / INERTIA, 0.0)
        place += 0.5 * FINE * (before + speed)
    place_read = read[:, 0] + NOISE * random.standard_normal(count)
    channels = {"axis.position": place_read, "motor.command": read[:, 1]}
    return Experiment.from_arrays(np.arange(count) / rate, channels, {"axis.position": "rad", "motor.command": "N m"})


def test_a_slow_record_tells_where_dry_friction_turns_round_beside_a_fast_one() -> None:
    """Friction that sticks turns round at no speed: 1/5000 of the fast record's is all of the slow one's."""
    slow, fast = turned(1e-3, 20.0, 100, 80.0), turned(0.6, 4.0, 200, 20.0)
    ranking = vpm.rank(Model.from_toml(TURNTABLE), [slow, fast], [slow], workers=1)
    assert not ranking.effects
    assert abs(ranking.recalibrated.parameters["axis.friction.coulomb"].value / DRY - 1.0) < 0.005
    assert ranking.gaps["axis.position"].recalibrated < 0.01 * np.std(slow["axis.position"])
