"""How fast a machine falls over in the poses of its records: a tracker that is slower does not keep it on them."""

from __future__ import annotations

import math

import numpy as np

from vpm.experiment import Experiment
from vpm.identify.response_along_motion import bends
from vpm.model import Model
from vpm.numbers import Array
from vpm.ranking.substitute_records import why_unbalanced

#: Poses of a record at which it is worked out.
POSES = 40
#: Change of a coordinate for the slope of efforts, rad or m: at it they are straight, and far from rounding.
MOVE = 1e-5


def fall_rate(model: Model, record: Experiment) -> float:
    """Fastest rate at which a machine at rest leaves a pose of a record, Hz; 0 where it returns, or nobody knows.

    With the stiffness K of its weights and springs and the masses M, a disturbance grows as exp(t sqrt(-k)), k the
    least eigenvalue of K x = k M x (L. Meirovitch, *Fundamentals of Vibrations*, 2001, section 7.5).
    """
    places = [f"{name}.position" for name in model.coordinates]
    if bends(model) or not all(name in record for name in places) or why_unbalanced(model, [record]):
        return 0.0
    poses = np.column_stack([record[name] for name in places])
    chosen = poses[np.linspace(0, len(poses) - 1, min(POSES, len(poses))).astype(int)]
    return math.sqrt(max(0.0, *(_growth(model, pose) for pose in chosen))) / (2.0 * math.pi)


def _growth(model: Model, pose: Array) -> float:
    """Square of the rate, 1/s^2, at which a machine falls from a pose; negative where it swings about that."""
    from scipy.linalg import eigh  # slow to import, and seldom needed

    rest, each = np.zeros_like(pose), np.eye(len(pose))

    def held(at: Array, acceleration: Array) -> Array:
        return np.asarray(model.inverse_dynamics(at, rest, acceleration))

    masses = np.array([held(pose, one) - held(pose, rest) for one in each])
    pairs = [(held(pose + MOVE * one, rest), held(pose - MOVE * one, rest)) for one in each]
    stiffness = np.array([(after - before) / (2.0 * MOVE) for after, before in pairs])
    return -float(eigh((stiffness + stiffness.T) / 2.0, (masses + masses.T) / 2.0, eigvals_only=True)[0])
