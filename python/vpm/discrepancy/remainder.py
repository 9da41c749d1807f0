"""What effects leave: whether it repeats on unseen records, and how much of the gap they are the explanation of.

The floor of the noise is an estimate, and a residual need not stand far above it to be no noise. So a fit without
physics is put beside the effects: what it predicts of records that it never saw, physics would predict too. Effects
that leave much of what a mere fit finds were only the nearest of the catalogue.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vpm.discrepancy.band import below, motion_band
from vpm.discrepancy.confirmation import Data, Judged
from vpm.discrepancy.diagnosis import Empirical
from vpm.discrepancy.empirical import describe
from vpm.discrepancy.refusal import WORTH_A_NAME, Thresholds
from vpm.discrepancy.timing import in_time
from vpm.identify import gain, segments

Array = NDArray[np.float64]

#: A later description has to leave less than this share of what an earlier one leaves to be taken in its place.
CLEARLY = 0.9
#: Share of what effects leave, below which a fit with no more numbers is not a matter of chance or of a rough law.
HALF = 0.5
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
    instead : bool
        Whether a fit in the place of the effects, with no more numbers, leaves less than ``HALF`` of what they leave.
    """

    choices: tuple[Described, ...]
    repeats: bool
    open: float
    instead: bool

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
    view = _View(data, motion_band(data.training, final.model), Thresholds(DESCRIBED, interval))
    left = view(final)
    power = float(left @ left)
    leave = [view.leaves(choice, left) for choice in choices]
    least = min(leave)
    if least >= power:
        return Remainder(choices, repeats=False, open=0.0, instead=False)
    start = view(recalibrated)
    whole = max(float(start @ start), power)
    plain = len(choices[0].judged.free) <= len(final.free)
    instead = recalibrated is not final and plain and leave[0] < HALF * power
    return Remainder(choices, repeats=True, open=(power - least) / (whole - least), instead=instead)


@dataclass(frozen=True)
class _View:
    """Unseen residuals in the band of the motion, with what the times of samples leave open."""

    data: Data
    frequency: float
    thresholds: Thresholds

    def __call__(self, judged: Judged) -> Array:
        """Residual of a model."""
        return below(self.data.unseen, in_time(judged, self.data).unseen, self.frequency)

    def leaves(self, choice: Described, left: Array) -> float:
        """Sum of squares that a description leaves; that of ``left`` where it is not clearly better than that."""
        power = float(left @ left)
        if choice.told.remark:
            own = self(choice.base)
            rest = (1.0 - choice.told.predicted) * float(own @ own)
            return rest if rest < (1.0 - WORTH_A_NAME) * power else power
        after = self(choice.judged)
        return float(after @ after) if self.thresholds.met(gain(left, after, segments(self.data.unseen))) else power
