"""A turntable with dry friction that sticks, in a slow record and in one three thousand times as fast.

Beside that friction it may have cogging, as of a motor behind a worm, or stand upright with a weight aside of its axis.
"""

from __future__ import annotations

from functools import cache

import numpy as np

import vpm
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.ranking import Settings

INERTIA, DRY, OIL = 80.0, 14.0, 9.0  # kg m^2, N m, N m s/rad
NOISE = 2.5e-7  # rad
COGGING, PITCH = 2.5, 2.0 * np.pi / 720.0  # N m; rad: four times in a turn of a motor behind 180 : 1
WEIGHT, WHERE = 12.0, 0.4  # N m: of a mass aside of the axis; rad: where that is at zero
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
def turned(
    size: float,
    period: float,
    rate: int,
    seconds: float,
    *,
    cogging: float = 0.0,
    weight: float = 0.0,
    jogged: float = 0.0,
) -> Experiment:
    """Record under speed control: ``INERTIA v' = u - load - OIL v - DRY sign(v)``; it sticks at rest.

    The goal is a sine, and one 6.5 times as fast that is ``jogged`` by, rad.
    """
    random = np.random.default_rng(1)
    each, count = round(1.0 / (rate * FINE)), round(seconds * rate)
    place = speed = total = torque = 0.0
    read = np.empty((count, 2))
    for k in range(count * each):
        time = k * FINE
        turn = 2.0 * np.pi / period
        goal = size * np.sin(turn * time) + jogged * np.sin(6.5 * turn * time)
        rate_of_goal = turn * (size * np.cos(turn * time) + 6.5 * jogged * np.cos(6.5 * turn * time))
        error = rate_of_goal + 8.0 * (goal - place) - speed
        if k % each == 0:  # the log holds what the motor does until its next line
            total += error * each * FINE
            torque = 480.0 * error + 2400.0 * total
            read[k // each] = place, torque
        load = cogging * np.sin(2.0 * np.pi * place / PITCH) + weight * np.cos(place + WHERE)
        before, free = speed, speed + FINE * (torque - load - OIL * speed) / INERTIA
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


def test_derivatives_hold_where_friction_sticks() -> None:
    """Under a fast tracker approximate derivatives of this motion grow to 3e14 rad: half of the cogging was missed."""
    slow = turned(0.03, 80.0, 100, 80.0, cogging=COGGING, jogged=0.006)
    logs, tried = [slow, turned(0.6, 4.0, 500, 20.0, cogging=COGGING)], ["torque_ripple", "quadratic_drag"]
    fast = Settings(bands=(10.0,))
    ranking = vpm.rank(Model.from_toml(TURNTABLE), logs, logs[:1], effects=tried, settings=fast, workers=1)
    assert [one.effect for one in ranking.effects] == ["torque_ripple"]
    found = ranking.effects[0].values
    # Seven waves on the slow way tell the period to a quarter of a wave at least.
    assert abs(found["axis.ripple.period"] / PITCH - 1.0) < 0.25 / 7.0
    assert abs(np.hypot(found["axis.ripple.cosine"], found["axis.ripple.sine"]) / COGGING - 1.0) < 0.1


def test_a_weight_aside_of_the_axis_of_a_known_mass_is_a_payload() -> None:
    """At the axis a payload does nothing, and where the centre of mass is there, one has to begin aside of it."""
    logs = [turned(*motion, weight=WEIGHT) for motion in ((0.02, 80.0, 100, 80.0), (0.6, 4.0, 200, 20.0))]
    upright = Model.from_toml(TURNTABLE.replace("gravity = [0.0, 0.0, 0.0]", "gravity = [0.0, -9.81, 0.0]"))
    tried = ["payload", "bias_force", "spring", "cubic_spring"]
    ranking = vpm.rank(upright, logs, logs[1:], effects=tried, workers=1)
    assert [(one.effect, one.site) for one in ranking.effects] == [("payload", "table")]
    mass, x, y = (ranking.effects[0].values[f"table.payload.{name}"] for name in ("mass", "x", "y"))
    moment = 9.81 * mass * np.array([x, y])
    assert np.allclose(moment, WEIGHT * np.array([np.cos(WHERE), np.sin(WHERE)]), atol=0.05 * WEIGHT)
