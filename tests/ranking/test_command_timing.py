"""Rankings of logs whose commands act at other times than they are stamped."""

import math

import numpy as np

import vpm
from vpm.experiment import Experiment

STEP, INERTIA, LEVER, DRAG = 4e-3, 0.02, 1.2, 0.05
FILE = f"""
    name = "pendulum"
    gravity = [0.0, 0.0, -9.81]
    bodies.bob = {{ mass = {LEVER / 9.81}, center_of_mass = [0.0, 0.0, -1.0] }}
    [joints.pivot]
    type = "revolute"
    parent = "world"
    child = "bob"
    axis = [0.0, 1.0, 0.0]
    rotor_inertia = {{ value = {INERTIA}, unit = "kg m^2", uncertainty = 0.004 }}
    [actuators.motor]
    joint = "pivot"
    gain = 1.0
    command_unit = "N m"
    [[effects]]
    type = "viscous_friction"
    at = "pivot"
    viscous = {{ value = {DRAG}, unit = "N m s/rad", uncertainty = 0.01 }}
"""
MODEL = vpm.Model.from_toml(FILE)


def swinging(seed: int, late: float) -> Experiment:
    """A pendulum under a torque that is held from ``late`` samples after its stamp on."""
    drawn, parts = np.random.default_rng(seed), 40
    time = STEP * np.arange(5000)
    rates, phases = 2.0 * np.pi * drawn.uniform(0.3, 3.0, 5), drawn.uniform(0.0, 6.0, 5)
    torque = 0.5 * np.sin(rates * time[:, None] + phases).sum(axis=1)
    inertia, angle, speed, angles = INERTIA + LEVER / 9.81, 0.0, 0.0, []
    for sample in range(len(time)):
        angles.append(angle)
        for part in range(parts):
            held = torque[min(max(math.floor(sample + (part + 0.5) / parts - late), 0), len(time) - 1)]
            speed += 0.5 * STEP / parts * (held - DRAG * speed - LEVER * math.sin(angle)) / inertia
            angle += STEP / parts * speed
            speed += 0.5 * STEP / parts * (held - DRAG * speed - LEVER * math.sin(angle)) / inertia
    columns = {"pivot.position": np.array(angles) + 1e-6 * drawn.standard_normal(len(time)), "motor.command": torque}
    return Experiment.from_arrays(time, columns, {}, name=f"swinging {seed}", model=MODEL)


def named(late: float) -> list[tuple[str, str]]:
    found = vpm.rank(MODEL, [swinging(1, late), swinging(2, late)], workers=1)
    return [(one.effect, one.site) for one in found.effects]


def test_commands_that_act_a_quarter_of_a_sample_early_are_no_spring_in_a_joint() -> None:
    assert named(-0.25) == []


def test_commands_that_act_four_samples_late_are_a_delay() -> None:
    assert named(4.0) == [("input_delay", "motor")]
