"""Flights of a link through a play along the measured motion, from contact to contact, each of which ends at rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vpm.experiment import Motion
from vpm.identify import InverseDynamicsProblem
from vpm.model import Model

Array = NDArray[np.float64]


@dataclass(frozen=True)
class _Course:
    """What lets a link fly along one record.

    Attributes
    ----------
    pull : ndarray, shape (N,)
        Acceleration of the link against the motor while nothing holds it.
    column : ndarray, shape (N, joints)
        Effort at each measured joint per such acceleration.
    interval : float
        s.
    """

    pull: Array
    column: Array
    interval: float


def flights(model: Model, site: str, data: InverseDynamicsProblem, gaps: Sequence[float]) -> Array:
    """What plays would add to the residual of the balance, shape (n, gaps).

    Law: within the gap the link feels none of the effort that the motion passes on; where it arrives it stays until
    that effort turns. A plastic impact (restitution 0) forgets the flight before it, so that errors do not add up.
    Source: the hard limit of the dead-zone model of Nordin and Gutman, Automatica 38(10), 2002, section 2.

    Parameters
    ----------
    model : Model
        With the play, of any width.
    site : str
        Its joint.
    data : InverseDynamicsProblem
    gaps : sequence of float
        Widths, m or rad.
    """
    import vpm._core as core

    fly = getattr(core, "plastic_flights", None) or (lambda p, g, i: _swing(p, np.asarray(g), i))
    added = []
    for m in data.motions:
        course = _course(model, site, m)
        swing = fly(course.pull, gaps, course.interval)
        added.append(course.column[:, :, None] * swing[:, None, :])
    return data.added(added)


def _course(model: Model, site: str, m: Motion) -> _Course:
    """The measured motion with the link at rest in the play, and once more with one unit of acceleration there."""
    behind = model.joints.index(f"{site}_deflection")
    before = [model.joints.index(joint) for joint in m.joints]
    motion = np.zeros((3, len(m.time), len(model.joints)))
    for order, values in enumerate((m.position, m.velocity, m.acceleration)):
        motion[order][:, before] = values
    held, _, _ = model.core.inverse_dynamics(model.theta, motion[0], motion[1], motion[2], m.inputs, m.dt)
    motion[2][:, behind] += 1.0
    moved, _, _ = model.core.inverse_dynamics(model.theta, motion[0], motion[1], motion[2], m.inputs, m.dt)
    column = moved - held
    return _Course(-held[:, behind] / column[:, behind], -column[:, before], m.dt)


def _swing(pull: Array, gaps: Array, interval: float) -> Array:
    """Acceleration of the link against the motor, impacts included, for each width, shape (N, gaps)."""
    half = 0.5 * gaps
    place, speed, side = np.zeros_like(half), np.zeros_like(half), np.zeros_like(half)
    way = np.zeros((pull.size, half.size))
    for k, acceleration in enumerate(pull.tolist()):
        way[k] = place
        held = side * acceleration > 0.0
        speed = np.where(held, 0.0, speed + interval * acceleration)
        reached = place + interval * speed
        place = np.minimum(np.maximum(reached, -half), half)
        side = np.where(held, side, np.where(reached == place, 0.0, np.sign(reached)))
        speed = np.where(side != 0.0, 0.0, speed)
    swing = np.zeros_like(way)
    swing[1:-1] = (way[2:] - 2.0 * way[1:-1] + way[:-2]) / interval**2
    return swing
