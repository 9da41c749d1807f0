"""Start value for the limit of a drive: the command above which the drive delivers less than commanded."""

from __future__ import annotations

import numpy as np

from vpm.identify import InverseDynamicsProblem
from vpm.numbers import Array

#: Limits compared, the largest share of the samples that may lie beyond one, and the fewest.
LIMITS, BEYOND_MOST, BEYOND_LEAST = 30, 0.5, 3


def limit_start(data: InverseDynamicsProblem, joint: str, actuator: int, residual: Array) -> float | None:
    """Start value of a drive limit: the cut-off of the command that explains most of a residual.

    A limited drive leaves what the command has too much, which is a ramp in the command with the slope of the gain.
    Commands of a loop whose drive gives no more run far beyond it, so that shares of the largest one say little.

    Parameters
    ----------
    data : InverseDynamicsProblem
    joint : str
        On which the drive acts.
    actuator : int
        Its number among the inputs.
    residual : ndarray
        Of the model without the limit.

    Returns
    -------
    float or None
        None where no such ramp is in the residual.
    """
    column = data.joints.index(joint) if joint in data.joints else 0
    commands = [m.inputs[:, actuator] for m in data.motions]
    order = np.sort(np.abs(np.concatenate(commands)))
    most = int(BEYOND_MOST * order.size)
    if most <= BEYOND_LEAST:
        return None
    limits = order[-np.unique(np.geomspace(BEYOND_LEAST, most, LIMITS).astype(np.int64)) - 1]
    along, power = np.zeros(limits.size), np.zeros(limits.size)
    for record, (m, command) in enumerate(zip(data.motions, commands, strict=True)):
        block = data.efforts(record)[column]
        beyond = command[:, None] - np.clip(command[:, None], -limits, limits)
        ramps = m.parallel(beyond) * block.moving[:, None]
        along += ramps.T @ residual[block.samples]
        power += np.sum(ramps**2, axis=0)
    taken = along**2 / np.where(power > 0.0, power, np.inf)
    best = int(np.argmax(taken))
    return float(limits[best]) if taken[best] > 0.0 else None
