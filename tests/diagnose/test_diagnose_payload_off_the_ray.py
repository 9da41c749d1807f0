"""A payload on a link of unknown mass: it shows where it stands off the ray through the link's centre of mass."""

from __future__ import annotations

import numpy as np
import pytest

import vpm
from vpm.experiment import Experiment

MASS, CENTRE, INERTIA, GRAVITY = 4.0, 0.5, 0.3, 9.81  # kg, m, kg m^2 about the centre, m/s^2
PAYLOAD, ALONG, ASIDE = 1.2, 0.8, -0.35  # kg, and its place in the link's x and z, m
FRICTION, TURN = 1.5, 0.01  # N m, rad/s

ARM = """
    name = "arm"
    gravity = [0.0, 0.0, -9.81]
    [bodies.link]
    mass = { value = 4.3, unit = "kg", uncertainty = 0.4 }
    center_of_mass = [0.5, 0.0, 0.02]
    inertia = [0.01, 0.3, 0.3, 0.0, 0.0, 0.0]
    [joints.axis]
    type = "revolute"
    parent = "world"
    child = "link"
    axis = [0.0, -1.0, 0.0]
    [actuators.drive]
    joint = "axis"
    gain = 1.0
    command_unit = "N m"
"""


def record() -> Experiment:
    """Motion of the link with payload and dry friction, and the torque that it takes, by the closed form."""
    random, time = np.random.default_rng(3), 0.01 * np.arange(4000)
    sizes, turns = np.array([0.5, 0.25, 0.1]), np.array([0.6, 1.3, 2.9])
    phases = random.uniform(0.0, 2.0 * np.pi, 3)
    angles = turns * time[:, None] + phases
    q, w, a = (
        (sizes * np.sin(angles)).sum(1),
        (sizes * turns * np.cos(angles)).sum(1),
        -(sizes * turns**2 * np.sin(angles)).sum(1),
    )
    moment_x, moment_z = MASS * CENTRE + PAYLOAD * ALONG, MASS * 0.02 + PAYLOAD * ASIDE
    about = INERTIA + MASS * (CENTRE**2 + 0.02**2) + PAYLOAD * (ALONG**2 + ASIDE**2)
    torque = about * a + GRAVITY * (moment_x * np.cos(q) - moment_z * np.sin(q)) + FRICTION * np.tanh(w / TURN)
    torque += random.normal(scale=0.1, size=time.size)
    values = {"axis.position": q + random.normal(scale=5e-5, size=time.size), "drive.command": torque}
    return Experiment.from_arrays(time, values, {"axis.position": "rad", "drive.command": "N m"})


def test_a_payload_and_friction_are_named_beside_an_unknown_mass() -> None:
    effects = ["payload", "coulomb_friction", "viscous_friction", "bias_force", "spring", "gravity_tilt"]
    why = vpm.diagnose(vpm.Model.from_toml(ARM), record(), effects=effects, check=False, workers=1)
    assert why.verdict == "effect_found"
    assert sorted(effect.name for effect in why.effects) == ["coulomb_friction", "payload"]
    values = {name: parameter.value for name, parameter in why.model.parameters.items()}
    assert values["axis.friction.coulomb"] == pytest.approx(FRICTION, rel=0.05)
    # Mass and distance along the ray are known only together; what the payload weighs off the ray is known.
    assert values["link.payload.mass"] * values["link.payload.z"] == pytest.approx(PAYLOAD * ASIDE, rel=0.15)
