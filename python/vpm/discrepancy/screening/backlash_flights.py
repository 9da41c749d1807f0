"""Backlash flights: a link crosses its backlash along the measured motion, between soft contacts.

Along a noisy motion within a band, single bounces between hard contacts are not predictable: each enlarges the error of
the one before. Soft, well damped contacts forget the flight before and pass on low frequencies as hard ones do. They
therefore show the width of the backlash, whatever the true stiffness of its contacts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vpm._core import soft_flights
from vpm.experiment import Motion
from vpm.identify import InverseDynamicsProblem
from vpm.model import Model
from vpm.model.splitting import name_behind
from vpm.numbers import Array


@dataclass(frozen=True)
class _Course:
    """Data along one record from which backlash flights are simulated."""

    pull: Array  #: Shape (N,); acceleration of the link against the motor while nothing holds it.
    column: Array  #: Shape (N, joints); effort at each measured joint per such acceleration.
    interval: float  #: s.


def flights(
    model: Model, site: str, data: InverseDynamicsProblem, gaps: Array, frequencies: Array, dampings: Array
) -> Array:
    """Change of the residual by backlash flights, shape (n, backlashes).

    Law: within the gap no effort is transmitted to the link. Beyond it a spring and a damper hold it, ``y'' = pull -
    w^2 (y -+ gap/2) - 2 z w y'``, with ``w = 2 pi frequency`` and the damping ratio z. Steps take the damping at the
    new velocity, which is stable up to ``w`` times the interval of 2. Source: dead-zone model of Nordin and Gutman,
    Automatica 38(10), 2002, section 2.

    Parameters
    ----------
    model : Model
        With the backlash, of any width.
    site : str
        Its joint.
    data : InverseDynamicsProblem
    gaps, frequencies, dampings : ndarray, shape (backlashes,)
        Widths, m or rad; Hz at which the link swings on a contact while the motor stands; damping ratios there.
    """
    added = []
    for m in data.motions:
        course = _course(model, site, m)
        swing = soft_flights(course.pull, gaps, 2.0 * np.pi * frequencies, dampings, course.interval)
        added.append(course.column[:, :, None] * swing[:, None, :])
    return data.added(added)


def _course(model: Model, site: str, m: Motion) -> _Course:
    """Measured motion for backlash flights: with the link at rest, and once more with a unit acceleration."""
    behind = model.joints.index(name_behind(site))
    before = [model.joints.index(joint) for joint in m.joints]
    motion = np.zeros((3, len(m.time), len(model.joints)))
    for order, values in enumerate((m.position, m.velocity, m.acceleration)):
        motion[order][:, before] = values
    held, _, _ = model.core.inverse_dynamics(model.theta, motion[0], motion[1], motion[2], m.inputs, m.dt)
    motion[2][:, behind] += 1.0
    moved, _, _ = model.core.inverse_dynamics(model.theta, motion[0], motion[1], motion[2], m.inputs, m.dt)
    column = moved - held
    return _Course(-held[:, behind] / column[:, behind], -column[:, before], m.dt)
