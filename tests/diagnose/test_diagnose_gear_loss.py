"""Gears that lose a share of what they carry, behind two motors that turn two joints together."""

from __future__ import annotations

import numpy as np
import pytest

import vpm
from vpm.experiment import Experiment
from wrist import LINE, RATIOS, SHAFTS, STEP, TORQUE, Wrist, model, times

COULOMB, LOSS, TURN = np.array([4e-3, 6e-3]), 0.12, 0.5  # N m; share of the torque; rad/s


def record() -> Experiment:
    """Motor angles and currents along a motion, by the equations of the wrist: what it needs, and what is lost."""
    random, wrist, time = np.random.default_rng(0), Wrist(), times(3000, STEP)
    sizes, turns = np.array([0.6, 0.3, 0.08]), np.array([2.3, 5.9, 11.0])
    angles = turns[:, None] * time + random.uniform(0.0, 2.0 * np.pi, (2, 3))[:, :, None]
    position = np.einsum("k,jkn->nj", sizes, np.sin(angles))
    velocity = np.einsum("k,jkn->nj", sizes * turns, np.cos(angles))
    acceleration = -np.einsum("k,jkn->nj", sizes * turns**2, np.sin(angles))
    currents = np.empty((len(time), 2))
    for k, (q, v, a) in enumerate(zip(position, velocity, acceleration, strict=True)):
        ways = np.tanh(RATIOS @ v / TURN)
        joints = wrist.mass_matrix(q) @ a + wrist.bias(q, v)
        needed = np.linalg.solve(RATIOS.T, joints) + np.array(wrist.viscous) * (RATIOS @ v) + COULOMB * ways
        currents[k] = needed / (1.0 - LOSS * np.sign(needed) * ways) / TORQUE
    turned = position @ RATIOS.T
    read = LINE * np.round(turned / LINE + random.uniform(-0.5, 0.5, turned.shape))
    channels = [f"{name}.position" for name in SHAFTS] + [f"{name}_motor.command" for name in SHAFTS]
    return Experiment("wrist", time, np.column_stack([read, currents]), tuple(channels), ("rad", "rad", "A", "A"))


def test_a_loss_of_gears_beside_dry_friction_is_no_hysteresis() -> None:
    effects = ["drive_friction", "coulomb_friction", "hysteresis"]
    why = vpm.diagnose(model(), record(), effects=effects, check=False, workers=1)
    named = {(effect.name, effect.site) for effect in why.effects}
    assert named == {
        *(("coulomb_friction", shaft) for shaft in SHAFTS),
        *(("drive_friction", f"{shaft}_motor") for shaft in SHAFTS),
    }
    values = {name: parameter.value for name, parameter in why.model.parameters.items()}
    for shaft, dry in zip(SHAFTS, COULOMB, strict=True):
        assert values[f"{shaft}.friction.coulomb"] == pytest.approx(dry, rel=0.05)
        assert values[f"{shaft}_motor.friction.driving"] == pytest.approx(LOSS, rel=0.1)
        assert values[f"{shaft}_motor.friction.driven"] == pytest.approx(LOSS, rel=0.15)
