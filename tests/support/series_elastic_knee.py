"""A series-elastic knee whose motor and link both stick, by its own equations."""

from __future__ import annotations

import numpy as np

import vpm

#: Behind 50 : 1 at the knee: torque per current, N m/A; inertia of the motor, kg m^2; its dry and viscous friction.
GAIN, ROTOR, DRY, OIL = 4.5, 0.1375, 3.5, 0.9
#: Spring, N m/rad and N m s/rad; shank, kg, m and kg m^2; dry and viscous friction of its bearing.
SPRING, LOSS, MASS, CENTRE, TURN, RUB, DRAG = 300.0, 0.25, 3.2, 0.21, 0.06, 0.8, 0.15
STEP, RATE, SECONDS = 1e-4, 1000, 10
COUNTS, READ = 2.0 * np.pi / (4096 * 50), 1.9e-4  # rad: step of the motor's encoder, noise of the link's

KNEE = f"""
name = "series-elastic knee"
gravity = [0.0, 0.0, -9.81]
[bodies.shank]
mass = {{ value = 2.9, uncertainty = 0.3, min = 0.5 }}
center_of_mass = [0.0, 0.0, {{ value = -0.23, uncertainty = 0.02 }}]
inertia = [0.05, {{ value = 0.05, uncertainty = 0.015, min = 0.005 }}, 0.01, 0.0, 0.0, 0.0]
[joints.knee]
type = "revolute"
parent = "world"
child = "shank"
axis = [0.0, 1.0, 0.0]
[actuators.motor]
joint = "knee"
gain = {GAIN}
command_unit = "A"
[[effects]]
type = "joint_compliance"
at = "knee"
stiffness = {{ value = 330.0, uncertainty = 40.0 }}
damping = {{ value = 0.3, uncertainty = 0.15, min = 0.0 }}
inertia = {{ value = 0.15, uncertainty = 0.02, min = 0.01 }}
[[effects]]
type = "viscous_friction"
at = "knee"
viscous = {{ value = 1.0, uncertainty = 0.3 }}
[[effects]]
type = "coulomb_friction"
at = "knee"
coulomb = {{ value = 3.0, uncertainty = 1.0 }}
[[effects]]
type = "coulomb_friction"
at = "knee"
side = "link"
coulomb = {{ value = 0.6, uncertainty = 0.3 }}
[[effects]]
type = "viscous_friction"
at = "knee"
side = "link"
viscous = {{ value = 0.12, uncertainty = 0.06 }}
"""


def stuck(speed: float, most: float) -> float:
    """Speed after an impulse of dry friction, which stops what it does not leave moving (J. Moreau 1988)."""
    return float(np.sign(speed)) * max(abs(speed) - most, 0.0)


def swung(seed: int, late: int = 0) -> vpm.Experiment:
    """Record of two inertias with a spring between, by small steps: Newton's equations, and dry friction on both.

    ``late``: samples by which the link's encoder is late.
    """
    random = np.random.default_rng(seed)
    sizes, rates, phases = np.array([0.4, 0.15]), 2.0 * np.pi * np.array([0.45, 1.5]), random.uniform(0.0, 6.0, 2)
    heavy, inertia = 9.81 * MASS * CENTRE, TURN + MASS * CENTRE**2
    angle = place = float(sizes @ np.sin(phases))
    speed = rate = current = 0.0
    rows = np.empty((RATE * SECONDS, 3))
    every = round(1.0 / (RATE * STEP))
    for k in range(len(rows) * every):
        if k % every == 0:
            turn = rates * k * STEP + phases
            goal, fast = float(sizes @ np.sin(turn)), float(sizes * rates @ np.cos(turn))
            current = 25.0 * (goal - angle) + 1.2 * (fast - speed) + heavy * float(np.sin(place)) / GAIN
            rows[k // every] = angle, place, current
        pull = SPRING * (angle - place) + LOSS * (speed - rate)
        speed = stuck(speed + STEP * (GAIN * current - pull - OIL * speed) / ROTOR, STEP * DRY / ROTOR)
        load = heavy * np.sin(place) + DRAG * rate
        rate = stuck(rate + STEP * (pull - load) / inertia, STEP * RUB / inertia)
        angle, place = angle + STEP * speed, place + STEP * rate
    motor = np.round(rows[:, 0] / COUNTS) * COUNTS
    link = rows[np.maximum(np.arange(len(rows)) - late, 0), 1]
    columns = {
        "knee.position": motor,
        "knee_deflection.position": link + READ * random.standard_normal(len(rows)) - motor,
        "motor.command": rows[:, 2] + 0.015 * random.standard_normal(len(rows)),
    }
    return vpm.Experiment.from_arrays(np.arange(len(rows)) / RATE, columns, model=vpm.Model.from_toml(KNEE))
