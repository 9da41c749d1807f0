"""A search that has less to explain than any law of a hidden motion is exact to."""

import math
from functools import cache

import numpy as np

import vpm
from vpm.experiment import Experiment

STEP, MASS, LENGTH, DRAG = 2e-3, 2.0, 0.5, 0.4
MODEL = vpm.Model.from_toml(f"""
    name = "pendulum"
    gravity = [0.0, 0.0, -9.81]
    bodies.bob = {{ mass = {{ value = {MASS}, uncertainty = 0.1 }}, center_of_mass = [0.0, 0.0, -{LENGTH}] }}
    joints.pivot = {{ type = "revolute", parent = "world", child = "bob", axis = [0.0, 1.0, 0.0] }}
    actuators.motor = {{ joint = "pivot", gain = 1.0, command_unit = "N m" }}
    [[effects]]
    type = "viscous_friction"
    at = "pivot"
    viscous = {{ value = {DRAG}, unit = "N m s/rad", uncertainty = 0.1 }}
""")


@cache
def swinging(seed: int, wave: float) -> Experiment:
    """A pendulum, written by Newton's law, with a torque of ``wave`` (N m) that repeats along its way."""
    drawn, parts, weight = np.random.default_rng(seed), 10, MASS * 9.81 * LENGTH
    time = STEP * np.arange(5000)
    rates, phases = 2.0 * np.pi * drawn.uniform(0.2, 1.5, 5), drawn.uniform(0.0, 6.0, 5)
    torque = 3.0 * np.sin(rates * time[:, None] + phases).sum(axis=1)
    angle, speed, rows, step = 0.0, 0.0, [], STEP / parts

    def acceleration(at: float, by: float, held: float) -> float:
        return (held - DRAG * by - weight * math.sin(at) - wave * math.sin(9.0 * at + 1.0)) / (MASS * LENGTH**2)

    for held in torque:
        rows.append(angle)
        for _ in range(parts):
            half = speed + step / 2.0 * acceleration(angle, speed, held)
            angle += step * half
            speed = half + step / 2.0 * acceleration(angle, half, held)
    columns = {"pivot.position": np.array(rows) + 1e-6 * drawn.standard_normal(len(time)), "motor.command": torque}
    return Experiment.from_arrays(time, columns, {}, name=f"swinging {seed}", model=MODEL)


def tried(wave: float) -> set[str]:
    """Effects that a search tries where such a torque is missing."""
    records = swinging(1, wave), swinging(2, wave)
    why = vpm.diagnose(MODEL, *records, names="search", effects=["joint_compliance", "coulomb_friction"], workers=1)
    assert not why.effects
    return {one.name for one in why.candidates}


def test_no_hidden_motion_is_simulated_for_less_than_laws_are_wrong_by() -> None:
    assert tried(0.016) == {"coulomb_friction"}
    assert tried(0.4) == {"coulomb_friction", "joint_compliance"}
