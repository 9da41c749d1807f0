"""A trolley whose drive holds its speed: dashpot, dry friction and noise of its laser."""

from __future__ import annotations

import numpy as np

import vpm
from vpm.experiment import Experiment
from vpm.model import Model

MASS, DROOP = 450.0, 6000.0  # kg, N s/m: the speed follows its command within 75 ms
DRY = 120.0  # N
STEP, NOISE = 0.02, 3e-4  # s, m
PARTS = 40  #: Steps between two samples of a record.

TROLLEY = """
name = "trolley"
gravity = [0.0, 0.0, 0.0]
[bodies.trolley]
mass = { value = 400.0, uncertainty = 60.0, min = 100.0 }
[joints.travel]
type = "prismatic"
parent = "world"
child = "trolley"
axis = [1.0, 0.0, 0.0]
[actuators.inverter]
joint = "travel"
gain = { value = 5500.0, unit = "N s/m", uncertainty = 800.0 }
command_unit = "m/s"
[[effects]]
type = "viscous_friction"
at = "travel"
viscous = { value = 5500.0, uncertainty = 800.0 }
"""


def driven(seed: int, dry: float = 0.0) -> Experiment:
    """Record of 40 s: ``MASS v' = DROOP (u - v) - dry sign(v)`` under a held command that ramps from speed to speed."""
    random = np.random.default_rng(seed)
    time = STEP * np.arange(2000)
    command = np.interp(time, np.linspace(0.0, 40.0, 25), random.uniform(-0.8, 0.8, 25))
    part = STEP / PARTS
    kept = np.exp(-part * DROOP / MASS)
    speed, place = 0.0, np.zeros(2000)
    for k, goal in enumerate(command[:-1]):
        place[k + 1] = place[k]
        for _ in range(PARTS):
            side = np.sign(speed) or np.sign(goal)
            steady = goal - side * dry / DROOP  # towards which the speed goes on this side of rest
            after = max(0.0, side * (steady + kept * (speed - steady))) * side
            place[k + 1] += 0.5 * part * (speed + after)
            speed = after
    read = {"travel.position": place + NOISE * random.standard_normal(2000), "inverter.command": command}
    return Experiment.from_arrays(time, read, {"travel.position": "m", "inverter.command": "m/s"})


def test_noise_of_a_sensor_is_no_lag_of_a_drive() -> None:
    """What a fast tracker moves the trolley by noise, a lighter one behind a lag forgets sooner: it is not missing."""
    ranking = vpm.rank(Model.from_toml(TROLLEY), [driven(1), driven(2)], workers=1)
    assert not ranking.effects
    fitted = ranking.recalibrated.parameters
    ratio = fitted["travel.friction.viscous"].value / fitted["trolley.mass"].value
    assert abs(ratio / (DROOP / MASS) - 1.0) < 0.02


def test_dry_friction_is_named_beside_a_dashpot_of_twenty_times_its_force() -> None:
    """A dead zone of the command takes away as much force, but not while the trolley brakes or turns round."""
    ranking = vpm.rank(Model.from_toml(TROLLEY), [driven(1, DRY), driven(2, DRY)], workers=1)
    assert [(one.effect, one.site) for one in ranking.effects] == [("coulomb_friction", "travel")]
    fitted = ranking.model.parameters
    share = fitted["travel.friction.coulomb"].value / fitted["travel.friction.viscous"].value
    assert abs(share / (DRY / DROOP) - 1.0) < 0.03
