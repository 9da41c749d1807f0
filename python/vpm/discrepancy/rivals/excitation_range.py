"""Excitation range of records: how far they moved a joint, which limits the next experiment."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vpm.identify import InverseDynamicsProblem


@dataclass(frozen=True)
class ExcitationRange:
    """Excitation range of one joint: way, speed and acceleration; other joints stay at ``hold``."""

    joint: str
    unit: str  #: rad or m.
    low: float
    high: float
    #: 99.9 % quantiles of the absolute values.
    speed: float
    acceleration: float
    time_step: float  #: s.
    hold: dict[str, float]  #: Mean position of every joint.
    command: float  #: Largest command of any actuator.
    effort: float  #: What the weighted residual has to be multiplied by to be an effort of this joint.


def excitation_range(data: InverseDynamicsProblem, joint: str) -> ExcitationRange:
    """Excitation range of ``joint`` in the records."""
    motions = data.motions
    column = motions[0].joints.index(joint)
    position, velocity, acceleration = (
        np.concatenate([getattr(m, quantity)[m.kept][:, column] for m in motions])
        for quantity in ("position", "velocity", "acceleration")
    )
    commands = [float(np.abs(m.inputs).max()) for m in motions if m.inputs.size]
    block = data.efforts(0)[data.joints.index(joint)]
    return ExcitationRange(
        joint,
        "m" if block.unit == "N" else "rad",
        float(position.min()),
        float(position.max()),
        max(float(np.quantile(np.abs(velocity), 0.999)), 1e-12),
        max(float(np.quantile(np.abs(acceleration), 0.999)), 1e-12),
        max(m.dt for m in motions),
        {name: float(np.mean(motions[0].position[:, k])) for k, name in enumerate(motions[0].joints)},
        max([*commands, 1e-12]),
        1.0 / block.weight,
    )
