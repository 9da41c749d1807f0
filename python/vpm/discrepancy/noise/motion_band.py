"""Frequency band of the motion: forces that depend on the motion lie in it, noise of accelerations above it."""

from __future__ import annotations

import numpy as np

from vpm.identify import InverseDynamicsProblem
from vpm.model import Model
from vpm.numbers import Array

#: Share of the power of the efforts that lies in the band.
SHARE = 0.99
#: Order of the low-pass, which passes forward and backward.
ORDER = 2
#: Above this share of the highest frequency that the samples hold there is nothing to filter.
WHOLE = 0.9


def motion_band(problem: InverseDynamicsProblem, model: Model) -> float:
    """Upper frequency of the motion band, Hz: efforts of all records have nearly all of their power below it.

    The noise of the residual comes from twice differentiated positions, so it grows with the square of the frequency.
    In a mean over all frequencies it hides what follows the motion; in this band it may not.
    """
    found = []
    for record in range(len(problem.motions)):
        time, applied, _ = problem.effort(model, model.theta, record)
        power = np.abs(np.fft.rfft((applied - applied.mean(axis=0)) * np.hanning(len(time))[:, None], axis=0)) ** 2
        summed = np.cumsum(power, axis=0)
        places = [np.searchsorted(column, SHARE * column[-1]) for column in summed.T if column[-1] > 0.0]
        found += [float(place) / (len(time) * float(time[1] - time[0])) for place in places]
    return max(found, default=np.inf)


def below(problem: InverseDynamicsProblem, values: Array, frequency: float) -> Array:
    """Residual within the motion band: without frequencies above ``frequency``, Hz, and without a time shift."""
    from scipy.signal import butter, sosfiltfilt

    kept = values.copy()
    for block in problem.blocks:
        share = 2.0 * frequency * float(block.time[1] - block.time[0])
        if 0.0 < share < WHOLE:
            kept[block.samples] = sosfiltfilt(butter(ORDER, share, output="sos"), values[block.samples])
    return kept
