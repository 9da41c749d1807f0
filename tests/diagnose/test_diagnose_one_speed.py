"""Dry friction where validation records know one speed: they take it for viscous, and training records tell."""

from __future__ import annotations

import numpy as np
import pytest

import vpm
from vpm.experiment import Experiment

MASS, FRICTION, TURN, STEP = 20.0, 12.0, 0.005, 0.01  # kg, N, m/s, s

SLEDGE = """
    name = "sledge"
    gravity = [0.0, 0.0, -9.81]
    bodies.sledge = { mass = { value = 20.0, uncertainty = 1.0 } }
    joints.way = { type = "prismatic", parent = "world", child = "sledge", axis = [1.0, 0.0, 0.0] }
    actuators.drive = { joint = "way", gain = 1.0, command_unit = "N" }
"""


def record(velocity: np.ndarray, seed: int, noise: float) -> Experiment:
    """Position and force of the sledge at these speeds, by Newton's law."""
    random = np.random.default_rng(seed)
    position = np.cumsum(velocity) * STEP
    force = MASS * np.gradient(velocity, STEP) + FRICTION * np.tanh(velocity / TURN)
    force += random.normal(scale=noise, size=force.size)
    values = {"way.position": position + random.normal(scale=2e-6, size=force.size), "drive.command": force}
    return Experiment.from_arrays(STEP * np.arange(force.size), values, {"way.position": "m", "drive.command": "N"})


def test_dry_friction_is_named_where_one_speed_alone_is_validated() -> None:
    time = STEP * np.arange(3000)
    many = 0.25 * np.sin(0.9 * time) + 0.15 * np.sin(2.3 * time + 1.0) + 0.05 * np.sin(5.0 * time)
    one = 0.3 * np.tanh(6.0 * np.sin(1.5 * time[:1200]))
    model = vpm.Model.from_toml(SLEDGE)
    effects = ["viscous_friction", "coulomb_friction"]
    why = vpm.diagnose(model, record(many, 1, 3.0), record(one, 2, 20.0), effects=effects, check=False, workers=1)
    assert [effect.name for effect in why.effects] == ["coulomb_friction"]
    assert why.model.parameters["way.friction.coulomb"].value == pytest.approx(FRICTION, rel=0.05)
