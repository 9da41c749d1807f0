"""Remainder of the residual after all effects: whether it repeats, and the share that effects explain.

The noise floor is an estimate, and a residual close to it may still not be noise. So an empirical fit is compared with
the effects: what it predicts of validation records, the right physics would predict too. Effects that leave much of
what such a fit explains were only the nearest ones of the catalogue.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.special import stdtrit

from vpm.discrepancy.judged_model import Data, Judged
from vpm.discrepancy.remainder.empirical_formula import Described, describe
from vpm.discrepancy.settings import EFFORT_SHARE, FALSE_ALARM_LEVEL, MODEST_FACTOR, MODEST_GAIN, WORTH_A_NAME
from vpm.discrepancy.shifted_commands import in_time
from vpm.identify import Gain, InverseDynamicsProblem, gain, segments
from vpm.identify.parallel import in_order
from vpm.model import Model
from vpm.numbers import Array, power


@dataclass(frozen=True)
class Thresholds:
    """Thresholds below which a description of the remainder says nothing."""

    #: Number of descriptions tried; the false-alarm level is divided by it (Bonferroni).
    candidates: int

    def score(self, pieces: int) -> float:
        """Threshold of the validation gain, in standard deviations by Student's t for so few pieces."""
        return float(stdtrit(max(1, pieces - 1), 1.0 - FALSE_ALARM_LEVEL / max(1, self.candidates)))

    def needed(self, validation: Gain) -> float:
        """Standard deviations of gain below which it says nothing; more where most of the residual stays."""
        modest = validation.relative < MODEST_GAIN
        return self.score(validation.pieces) * (MODEST_FACTOR if modest else 1.0)

    def met(self, validation: Gain) -> bool:
        """Whether a gain meets the thresholds: it is large enough and sure."""
        return validation.relative >= WORTH_A_NAME and validation.score >= self.needed(validation)


@dataclass(frozen=True)
class Remainder:
    """Remainder of validation records under the model with all accepted effects."""

    choices: tuple[Described, ...]  #: The model with the effects, and the recalibrated one where there are effects.
    repeats: bool  #: Whether a fit without physics predicts a part of it that is worth a name.
    #: Share that the effects leave of the mean square that a fit finds in the recalibrated residual; 0 where nothing
    #: repeats.
    open: float

    @property
    def best(self) -> Described:
        """Best description of the remainder, with fewer effects if that is hardly worse."""
        *first, last = self.choices
        return first[0] if first and last.empirical.after >= (1.0 - WORTH_A_NAME) * first[0].empirical.after else last


def remainder(recalibrated: Judged, final: Judged, data: Data, workers: int = 1) -> Remainder:
    """Describe the remainder of the final model, and that of the model before effects.

    - ``recalibrated``, ``final``: without and with the accepted effects; the same one if there is none
    - ``workers``: models that are described at a time; the result does not depend on it
    """
    bases = [final] if recalibrated is final else [recalibrated, final]
    choices = tuple(in_order([partial(describe, base, data) for base in bases], workers))
    view = _View(data, motion_band(data.training, final.model), Thresholds(len(bases)))
    left = view(final)
    clear = [view.clearly_better(choice, left) for choice in choices]
    if not any(clear):
        return Remainder(choices, repeats=False, open=0.0)
    rest, whole = power(in_time(final, data).validation), power(_before(recalibrated, final, data))
    least = min(view.leaves(choice) for choice, better in zip(choices, clear, strict=True) if better)
    share = np.clip((rest - least) / max(whole - least, 1e-300), 0.0, 1.0)
    return Remainder(choices, repeats=True, open=float(share))


def _before(recalibrated: Judged, final: Judged, data: Data) -> Array:
    """Residual of the recalibrated model, to which the remainder is compared; less a shift of commands."""
    known = {effect.key for effect in recalibrated.model.effects}
    late = any(effect.type.shifts and effect.key not in known for effect in final.model.effects)
    return recalibrated.validation if late else in_time(recalibrated, data).validation


@dataclass(frozen=True)
class _View:
    """Validation residuals in the motion band, with uncertain sample times removed, for the remainder."""

    data: Data
    frequency: float
    thresholds: Thresholds

    def __call__(self, judged: Judged) -> Array:
        """Validation residual of a model as the remainder sees it."""
        return below(self.data.validation, in_time(judged, self.data).validation, self.frequency)

    def clearly_better(self, choice: Described, left: Array) -> bool:
        """Whether a description of the remainder predicts surely more than the effects do."""
        if choice.empirical.remark:
            own = self(choice.base)
            return power(own) - self._said(choice, own) < (1.0 - WORTH_A_NAME) * power(left)
        return self.thresholds.met(gain(left, self(choice.judged), segments(self.data.validation)))

    def leaves(self, choice: Described) -> float:
        """Sum of squares that a description of the remainder leaves at all frequencies."""
        own = in_time(choice.judged, self.data).validation
        return power(own) - self._said(choice, own) if choice.empirical.remark else power(own)

    def _said(self, choice: Described, own: Array) -> float:
        """Sum of squares that a remark on the remainder predicts, at the effort that it names."""
        blocks = (block for block in self.data.validation.blocks if block.channel == choice.empirical.channel)
        return choice.empirical.predicted * sum(power(own[block.samples]) for block in blocks)


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
        places = [np.searchsorted(column, EFFORT_SHARE * column[-1]) for column in summed.T if column[-1] > 0.0]
        found += [float(place) / (len(time) * float(time[1] - time[0])) for place in places]
    return max(found, default=np.inf)


def below(problem: InverseDynamicsProblem, values: Array, frequency: float) -> Array:
    """Residual within the motion band: without frequencies above ``frequency``, Hz, and without a time shift."""
    from scipy.signal import butter, sosfiltfilt

    kept = values.copy()
    for block in problem.blocks:
        share = 2.0 * frequency * float(block.time[1] - block.time[0])
        if 0.0 < share < 0.9:
            kept[block.samples] = sosfiltfilt(butter(2, share, output="sos"), values[block.samples])
    return kept
