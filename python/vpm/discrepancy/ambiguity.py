"""What else the data would let stand in the place of an effect that was accepted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from vpm.discrepancy.candidates import Candidate, candidates
from vpm.discrepancy.choice import Accepted
from vpm.discrepancy.confirmation import Data, Judged, Trial, confirm, judge
from vpm.discrepancy.diagnosis import Ambiguity
from vpm.discrepancy.refusal import LEAST_GAIN
from vpm.discrepancy.round import HEAVY
from vpm.discrepancy.screening import Probe, impossible_values, probe
from vpm.errors import DivergedError
from vpm.identify import gain, segments
from vpm.identify.along import bends

#: Rivals that are refitted in the place of an effect.
SHORT_LIST = 3
#: A rival that takes less than this share of what the effect takes from the training residual is none.
LEAST_SHARE = 0.8
#: A rival that leaves up to this share more of the unseen mean square predicts as well.
AS_GOOD = 0.05


@dataclass(frozen=True)
class Rivals:
    """An accepted effect, and the models in which something else does its work as well."""

    effect: str
    site: str
    trials: tuple[Trial, ...]

    @property
    def label(self) -> str:
        """``effect at site``."""
        return f"{self.effect} at {self.site}"


def listed(known: Sequence[Ambiguity], found: Sequence[Rivals]) -> tuple[Ambiguity, ...]:
    """What the search saw already, and what else does as well, each named once."""
    said = {(a.name, a.site, other) for a in known for other in a.others}
    more = []
    for entry in found:
        labels = (trial.probe.candidate.label for trial in entry.trials)
        names = tuple(label for label in labels if (entry.effect, entry.site, label) not in said)
        if names:
            reason = "put in its place and fitted, it predicts the unseen data as well"
            more.append(Ambiguity(entry.effect, entry.site, names, reason))
    return (*known, *more)


def rivals(
    final: Judged, data: Data, accepted: Sequence[Accepted], effects: Sequence[str] | None = None
) -> tuple[Rivals, ...]:
    """Replace each accepted effect in turn by every other that could do its work, and keep those that do it as well.

    All rivals are screened on the model without the effect; the few that take nearly as much from the training
    residual are refitted, and have to predict the unseen records as the effect does.
    """
    return tuple(_of_one(final, data, entry, effects) for entry in accepted)


def _of_one(final: Judged, data: Data, entry: Accepted, effects: Sequence[str] | None) -> Rivals:
    name, site = entry.key
    try:
        model = final.model.without_effect(name, site)
        free = tuple(n for n in final.free if n in model.parameters)
        without = judge(model, free, data, {n: pair for n, pair in final.bounds.items() if n in free})
    except DivergedError:
        return Rivals(name, site, ())
    taken = _power(without) - _power(final)
    others = [c for c in candidates(model, data.training, without.fit.residual, effects) if _near(c, entry)]
    if bends(model) and name not in HEAVY:  # a spring more would not have been tried beside what is lighter and does
        others = [c for c in others if c.effect.name not in HEAVY]
    probes = [probe(without.baseline, data.training, candidate) for candidate in others]
    good = [
        p for p in probes if p.free and not impossible_values(p) and p.drop * _power(without) >= LEAST_SHARE * taken
    ]
    good.sort(key=lambda p: -p.score)
    trials = [_tried(without, data, p) for p in good[:SHORT_LIST]]
    return Rivals(name, site, tuple(t for t in trials if t is not None and _as_good(final, t, data)))


def _tried(without: Judged, data: Data, promising: Probe) -> Trial | None:
    try:
        return confirm(without, data, promising)
    except DivergedError:
        return None


def _near(candidate: Candidate, entry: Accepted) -> bool:
    """Another effect that acts on the same joint, or that the catalogue knows to be taken for this one."""
    name, site = entry.key
    if candidate.key == (name, site):
        return False
    own = entry.trial.probe.candidate.effect
    return candidate.site == site or candidate.effect.name in own.confused_with or candidate.effect.site == "actuator"


def _as_good(final: Judged, trial: Trial, data: Data) -> bool:
    if not trial.clear:
        return False
    change = gain(final.unseen, trial.judged.unseen, segments(data.unseen)).relative
    return change > -max(AS_GOOD, LEAST_GAIN)


def _power(judged: Judged) -> float:
    return float(judged.fit.residual @ judged.fit.residual)
