"""Lengths of an element without their noise."""

from dataclasses import replace

import numpy as np

from vpm.errors import IdentificationError
from vpm.narx.maxwell_records import Samples


def smoothed(one: Samples, cutoff: float | None) -> Samples:
    """The record with its length low-passed without delay, and without its ends, where that filter does not hold.

    The length is the input of the element: its noise, times ``k0 + k1``, is not white noise of the force, and makes k1
    too small. The force is left as it is, so that its own noise stays white.

    ``cutoff``: Hz, well above the motion.
    """
    if cutoff is None:
        return one
    if not 0.0 < cutoff < 0.5 / one.step:
        raise IdentificationError(
            f"a cut-off of {cutoff:g} Hz is not between zero and half the sampling rate of {1.0 / one.step:g} Hz"
        )
    end = round(2.0 / (cutoff * one.step))
    if one.length.size < 4 * end:
        raise IdentificationError(
            f"record {one.name} has {one.length.size} samples, but a cut-off of {cutoff:g} Hz takes {end} from each "
            "end; give a longer record or a higher cut-off"
        )
    from scipy.signal import butter, sosfiltfilt

    sections = butter(4, cutoff, fs=1.0 / one.step, output="sos")
    length = sosfiltfilt(sections, one.length)
    inner = slice(end, one.length.size - end)
    return replace(
        one, time=one.time[inner], force=one.force[inner], length=np.asarray(length)[inner], drive=one.drive[inner]
    )
