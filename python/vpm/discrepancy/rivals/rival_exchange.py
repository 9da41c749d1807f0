"""Rival exchange after the search: a better rival takes an effect's place, and effects get their order.

The search names one effect at a time and prefers the simpler law, because little is known at its beginning. After its
end each effect was removed again and its rivals were put in its place (`vpm.discrepancy.rivals.ambiguity`). So every
name is judged beside all the others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vpm.discrepancy.confirmation.confirmation import Data, Judged, Trial, finished, shrinkage, simulated_gain
from vpm.discrepancy.confirmation.refusal import Thresholds, refuse_trial
from vpm.discrepancy.diagnosis import RefusedEffect
from vpm.discrepancy.rivals.ambiguity import Rivals, as_good, contains
from vpm.discrepancy.search.candidate_choice import Accepted, alike, schwarz
from vpm.discrepancy.search.search import Search, Stage
from vpm.discrepancy.settings import LEAST_GAIN, NORMAL_95_ONE_SIDED
from vpm.identify import Gain, gain, segments
from vpm.numbers import power


def replaced(found: Search, known: Sequence[Rivals], data: Data) -> tuple[Search, tuple[Rivals, ...]]:
    """Exchange one effect for the rival that the validation data prefer most, if there is one.

    A rival counts that acts at the same site and is confused with the effect. A rival changes a name and adds none, so
    it need not halve the residual. It only has to predict the validation data better than the effect.

    The search is the same one if every effect stays.

    Rivals of the effect that came in are complete, those of the others are as they were.
    """
    thresholds = Thresholds(max(1, sum(len(one.tried) for one in known)), data.interval)
    winners = [
        (score, place, trial)
        for place, entry in enumerate(found.accepted)
        for trial in known[place].tried
        if trial.probe.candidate.key not in found.gone
        and (score := _preferred(found.final, entry, trial, data, thresholds)) > 0.0
    ]
    for _, place, trial in sorted(winners, key=lambda w: -w[0]):
        without = known[place].without
        whole = trial if without is None else finished(without, data, trial)
        if _preferred(found.final, found.accepted[place], whole, data, thresholds) > 0.0:
            return exchanged(found, known, data, place, whole)
    return found, tuple(known)


def _preferred(final: Judged, entry: Accepted, trial: Trial, data: Data, thresholds: Thresholds) -> float:
    """Standard deviations by which validation data prefer a rival for an exchange; 0 if not in every view."""
    if trial.probe.candidate.effect.late and entry.effect.late:
        return 0.0  # residual and simulation said which: the residual alone knows less of it
    if not alike(trial.probe.candidate, entry.trial.probe.candidate) or refuse_trial(trial, thresholds):
        return 0.0
    unseen = trial.judged.validation * shrinkage(data.validation, final, trial.judged)
    validation = gain(final.validation, unseen, segments(data.validation))
    fitted = gain(final.fit.residual, trial.judged.fit.residual, segments(data.training))
    simulated = simulated_gain(final, trial.judged, data)
    worse = simulated is not None and simulated.harm > NORMAL_95_ONE_SIDED and simulated.relative < -LEAST_GAIN
    if worse or not earned(fitted, len(trial.parameters) - len(entry.trial.parameters)):
        return 0.0
    shown = fitted.score >= thresholds.score(fitted.pieces)
    nested = shown and contains(trial.judged, trial.parameters, final, entry.trial.parameters)
    sure = validation.score >= thresholds.score(validation.pieces)
    return validation.score if sure and validation.harm <= (0.0 if nested else -NORMAL_95_ONE_SIDED) else 0.0


def earned(fitted: Gain, more: int) -> bool:
    """Whether a rival lowers the training error by the cost of its additional numbers, so that an exchange pays.

    By the information criterion on training records. Parameters that these do not show would only fit the errors of
    friction laws at a few reversals of other records.

    - ``fitted``: of the training records, from the effect to the rival
    - ``more``: numbers that the rival has more than the effect
    """
    return fitted.relative > 0.0 and schwarz(fitted, max(more, 0)) < 0.0


def exchanged(
    found: Search, known: Sequence[Rivals], data: Data, place: int, trial: Trial
) -> tuple[Search, tuple[Rivals, ...]]:
    """Search after the exchange of an effect for a rival, with the rivals of that one."""
    entry, mine = found.accepted[place], known[place]
    new, old = trial.probe.candidate, entry.trial.probe.candidate
    incoming = Accepted(trial, ())
    reason = f"beside the other effects {new.label} in its place predicts the validation data better"
    stages = (
        *found.stages,
        *(() if mine.without is None else (Stage("removed", *entry.key, mine.without),)),
        Stage("added", *new.key, trial.judged),
    )
    refused = tuple(r for r in found.refused if (r.name, r.site) not in {new.key, old.key})
    ranking = [replace(c, accepted=c.accepted and (c.name, c.site) != old.key) for c in found.ranking]
    last = max((n for n, c in enumerate(ranking) if (c.name, c.site) == new.key), default=None)
    if last is not None:
        ranking[last] = replace(ranking[last], accepted=True)
    changed = replace(
        found,
        stages=stages,
        accepted=tuple(incoming if n == place else one for n, one in enumerate(found.accepted)),
        refused=(*refused, RefusedEffect(*old.key, reason)),
        ranking=tuple(ranking),
    )
    outgoing = replace(entry.trial, judged=found.final)
    tried = tuple(t for t in (*mine.tried, outgoing) if t.probe is not trial.probe)
    rest = tuple(t for t in tried if as_good(trial.judged, t, data))
    entry_of_new = Rivals(*new.key, rest, tried, mine.without)
    return changed, tuple(entry_of_new if n == place else one for n, one in enumerate(known))


def in_order(found: Search, known: Sequence[Rivals]) -> tuple[Search, tuple[Rivals, ...]]:
    """Accepted effects after the exchange, ordered by what each adds to validation beside all others.

    An effect may have a held number that the data show only together with another effect. It comes after that one: with
    either removed, the held number would decide how they share the residual.
    """
    adds = [np.inf if r.without is None else power(r.without.validation) for r in known]
    left, order = list(range(len(found.accepted))), list[int]()
    while left:
        ready = [n for n in left if not any(_refines(found.accepted[n], found.accepted[m]) for m in left if m != n)]
        best = max(ready or left, key=lambda n: adds[n])
        order.append(best)
        left.remove(best)
    return replace(found, accepted=tuple(found.accepted[n] for n in order)), tuple(known[n] for n in order)


def _refines(entry: Accepted, other: Accepted) -> bool:
    """Whether a parameter of one effect was held for another one, so that their order is given."""
    return bool({alias.partner for alias in entry.trial.held} & set(other.trial.parameters))
