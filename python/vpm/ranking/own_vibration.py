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
from vpm.numbers import Array
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
    Vibrations*, 2001, chapter 7), both from inverse dynamics at rest. Infinite where nothing vibrates even once in the
    longest record.
    """
    idle = [joint for joint in model.joints if joint not in {*model.driven_joints, *model.added_joints}]
    seen = [joint for joint in idle if all(f"{joint}.position" in record for record in records)]
    if not seen or model.loops or model.coordinates != model.joints:
        return np.inf
    places = [model.joints.index(joint) for joint in seen]
    count, steps = len(model.joints), MOVE * np.eye(len(model.joints))[places]
    still, pushed = np.zeros((2 * len(places), count)), np.vstack([steps, -steps])
    held = np.zeros((len(pushed), len(model.input_channels)))
    with contextlib.suppress(*ASTRAY):
        pose = np.tile(initial_state(model, records[0], model.theta)[:count], (len(pushed), 1))
        stiffness, mass = (
            _slopes(model.core.inverse_dynamics(model.theta, *motion, held, 1.0)[0][:, places] / MOVE)
            for motion in ((pose + pushed, still, still), (pose, still, pushed))
        )
        frequencies = np.sqrt(np.maximum(eigh(stiffness, mass, eigvals_only=True), 0.0)) / (2.0 * np.pi)
        longest = max(float(record.time[-1] - record.time[0]) for record in records)
        return float(min(frequencies[frequencies * longest > 1.0], default=np.inf))
    return np.inf


def _slopes(efforts: Array) -> Array:
    """Symmetric matrix of central differences of efforts, forward ones above backward ones."""
    ahead, behind = np.split(efforts, 2)
    slopes = 0.5 * (ahead - behind)
    return np.asarray(0.5 * (slopes + slopes.T))
