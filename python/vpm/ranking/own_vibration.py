"""Own vibration of joints without a drive, which a tracker must be too slow to hold."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import eigh

from vpm.experiment import Experiment
from vpm.initial import initial_state
from vpm.model import Model
from vpm.ranking.fit import ASTRAY
from vpm.ranking.settings import MOVE, OCTAVE, Settings


def below_own_vibration(settings: Settings, model: Model, records: Sequence[Experiment]) -> Settings:
    """Settings whose slowest tracker is an octave below the own vibration of joints without a drive.

    A tracker draws a joint to its readings as by a spring with a damper. A pendulum that swings more slowly than that
    is held in step, and how its swing dies away does not show. What the tracker makes of the first state takes as many
    of its periods to die away.
    """
    slow, *others = settings.bands
    band = min(slow, _slowest(model, records) / OCTAVE)
    return replace(settings, bands=(band, *others), settling=settings.settling * slow / band)


def _slowest(model: Model, records: Sequence[Experiment]) -> float:
    """Lowest frequency of own vibrations of joints that are measured and not driven, Hz, while all others rest.

    Law: the generalised eigenvalues of stiffness and mass about the first pose (L. Meirovitch, *Fundamentals of
    Vibrations*, 2001, chapter 7), from efforts at rest and the mass matrix. Infinite where nothing vibrates even once
    in the longest record.
    """
    idle = [joint for joint in model.joints if joint not in {*model.driven_joints, *model.added_joints}]
    seen = [joint for joint in idle if all(f"{joint}.position" in record for record in records)]
    if not seen or model.loops or model.coordinates != model.joints:
        return np.inf
    places, count = [model.joints.index(joint) for joint in seen], len(model.joints)
    ahead = MOVE * np.eye(count)[places]
    still, held = np.zeros_like(ahead), np.zeros((len(places), len(model.input_channels)))
    with contextlib.suppress(*ASTRAY):
        pose = initial_state(model, records[0], model.theta)[:count]
        before, after = (
            model.core.inverse_dynamics(model.theta, pose + way, still, still, held, 1.0)[0][:, places]
            for way in (-ahead, ahead)
        )
        stiffness = 0.5 * (after - before) / MOVE
        mass = model.mass_matrix(pose)[np.ix_(places, places)]
        frequencies = np.sqrt(np.maximum(eigh(0.5 * (stiffness + stiffness.T), mass, eigvals_only=True), 0.0)) / (
            2.0 * np.pi
        )
        longest = max(float(record.time[-1] - record.time[0]) for record in records)
        return float(min(frequencies[frequencies * longest > 1.0], default=np.inf))
    return np.inf
