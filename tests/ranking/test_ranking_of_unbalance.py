"""Ranking of a wheel with a mass on its rim: its weight and what it takes to turn it, and hardly the mass alone."""

import numpy as np
import pytest

import vpm
from model_texts import effect_text
from vpm.experiment import Experiment
from vpm.model import Model

#: A wheel on a level axle as its file describes it: in equilibrium, and a little easier to turn than it is.
WHEEL = (
    """
name = "wheel"
gravity = [0.0, 0.0, -9.81]
[bodies.disc]
mass = { value = 12.0, uncertainty = 0.6 }
inertia = [0.08, { value = 0.15, uncertainty = 0.01 }, 0.08, 0.0, 0.0, 0.0]
[joints.axle]
type = "revolute"
parent = "world"
child = "disc"
axis = [0.0, 1.0, 0.0]
[actuators.motor]
joint = "axle"
gain = { value = 1.0, unit = "N m/A" }
command_unit = "A"
"""
    + effect_text("viscous_friction", "axle", viscous="{ value = 0.05, uncertainty = 0.02 }")
    + effect_text("coulomb_friction", "axle", coulomb="{ value = 0.2, uncertainty = 0.05 }")
)
INERTIA, OIL, DRY, WEIGHT, STEP, FINE = 0.157, 0.06, 0.17, 9.81, 2e-3, 10


def turned(mass: float, x: float, z: float, seed: int) -> Experiment:
    """The wheel by small explicit steps; dry friction at most stops it. Positive angles turn z towards x."""
    random, h = np.random.default_rng(seed), STEP / FINE
    time = STEP * np.arange(6000)
    waves = zip([0.9, 0.5, 0.3], random.uniform([1, 4, 9], [3, 8, 20]), random.uniform(0.0, 6.0, 3), strict=True)
    current = np.sum([size * np.sin(rate * time + phase) for size, rate, phase in waves], axis=0)
    inertia, angle, speed = INERTIA + mass * (x**2 + z**2), 0.0, 0.0
    angles = np.empty_like(time)
    for row, torque in enumerate(current):
        angles[row] = angle
        for _ in range(FINE):
            lever = x * np.cos(angle) + z * np.sin(angle)
            speed += h * (torque - OIL * speed + mass * WEIGHT * lever) / inertia
            speed -= np.sign(speed) * min(abs(speed), h * DRY / inertia)
            angle += h * speed
    angles += random.normal(0.0, 2e-4, len(time))
    return Experiment.from_arrays(time, {"motor.command": current, "axle.position": angles}, name=f"log {seed}")


@pytest.mark.parametrize(("mass", "x", "z", "seed"), [(0.46, -0.011, 0.083, 24), (0.31, -0.041, -0.121, 36)])
def test_an_unbalance_is_named_by_its_first_moment(mass: float, x: float, z: float, seed: int) -> None:
    """Fits crept along mass and place, and a ripple with a rotor was named in the place of the unbalance."""
    logs = [turned(mass, x, z, one) for one in (seed, seed + 1)]
    (found,) = vpm.rank(Model.from_toml(WHEEL), logs, workers=1).effects
    assert (found.effect, found.site) == ("payload", "disc")
    named, *place = (found.values[f"disc.payload.{one}"] for one in ("mass", "x", "z"))
    assert named * np.array(place) == pytest.approx(mass * np.array([x, z]), abs=0.01 * mass * float(np.hypot(x, z)))
