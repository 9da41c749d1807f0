"""What effects leave: whether it repeats on unseen records, and how much of the gap they are the explanation of.

The floor of the noise is an estimate, and a residual need not stand far above it to be no noise. So a fit without
physics is put beside the effects: what it predicts of records that it never saw, physics would predict too. Effects
that leave much of what a mere fit finds were only the nearest of the catalogue.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vpm.discrepancy.confirmation import Data, Judged
from vpm.discrepancy.diagnosis import Empirical
from vpm.discrepancy.empirical import describe
from vpm.discrepancy.refusal import WORTH_A_NAME, Thresholds
from vpm.discrepancy.timing import in_time
from vpm.identify import gain, segments

Array = NDArray[np.float64]

#: A later description has to leave less than this share of what an earlier one leaves to be taken in its place.
CLEARLY = 0.9
#: Models that are described: that with the effects, and that without.
DESCRIBED = 2


@dataclass(frozen=True)
class Described:
    """A model, what is said of its residual, and the model with the formula for it."""

    base: Judged
    told: Empirical
    judged: Judged


@dataclass(frozen=True)
class Remainder:
    """What the model with all accepted effects leaves of the unseen records.

    Attributes
    ----------
    choices : tuple of Described
        The model with the effects, and the recalibrated one where there are effects.
    repeats : bool
        Whether a fit without physics predicts a part of it that is worth a name.
    open : float
        Share that the effects leave of the mean square that a fit finds in the recalibrated residual; 0 where nothing
        repeats.
    """

    choices: tuple[Described, ...]
    repeats: bool
    open: float

    @property
    def best(self) -> Described:
        """The description that leaves least, the one with fewer effects if it is hardly worse."""
        *first, last = self.choices
        return first[0] if first and last.told.after >= CLEARLY * first[0].told.after else last


def remainder(recalibrated: Judged, final: Judged, data: Data, interval: float) -> Remainder:
    """Describe what is left of a model, and of the one that it began with.

    Parameters
    ----------
    recalibrated, final : Judged
        Without and with the accepted effects; the same one if there is none.
    data : Data
    interval : float
        Sampling interval, s.
    """
    bases = [final] if recalibrated is final else [recalibrated, final]
    choices = tuple(Described(base, *describe(base, data)) for base in bases)
    thresholds = Thresholds(DESCRIBED, interval)
    left = in_time(final, data).unseen
    power = float(left @ left)
    least = min((_left(choice, left, data, thresholds) for choice in choices), default=power)
    if least >= power:
        return Remainder(choices, repeats=False, open=0.0)
    start = in_time(recalibrated, data).unseen
    whole = max(float(start @ start), power)
    return Remainder(choices, repeats=True, open=(power - least) / (whole - least))


def _left(choice: Described, left: Array, data: Data, thresholds: Thresholds) -> float:
    """Sum of squares that a description leaves; that of ``left`` where it is not clearly better than the effects."""
    power = float(left @ left)
    if choice.told.remark:
        own = in_time(choice.base, data).unseen
        rest = (1.0 - choice.told.predicted) * float(own @ own)
        return rest if rest < (1.0 - WORTH_A_NAME) * power else power
    after = in_time(choice.judged, data).unseen
    return float(after @ after) if thresholds.met(gain(left, after, segments(data.unseen))) else power
