"""What products of rates are worth along a motion: whether a model may do without them.

Shares of the dynamics after D'Imperio (2016), section 2.4.2 and eq 2.109, with the sum of norms as denominator; see
`vpm.linkages.drop_limit` for the same question over a whole workspace.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vpm.errors import SimulationError
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.simplify.reductions import without_velocity_terms
from vpm.simulate import Setup, simulate_arrays

Array = NDArray[np.float64]

#: Samples of each record at which the shares are worked out.
SAMPLES = 200


def velocity_share(model: Model, records: Sequence[Experiment], mode: str, setup: Setup) -> float:
    """Share of the efforts at the joints that goes to products of rates along simulated motions, the largest of all.

    ``V / (I + V + R)`` with root mean squares along the motion of the Euclidean norms over the joints: V the velocity
    terms, I inertia times acceleration, R weight, effects and what elastic links take. Along a motion the share of
    single states says little: it is all wherever accelerations change sign.

    Parameters
    ----------
    model : Model
    records : sequence of Experiment
        Their commands or references drive the model.
    mode : {"free_run", "closed_loop"}
    setup : Setup

    Returns
    -------
    float
        Between 0 and 1.

    Raises
    ------
    SimulationError
        The model cannot be simulated in these steps.
    """
    found = []
    for record in records:
        velocity, inertia, rest = np.sqrt(np.mean(parts(model, *_motion(model, record, mode, setup)) ** 2, axis=0))
        found.append(float(velocity / (velocity + inertia + rest)) if velocity > 0.0 else 0.0)
    return max(found)


def parts(model: Model, q: Array, v: Array, a: Array) -> Array:
    """Norms of velocity terms, inertia terms and the rest at single states, shape (N, 3), N m.

    Joints that move along a line are weighed as if a metre were a radian.

    Parameters
    ----------
    model : Model
    q, v, a : ndarray, shape (N, n)
        Coordinates, rates and accelerations.
    """
    joints = len(model.joints)
    without = without_velocity_terms(model)
    found = []
    for place, rate, change in zip(q, v, a, strict=True):
        rest = without.inverse_dynamics(place, rate, change)[:joints]
        velocity = model.inverse_dynamics(place, rate, change)[:joints] - rest
        inertia = (model.mass_matrix(place) @ change)[:joints]
        found.append([float(np.linalg.norm(part)) for part in (velocity, inertia, rest - inertia)])
    return np.array(found)


def _motion(model: Model, record: Experiment, mode: str, setup: Setup) -> tuple[Array, Array, Array]:
    states = simulate_arrays(model, record, mode, setup=setup).states
    if states is None:
        raise SimulationError(f"{mode} tells no states; choose free_run or closed_loop")
    n = len(model.coordinates)
    q, v = states[:, :n], states[:, n : 2 * n]
    a = np.gradient(v, record.dt, axis=0)
    chosen = np.unique(np.linspace(0, len(q) - 1, min(SAMPLES, len(q))).astype(int))
    return q[chosen], v[chosen], a[chosen]
