"""Low-frequency part of a residual, in which errors of single impacts in a backlash average out.

Simulated flights along a measured motion miss the moment and the size of single impacts, because errors accumulate
between elastic contacts. These errors dominate the residual of a model with backlash and hide smaller effects. The mean
over many impacts is right: the mean effort through a contact does not depend on its stiffness.
"""

from __future__ import annotations

from vpm.identify import InverseDynamicsProblem
from vpm.model import Model
from vpm.numbers import Array

#: Time over which residuals are averaged, twice, s: several swings of the softest contact, parts of a stroke.
AVERAGED = 0.25


def has_impacts(model: Model) -> bool:
    """Whether links of a model hit contacts, so that only the low-frequency residual is reliable."""
    return any(effect.type.has_play for effect in model.effects)


def low_frequency(problem: InverseDynamicsProblem, residual: Array) -> Array:
    """Low-frequency residual: averaged over ``AVERAGED`` twice, each channel of each record by itself."""
    from scipy.ndimage import uniform_filter1d

    averaged = residual.copy()
    for block in problem.blocks:
        if block.time.size < 2:
            continue
        length = max(1, round(AVERAGED / float(block.time[1] - block.time[0])))
        for _ in range(2):
            averaged[block.samples] = uniform_filter1d(averaged[block.samples], length, mode="nearest")
    return averaged
