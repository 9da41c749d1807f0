"""A quill that two nuts on a ball-screw spline lift and turn together; both efforts follow in closed form."""

from __future__ import annotations

import numpy as np
import pytest

import vpm
from vpm.experiment import Experiment
from vpm.model import Model

MASS, INERTIA, ROTOR, GRAVITY = 1.2, 4e-4, 1.6e-5, 9.81  # kg, kg m^2, kg m^2, m/s^2
SCREW, SPLINE = np.array([628.0, 2.0]), np.array([0.0, 3.0])  # turns of the shafts by stroke (rad/m) and turn
DRY, SMOOTH = 0.02, 2.0  # N m, and rad/s of a shaft below which its friction turns round
STEP, COUNT = 0.004, 2500

FILE = f"""
name = "quill"
gravity = [0.0, 0.0, -{GRAVITY}]
[bodies.nut]
mass = 0.05
[bodies.quill]
mass = {{ value = 1.35, uncertainty = 0.15 }}
inertia = [0.01, 0.01, {{ value = 3.5e-4, uncertainty = 1e-4 }}, 0.0, 0.0, 0.0]
[joints.turn]
type = "revolute"
parent = "world"
child = "nut"
axis = [0.0, 0.0, 1.0]
[joints.stroke]
type = "prismatic"
parent = "nut"
child = "quill"
axis = [0.0, 0.0, 1.0]
[transmissions.screw]
ratios = {{ stroke = {SCREW[0]}, turn = {SCREW[1]} }}
inertia = {ROTOR}
[transmissions.spline]
ratios = {{ turn = {SPLINE[1]} }}
inertia = {ROTOR}
[actuators.lift]
transmission = "screw"
gain = 1.0
command_unit = "N m"
[actuators.swivel]
transmission = "spline"
gain = 1.0
command_unit = "N m"
[[effects]]
type = "coulomb_friction"
at = "screw"
coulomb = {{ value = 0.016, uncertainty = 0.004 }}
[[effects]]
type = "coulomb_friction"
at = "spline"
coulomb = {{ value = 0.016, uncertainty = 0.004 }}
"""


def moved(seed: int, load: float = 0.0) -> Experiment:
    """Record of sums of sines; a command that is held for a sample is that in its middle."""
    rng = np.random.default_rng(seed)
    phases, tones = rng.uniform(0.0, 2.0 * np.pi, (2, 4)), 2.0 * np.pi * np.array([0.3, 0.8, 1.7, 3.1])
    sizes = np.array([[0.04, 0.015, 0.006, 0.002], [1.2, 0.5, 0.2, 0.08]])

    def motion(time: np.ndarray, order: int) -> np.ndarray:
        turned = tones[:, None] * time + phases[:, :, None] + 0.5 * np.pi * order
        return np.asarray(np.sum((sizes * tones**order)[:, :, None] * np.sin(turned), axis=1))

    time = STEP * np.arange(COUNT)
    (rate, spin), (lifting, turning) = (motion(time + 0.5 * STEP, order) for order in (1, 2))
    screw = (MASS + load) * (lifting + GRAVITY) / SCREW[0]
    spline = (INERTIA * turning - SCREW[1] * screw) / SPLINE[1]
    efforts = []
    for torque, (stroke, turn) in zip((screw, spline), (SCREW, SPLINE), strict=True):
        speed, acceleration = stroke * rate + turn * spin, stroke * lifting + turn * turning
        rubbing = DRY * np.tanh(speed / SMOOTH)
        efforts.append(torque + ROTOR * acceleration + rubbing + 1e-3 * rng.standard_normal(COUNT))
    noise = np.array([[1e-6], [2e-5]]) * rng.standard_normal((2, COUNT))
    place = motion(time, 0) + noise
    values = {"stroke.position": place[0], "turn.position": place[1]}
    values |= {"lift.command": efforts[0], "swivel.command": efforts[1]}
    return Experiment.from_arrays(time, values, model=Model.from_toml(FILE), name=f"quill {seed}")


def test_nothing_is_named_where_friction_of_shafts_turns_round_more_softly() -> None:
    """Nobody knows at which speed dry friction turns round: at a shaft of two joints as little as at a joint."""
    tried = ["coulomb_friction", "viscous_friction"]
    why = vpm.diagnose(Model.from_toml(FILE), moved(1), moved(2), effects=tried, check=False, workers=1)
    assert why.verdict == "parameters_only"
    assert not why.effects
    for shaft in ("screw", "spline"):
        assert why.model.parameters[f"{shaft}.friction.coulomb"].value == pytest.approx(DRY, rel=0.03)
        assert why.model.parameters[f"{shaft}.friction.transition_velocity"].value == pytest.approx(SMOOTH, rel=0.2)


def test_a_load_that_the_file_rules_out_is_said_with_the_verdict() -> None:
    """On a body of free mass a load is that mass, but none whose mass was weighed to 0.15 kg."""
    load, model, tried = 1.2, Model.from_toml(FILE), ["coulomb_friction"]
    why = vpm.diagnose(model, moved(1, load), moved(2, load), effects=tried, check=False, workers=1)
    away = (MASS + load - model.parameters["quill.mass"].value) / 0.15
    assert why.verdict == "parameters_only"
    assert f"quill.mass is {away:.1f} times its stated uncertainty away" in why.summary
