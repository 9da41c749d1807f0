"""Choice among candidates that validation data support: least residual, fewest numbers, the machine before sensors.

Sensor errors are judged by the predicted reading of the sensor itself. Along a measured motion no load changes the
output of a drive. A constant force and the offset of a pressure gauge may therefore leave the same torque residual. The
reading of the gauge itself follows from the commands and discriminates the two.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from vpm.catalogue import EFFECTS, EffectType
from vpm.catalogue.kinds import Side, in_words
from vpm.discrepancy.confirmation.confirmation import Data, Trial
from vpm.discrepancy.screening.candidates import Candidate, Key
from vpm.discrepancy.screening.compliance_and_stop_start import coupled
from vpm.discrepancy.settings import CLEAR_GAIN, LEAST_GAIN, NORMAL_95_ONE_SIDED, SAME, SENSOR_SHARE, TIE, WORTH_A_NAME
from vpm.identify import Gain, InverseDynamicsProblem, gain, segments
from vpm.model import Model
from vpm.numbers import Array, power


@dataclass(frozen=True)
class Accepted:
    """Accepted effect: the trial that was chosen, and rivals that would do as well.

    Where a ranking named it, with its evidence in nats, its probability and its side of a joint that is split.
    """

    trial: Trial
    rivals: tuple[str, ...]
    evidence: float = float("nan")
    probability: float = float("nan")
    side: Side = "motor"
    class_probability: float = float("nan")

    @property
    def key(self) -> Key:
        """Effect and site of an accepted candidate."""
        return self.trial.probe.candidate.key

    @property
    def effect(self) -> EffectType:
        """Catalogue entry of an accepted candidate."""
        return self.trial.probe.candidate.effect

    @property
    def label(self) -> str:
        """Label of an accepted candidate: ``effect at site``, with its side behind what gives way."""
        return in_words(self.trial.probe.candidate.label, self.side)

    @property
    def ranked(self) -> bool:
        """Whether a ranking named the chosen candidate."""
        return bool(np.isfinite(self.evidence))


def choose(supported: Sequence[Trial], data: Data) -> Accepted:
    """Choose the candidate with the least criterion; of equally good ones the one whose simulation is best.

    One that refines another only takes its place if it leaves less than ``CLEAR_GAIN`` of what that leaves.
    """
    least = partial(cost, stated=data.training.nominal)
    first = min(supported, key=least)
    plain = [t for t in supported if _plainer(t, first)]
    first = min(plain, key=least) if plain else first
    equals = [t for t in supported if _as_good(t, first)]
    chosen = preferred_sensor(_first_named(equals), equals, data)
    return Accepted(chosen, tuple(t.probe.candidate.label for t in equals if t is not chosen))


def _first_named(equals: Sequence[Trial]) -> Trial:
    """Choice by evidence; of several identical models, the first in the catalogue.

    On a single link, joint compliance of the drive and a link that bends at its root are the same model. Rounding would
    decide between them.
    """
    best = min(map(_evidence, equals))
    tied = [t for t in equals if _evidence(t) <= best + TIE]
    return min(tied, key=lambda t: list(EFFECTS).index(t.probe.candidate.effect.name))


def _left(trial: Trial) -> float:
    """Share of the validation mean square that a candidate leaves."""
    return _share(trial.validation)


def _share(gained: Gain) -> float:
    return max(1.0 - gained.relative, 1e-12)


def cost(trial: Trial, stated: Model) -> float:
    """Cost of a candidate in the choice: information criterion of the validation data, see `schwarz`.

    With what the model file states of known parameters, a measurement of them: each normal deviation counts squared.
    """
    prior = sum(
        ((trial.judged.model.parameters[name].value - known.value) / known.uncertainty) ** 2
        for name in trial.judged.free
        if (known := stated.parameters.get(name)) is not None and known.uncertainty
    )
    return schwarz(trial.validation, len(trial.parameters)) + prior / max(trial.validation.pieces, 3)


def schwarz(gained: Gain, numbers: int) -> float:
    """Criterion to choose a candidate by G. Schwarz (*Annals of Statistics* 6, 1978) per independent piece.

    It is 0 for no change.

    - ``gained``: what the numbers gain
    - ``numbers``: how many are fitted
    """
    pieces = max(gained.pieces, 3)
    return float(np.log(_share(gained)) + numbers * np.log(pieces) / pieces)


def _plainer(trial: Trial, first: Trial) -> bool:
    """Whether a candidate explains nearly as much as ``first`` with fewer numbers, at the same site and confusable."""
    fewer = len(trial.parameters) < len(first.parameters)
    return alike(trial.probe.candidate, first.probe.candidate) and fewer and CLEAR_GAIN * _left(trial) <= _left(first)


def alike(one: Candidate, other: Candidate) -> bool:
    """Whether two candidates act at the same site and the catalogue calls them confusable."""
    confused = other.effect.name in one.effect.confused_with or one.effect.name in other.effect.confused_with
    return one.site == other.site and confused


def _as_good(trial: Trial, first: Trial) -> bool:
    """Whether a candidate explains the validation data as well as the first one, with no more numbers."""
    close = trial.validation.relative >= first.validation.relative - LEAST_GAIN and _left(trial) <= SAME * _left(first)
    return close and len(trial.parameters) <= len(first.parameters)


def _evidence(trial: Trial) -> float:
    """Evidence for the choice: logarithm of the error left in both views, with a preference for the machine."""
    left = np.log(max(trial.validation.after, 1e-300) / trial.validation.before)
    if trial.probe.candidate.effect.site == "sensor":
        left -= np.log(SENSOR_SHARE)
    # Errors of coupled joints cancel; see refusal.CLEAR_GAIN.
    if trial.simulated is not None and trial.simulated.before > 0.0 and not coupled(trial.judged.model):
        left += np.log(max(trial.simulated.after, 1e-300) / trial.simulated.before)
    return float(left)


def preferred_sensor(chosen: Trial, equals: Sequence[Trial], data: Data) -> Trial:
    """Sensor error whose predicted reading supports it, of trials as good as ``chosen``; else ``chosen``.

    On training and validation records it has to predict its channel clearly better than ``chosen`` does, by as much as
    is worth a name. It may not leave more of all channels together.
    """
    if chosen.probe.candidate.effect.site == "sensor":
        return chosen
    supported = [t for t in equals if t.probe.candidate.effect.site == "sensor" and _is_supported(t, chosen, data)]
    return min(supported, key=lambda t: power(t.judged.validation), default=chosen)


def _is_supported(trial: Trial, chosen: Trial, data: Data) -> bool:
    site, model = trial.probe.candidate.site, trial.judged.model
    channels = [channel for channel in data.validation.shown if model.sensor_of(channel) == site]
    pairs = (
        (data.training, chosen.judged.fit.residual, trial.judged.fit.residual),
        (data.validation, chosen.judged.validation, trial.judged.validation),
    )
    return bool(channels) and all(_better(problem, channels, before, after) for problem, before, after in pairs)


def _better(problem: InverseDynamicsProblem, channels: Sequence[str], before: Array, after: Array) -> bool:
    own = np.zeros(before.size)
    for block in problem.blocks:
        own[block.samples] = block.channel in channels
    gained = gain(before * own, after * own, segments(problem))
    sure = gained.relative >= WORTH_A_NAME and gained.score >= NORMAL_95_ONE_SIDED
    return sure and power(after) <= power(before)
