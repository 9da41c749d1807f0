"""The filters of a diagnosis: one for the states that laws are drawn over, one for the band that is compared.

The customary preparation filters the motion just above the band that is kept (M. Gautier, ICRA 1997). Where a joint
turns round, so smooth a motion passes through rest sooner or later than the joint did, and dry friction, hysteresis or
play along it part from what was measured by more than a weak effect does. What a law that is linear in the motion makes
of noise stays at its frequency, and the band takes it out later; so states may be as quick as their noise allows.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vpm.experiment import Experiment, Motion, choose_cutoff
from vpm.experiment.cutoff import HIGHEST
from vpm.experiment.signal import UNDISTORTED_BAND
from vpm.identify import InverseDynamicsProblem
from vpm.identify.along import bends, has_own_drives
from vpm.identify.sample_mask import STANDSTILL_SHARE
from vpm.model import Model

#: The motion is filtered at most so many times as high as the least error of its acceleration asks for.
QUICKER = 4.0


def filters(
    model: Model, training: InverseDynamicsProblem, cutoff: float | None
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Cut-off frequency of the motion filter and highest frequency that is compared, of each record, Hz.

    Parameters
    ----------
    model : Model
        Links that bend and drives with states of their own answer to the whole motion, with noise that rings in them:
        for these, and where ``cutoff`` is given, the band is all that the motion filter leaves alone.
    training : InverseDynamicsProblem
        With the cut-off frequencies that suit each record.
    cutoff : float or None
    """
    own = tuple(m.cutoff for m in training.motions)
    bands = tuple(UNDISTORTED_BAND * one for one in own)
    if cutoff is not None or bends(model) or has_own_drives(model):
        return own, bands
    pairs = zip(training.experiments, training.motions, strict=True)
    highest = (quickest(record, m, training.joints) for record, m in pairs)
    return tuple(max(one, min(QUICKER * one, most)) for one, most in zip(own, highest, strict=True)), bands


def quickest(record: Experiment, m: Motion, joints: Sequence[str]) -> float:
    """Cut-off frequency up to which noise of the velocity does not pass for motion, Hz.

    White noise of the position with deviation ``s`` at the rate ``r`` has the density ``2 s^2 / r``; its derivative
    below ``f`` the mean square ``(2 pi)^2 (2 s^2 / r) f^3 / 3``. Two deviations are to stay below the speed under which
    a joint counts as standing.
    """
    found = HIGHEST * record.rate
    for joint in joints:
        noise = choose_cutoff(record[f"{joint}.position"][:, None], record.rate).noise[0]
        speed = np.abs(m.velocity[m.kept, m.joints.index(joint)])
        least = 0.5 * STANDSTILL_SHARE * float(np.quantile(speed, 0.999))
        if noise > 0.0:
            found = min(found, float(np.cbrt(3.0 * record.rate * least**2 / (8.0 * np.pi**2 * noise**2))))
    return found


__all__ = ["QUICKER", "filters", "quickest"]
