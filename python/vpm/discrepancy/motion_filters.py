"""Motion filters of a diagnosis: one for the states that laws depend on, one for the compared band.

The customary preparation filters the motion just above the band that is kept (M. Gautier, ICRA 1997). At a reversal so
smooth a motion passes through rest sooner or later than the joint did. Dry friction, hysteresis or backlash along it
then err by more than a weak effect. Laws that are linear in the motion leave noise at its frequency, and the band
removes it later. So the filter of the states may be as fast as their noise allows.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vpm.experiment import Experiment, Motion, choose_cutoff
from vpm.experiment.cutoff import HIGHEST
from vpm.experiment.signal import UNDISTORTED_BAND
from vpm.identify import InverseDynamicsProblem
from vpm.identify.response_along_motion import bends, has_own_drives
from vpm.identify.sample_mask import STANDSTILL_SHARE
from vpm.model import Model

#: The motion is filtered at most so many times as high as the least error of its acceleration asks for.
QUICKER = 4.0


def filters(
    model: Model, training: InverseDynamicsProblem, cutoff: float | None
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Cut-off frequency of the motion filter and highest compared frequency of each record, Hz.

    Parameters
    ----------
    model : Model
        Flexible links and drives with states respond to the whole motion, and noise rings in them. For these, and where
        ``cutoff`` is given, the band is that of the motion filter.
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
    """Highest cut-off frequency of a motion filter at which velocity noise does not look like motion, Hz.

    White noise of the position with deviation ``s`` at the rate ``r`` has the density ``2 s^2 / r``; its derivative
    below ``f`` the mean square ``(2 pi)^2 (2 s^2 / r) f^3 / 3``. Two deviations are to stay below the speed under which
    a joint counts as standing.
    """
    found = HIGHEST * record.rate
    for joint in joints:
        channel = f"{joint}.position"
        read, retained = [record.read_rate(channel)], [record.retained.get(channel, np.inf)]
        noise = choose_cutoff(record[channel][:, None], record.rate, read, retained).noise[0]
        speed = np.abs(m.velocity[m.kept, m.joints.index(joint)])
        least = 0.5 * STANDSTILL_SHARE * float(np.quantile(speed, 0.999))
        if noise > 0.0:
            found = min(found, float(np.cbrt(3.0 * record.rate * least**2 / (8.0 * np.pi**2 * noise**2))))
    return found


__all__ = ["QUICKER", "filters", "quickest"]
