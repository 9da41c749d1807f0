"""Ambiguity: rival effects that predict the validation records as well as an accepted effect."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from vpm.discrepancy.confirmation.confirmation import Data, Judged, Trial, confirm, judge
from vpm.discrepancy.diagnosis import Ambiguity
from vpm.discrepancy.parallel_candidates import Failure
from vpm.discrepancy.screening.candidates import Candidate, Key, candidates, joint_at
from vpm.discrepancy.screening.probe import Probe, impossible_values, probe, refit_effort, screening_effort
from vpm.discrepancy.search.candidate_choice import Accepted
from vpm.discrepancy.search.search import Search, Tried
from vpm.discrepancy.search.search_round import Request
from vpm.discrepancy.settings import CLEAR_GAIN, CLEARLY, LEAST_SHARE, RIVALS_TRIED
from vpm.identify import gain, segments
from vpm.identify.response_along_motion import answers_at_once, bends
from vpm.model import Model
from vpm.numbers import power


@dataclass(frozen=True)
class Rivals:
    """Rivals of an accepted effect: trials in its place that predict the validation records as well."""

    effect: str
    site: str
    trials: tuple[Trial, ...]  #: Those that predict the validation data as well.
    without: Judged | None = None  #: The model without it; None where that cannot be computed.

    @property
    def label(self) -> str:
        """Label of the ambiguous effect that rivals compete with: ``effect at site``."""
        return f"{self.effect} at {self.site}"


def listed(known: Sequence[Ambiguity], found: Sequence[Rivals]) -> tuple[Ambiguity, ...]:
    """Ambiguities for the result: those that the search saw, and rivals found afterwards, each named once."""
    said = {(a.name, a.site, other) for a in known for other in a.others}
    more = []
    for entry in found:
        labels = (trial.probe.candidate.label for trial in entry.trials)
        names = tuple(label for label in labels if (entry.effect, entry.site, label) not in said)
        if names:
            reason = "put in its place and fitted, it predicts the validation data as well"
            more.append(Ambiguity(entry.effect, entry.site, names, reason))
    return (*known, *more)


def rivals(
    final: Judged, data: Data, accepted: Sequence[Accepted], request: Request, last: Tried | None = None
) -> tuple[Rivals, ...]:
    """Ambiguity of each accepted effect: rivals in its place that predict the validation data as well.

    All rivals are screened on the model without the effect; the few with nearly the same share of the training residual
    are refitted. They have to predict the validation records as well as the effect. What the ``last`` effect competed
    with when it came in is not worked out again.
    """
    known = {last.key: last} if last is not None else {}
    left = request.each(
        "what each adds: refitting without", partial(_without, final, data, known), accepted, lambda one: one.label
    )
    return tuple(
        Rivals(*entry.key, ())
        if isinstance(without, Failure)
        else _rivals_of(entry, final, without, data, request, known.get(entry.key))
        for entry, without in zip(accepted, left, strict=True)
    )


def _rivals_of(
    entry: Accepted, final: Judged, without: Judged, data: Data, request: Request, last: Tried | None
) -> Rivals:
    """Ambiguity of one accepted effect: its rivals, put in its place in the model without it."""
    known = {} if last is None else {trial.probe.candidate.key: trial for trial in last.trials}
    if last is not None:
        probes = [one for one in last.probes if _could_do(last.without.model, entry, one.candidate)]
    else:
        offered = candidates(without.model, data.training, without.fit.residual, request.effects)
        screened = request.each(
            "what else would do: screening",
            partial(probe, without.baseline, data.training),
            [one for one in offered if _could_do(without.model, entry, one)],
            lambda one: f"{one.label} for {entry.label}",
            screening_effort,
        )
        probes = [one for one in screened if isinstance(one, Probe)]
    listed = _short_list(final, without, probes)
    trials = request.each(
        "what else would do: refitting",
        partial(confirm, without, data),
        [one for one in listed if one.candidate.key not in known],
        lambda one: f"{one.candidate.label} for {entry.label}",
        refit_effort,
    )
    tried = [known[one.candidate.key] for one in listed if one.candidate.key in known]
    tried += [trial for trial in trials if isinstance(trial, Trial)]
    good = tuple(trial for trial in tried if as_good(final, trial, data))
    return Rivals(*entry.key, good, without)


def _without(final: Judged, data: Data, known: Mapping[Key, Tried], entry: Accepted) -> Judged:
    """Model without one accepted effect, all else fitted again; ambiguity is judged on it.

    Efforts that follow at once are linear in sizes, and nearly so in all else: one step does.
    """
    if entry.key in known:
        return known[entry.key].without
    model = final.model.without_effect(*entry.key)
    free, bounds = final.kept_in(model)
    return judge(model, free, data, bounds, linear_only=answers_at_once(final.model))


def _could_do(model: Model, entry: Accepted, candidate: Candidate) -> bool:
    """Whether a candidate acts near enough to an accepted effect to make it ambiguous.

    A motion of its own is no rival of friction that does most of the work at its joint: no swing takes energy alike.
    """
    heavier = bool(candidate.effect.motion) and not entry.effect.motion
    rubs = entry.effect.usual == "friction" and entry.trial.there.relative >= CLEAR_GAIN
    return _near(model, candidate, entry) and not (heavier and (rubs or bends(model)))


def _short_list(final: Judged, without: Judged, probes: Sequence[Probe]) -> list[Probe]:
    """Short list of ambiguous rivals to refit: those of the largest predicted gains per number."""
    whole = power(without.fit.residual)
    least = LEAST_SHARE * (whole - power(final.fit.residual))
    good = [p for p in probes if p.free and not impossible_values(p) and p.drop * whole >= least]
    return sorted(good, key=lambda p: -p.score)[:RIVALS_TRIED]


def _near(model: Model, candidate: Candidate, entry: Accepted) -> bool:
    """Whether a rival acts on the joint of an effect, or is confusable with it, so that it is ambiguous.

    What has no motion of its own and acts at another joint alone changes no effort at this one.
    """
    name, site = entry.key
    if candidate.key == (name, site):
        return False
    here, there = joint_at(model, site), joint_at(model, candidate.site)
    if here and there and here != there and not (candidate.effect.motion or entry.effect.motion):
        return False
    own = entry.trial.probe.candidate.effect
    return candidate.site == site or candidate.effect.name in own.confused_with or candidate.effect.site == "actuator"


def as_good(final: Judged, trial: Trial, data: Data) -> bool:
    """Whether an effect is ambiguous: a rival in its place predicts the validation data as well."""
    if not trial.clear:
        return False
    change = gain(final.validation, trial.judged.validation, segments(data.validation)).relative
    return change > -CLEARLY


def in_order(found: Search, known: Sequence[Rivals]) -> tuple[Search, tuple[Rivals, ...]]:
    """Accepted effects and their rivals, ordered by what each effect adds to validation beside all others.

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
    """Whether a parameter of an ambiguous effect was held for another one, so that their order is given."""
    return bool({alias.partner for alias in entry.trial.held} & set(other.trial.parameters))
