"""A trolley with a swinging load of which nothing is missing: short records, and an angle that is read slowly."""

from __future__ import annotations

from functools import cache

import numpy as np

import vpm
from runge_kutta import ahead
from vpm.experiment import Experiment

STEP, SLOW, COUNT = 0.01, 5, 2997  # s; samples between two readings of the angle; samples
TROLLEY, LOAD, ROPE, INERTIA, GRAVITY = 180.0, 60.0, 2.5, 3.0, 9.81
NOISE = 5e-4  # rad
SEEDS = 8

CRANE = """
name = "crane"
gravity = [0.0, 0.0, -9.81]
bodies.trolley = { mass = { value = 200.0, uncertainty = 20.0 } }
bodies.load = { mass = 60.0, center_of_mass = [0.0, 0.0, -2.5], inertia = [3.0, 3.0, 3.0, 0.0, 0.0, 0.0] }
joints.travel = { type = "prismatic", parent = "world", child = "trolley", axis = [1.0, 0.0, 0.0] }
joints.swing = { type = "revolute", parent = "trolley", child = "load", axis = [0.0, -1.0, 0.0] }
actuators.drive = { joint = "travel", gain = 1.0, command_unit = "N" }
"""


def rates(state: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Trolley and pendulum by Lagrange, angle from the downward vertical towards the travel (m, rad, and per s)."""
    _, angle, speed, turn = state
    cosine, sine = np.cos(angle), np.sin(angle)
    coupling, about = LOAD * ROPE * cosine, LOAD * ROPE**2 + INERTIA
    pushed, swung = force + LOAD * ROPE * sine * turn**2, -LOAD * GRAVITY * ROPE * sine
    determinant = (TROLLEY + LOAD) * about - coupling**2
    return np.array(
        [
            speed,
            turn,
            (about * pushed - coupling * swung) / determinant,
            ((TROLLEY + LOAD) * swung - coupling * pushed) / determinant,
        ]
    )


@cache
def driven() -> tuple[Experiment, ...]:
    """Moves of the crane between random places with pauses, one for each seed, by Runge and Kutta at every sample."""
    random, time = np.random.default_rng(1), STEP * np.arange(COUNT)
    wanted = np.zeros((COUNT, SEEDS))
    for column in range(SEEDS):
        start = 1.0
        while start < time[-1] - 8.0:
            way, length = random.uniform(-4.0, 4.0), random.uniform(4.0, 7.0)
            part = np.clip((time - start) / length, 0.0, 1.0)
            wanted[:, column] += way * (10.0 * part**3 - 15.0 * part**4 + 6.0 * part**5)
            start += length + random.uniform(0.3, 1.5)
    speeds = np.gradient(wanted, STEP, axis=0)
    state, states, forces = np.zeros((4, SEEDS)), np.zeros((COUNT, 4, SEEDS)), np.zeros((COUNT, SEEDS))
    for k in range(COUNT):
        force = 900.0 * (speeds[k] - state[2]) + 900.0 * (wanted[k] - state[0])
        states[k], forces[k] = state, force
        state = ahead(rates, state, STEP, force)
    records = []
    for column in range(SEEDS):
        read = states[:, 1, column] + NOISE * random.standard_normal(COUNT)
        values = {
            "travel.position": np.round(states[:, 0, column], 4),
            "swing.position": read[np.arange(COUNT) // SLOW * SLOW],
            "drive.command": forces[:, column],
        }
        units = {"travel.position": "m", "swing.position": "rad", "drive.command": "N"}
        records.append(Experiment.from_arrays(time, values, units, irregular="interpolate", name=f"run {column}"))
    return tuple(records)


def test_of_a_short_record_of_a_slow_sensor_nothing_is_missing() -> None:
    model = vpm.Model.from_toml(CRANE)
    verdicts = [
        vpm.diagnose(model, record, effects=["viscous_friction"], check=False, workers=1).verdict for record in driven()
    ]
    assert set(verdicts) <= {"parameters_only", "no_disagreement"}
