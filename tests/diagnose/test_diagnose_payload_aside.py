"""A payload beside the origin of a body of uncertain mass: where it is taken to be first, it is that mass."""

from __future__ import annotations

import numpy as np
import pytest

import vpm
from vpm.experiment import Experiment
from vpm.model import Model

LENGTH, ASIDE, LOAD, MASS = 0.35, 0.15, 0.6, 2.0  # m: first link, payload on the second; kg: payload, second link
INERTIA = (0.5, 0.12)  # kg m^2 about the centres of the links, which are their joints
STEP, COUNT = 0.005, 1600

FILE = f"""
name = "upright arm"
gravity = [0.0, 0.0, -9.81]
[bodies.upper]
mass = 4.0
inertia = [0.3, 0.3, {INERTIA[0]}, 0.0, 0.0, 0.0]
[bodies.fore]
mass = {{ value = {1.1 * MASS}, uncertainty = 0.3 }}
inertia = [0.1, 0.1, {{ value = {INERTIA[1]}, uncertainty = 0.02 }}, 0.0, 0.0, 0.0]
[joints.shoulder]
type = "revolute"
parent = "world"
child = "upper"
axis = [0.0, 0.0, 1.0]
[joints.elbow]
type = "revolute"
parent = "upper"
child = "fore"
translation = [{LENGTH}, 0.0, 0.0]
axis = [0.0, 0.0, 1.0]
[actuators.one]
joint = "shoulder"
gain = 1.0
command_unit = "N m"
[actuators.two]
joint = "elbow"
gain = 1.0
command_unit = "N m"
"""


def moved(seed: int) -> Experiment:
    """Record of sums of sines with efforts in closed form; a held command is that in the middle of its sample."""
    rng = np.random.default_rng(seed)
    phases, tones = rng.uniform(0.0, 2.0 * np.pi, (2, 3)), 2.0 * np.pi * np.array([0.3, 0.9, 1.7])
    sizes = np.array([[0.8, 0.3, 0.1], [1.0, 0.4, 0.15]])

    def motion(time: np.ndarray, order: int) -> np.ndarray:
        turned = tones[:, None] * time + phases[:, :, None] + 0.5 * np.pi * order
        return np.asarray(np.sum((sizes * tones**order)[:, :, None] * np.sin(turned), axis=1))

    time = STEP * np.arange(COUNT)
    (_, bend), (v, w), (a, b) = (motion(time + 0.5 * STEP, order) for order in range(3))
    across, turning = LOAD * LENGTH * ASIDE * np.cos(bend), LOAD * LENGTH * ASIDE * np.sin(bend)
    far = (INERTIA[1] + LOAD * ASIDE**2) * (a + b)
    two = far + across * a + turning * v**2
    near = (INERTIA[0] + (MASS + LOAD) * LENGTH**2) * a
    one = far + near + across * (2.0 * a + b) - turning * (2.0 * v + w) * w
    place = motion(time, 0) + 1e-5 * rng.standard_normal((2, COUNT))
    values = {"shoulder.position": place[0], "elbow.position": place[1], "one.command": one, "two.command": two}
    return Experiment.from_arrays(time, values, model=Model.from_toml(FILE), name=f"arm {seed}")


def test_a_payload_beside_the_origin_of_an_uncertain_body_is_named() -> None:
    tried = ["payload", "viscous_friction", "coulomb_friction"]
    why = vpm.diagnose(Model.from_toml(FILE), moved(1), moved(2), effects=tried, check=False, workers=1)
    assert why.verdict == "effect_found"
    assert [(one.name, one.site) for one in why.effects] == [("payload", "fore")]
    found = {name: parameter.value for name, parameter in why.model.parameters.items()}
    # Mass and place trade with the mass and inertia of the body; their product, the unbalance, does not.
    assert found["fore.payload.mass"] * found["fore.payload.x"] == pytest.approx(LOAD * ASIDE, rel=0.02)
    assert why.gap["elbow.effort"].after < 0.05 * why.gap["elbow.effort"].recalibrated
