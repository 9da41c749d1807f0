"""Ambiguity: rival effects that predict the validation records as well as an accepted effect."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

from vpm.discrepancy.confirmation.confirmation import Data, Judged, Trial, confirm, judge
from vpm.discrepancy.diagnosis import Ambiguity
from vpm.discrepancy.parallel_candidates import Failure
from vpm.discrepancy.screening.candidates import Candidate, Key, candidates, joint_at
from vpm.discrepancy.screening.probe import Probe, impossible_values, probe, refit_effort, screening_effort
from vpm.discrepancy.search.candidate_choice import Accepted
from vpm.discrepancy.search.search import Tried
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
    tried: tuple[Trial, ...] = ()  #: All that were refitted in its place.
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
    each = request.each
    known = {last.key: last} if last is not None else {}
    left = each("what each adds: refitting without", partial(_without, final, data, known), accepted, _label)
    bases = [None if isinstance(one, Failure) else one for one in left]
    jobs = [
        _Job(entry, without, candidate)
        for entry, without in zip(accepted, bases, strict=True)
        if without is not None and entry.key not in known
        for candidate in _others(without, data, entry, request.effects)
    ]
    probes = each(
        "what else would do: screening",
        lambda job: probe(job.base.baseline, data.training, job.candidate),
        jobs,
        lambda job: job.label,
        lambda job: screening_effort(job.candidate),
    )
    seen = [(job.entry, p) for job, p in zip(jobs, probes, strict=True) if isinstance(p, Probe)]
    if last is not None:
        seen += [(e, p) for e in accepted if e.key == last.key for p in _beside(last, e)]
    refits, tried = [], list[tuple[Accepted, Trial]]()
    for entry, without in zip(accepted, bases, strict=True):
        done = {t.probe.candidate.key: t for t in known[entry.key].trials} if entry.key in known else {}
        for p in _short_list(final, without, [p for owner, p in seen if owner is entry]):
            if p.candidate.key in done:
                tried.append((entry, done[p.candidate.key]))
            elif without is not None:
                refits.append((_Job(entry, without, p.candidate), p))
    trials = each(
        "what else would do: refitting",
        lambda job: confirm(job[0].base, data, job[1]),
        refits,
        lambda job: job[0].label,
        lambda job: refit_effort(job[1]),
    )
    tried += [(job.entry, t) for (job, _), t in zip(refits, trials, strict=True) if isinstance(t, Trial)]
    found = []
    for entry, without in zip(accepted, bases, strict=True):
        mine = tuple(t for owner, t in tried if owner is entry)
        found.append(Rivals(*entry.key, tuple(t for t in mine if as_good(final, t, data)), mine, without))
    return tuple(found)


@dataclass(frozen=True)
class _Job:
    """Screening job for rivals: a candidate for the place of an accepted effect, and the model without that effect."""

    entry: Accepted
    base: Judged
    candidate: Candidate

    @property
    def label(self) -> str:
        """Label of a rival's screening for ambiguity in progress reports."""
        return f"{self.candidate.label} for {_label(self.entry)}"


def _label(entry: Accepted) -> str:
    return entry.trial.probe.candidate.label


def _beside(last: Tried, entry: Accepted) -> list[Probe]:
    """Probes for ambiguity from the round in which an effect came in."""
    return [p for p in last.probes if _could_do(last.without.model, entry, p.candidate)]


def _without(final: Judged, data: Data, known: Mapping[Key, Tried], entry: Accepted) -> Judged:
    """Model without one accepted effect, all else fitted again; ambiguity is judged on it.

    Efforts that follow at once are linear in sizes, and nearly so in all else: one step does.
    """
    if entry.key in known:
        return known[entry.key].without
    model = final.model.without_effect(*entry.key)
    free, bounds = final.kept_in(model)
    return judge(model, free, data, bounds, linear_only=answers_at_once(final.model))


def _others(without: Judged, data: Data, entry: Accepted, effects: Sequence[str] | None) -> list[Candidate]:
    """Possible rivals of an accepted effect among all candidates, for its ambiguity."""
    offered = candidates(without.model, data.training, without.fit.residual, effects)
    return [c for c in offered if _could_do(without.model, entry, c)]


def _could_do(model: Model, entry: Accepted, candidate: Candidate) -> bool:
    """Whether a candidate acts near enough to an accepted effect to make it ambiguous.

    A motion of its own is no rival of friction that does most of the work at its joint: no swing takes energy alike.
    """
    heavier = bool(candidate.effect.motion) and not entry.effect.motion
    rubs = entry.effect.usual == "friction" and entry.trial.there.relative >= CLEAR_GAIN
    return _near(model, candidate, entry) and not (heavier and (rubs or bends(model)))


def _short_list(final: Judged, without: Judged | None, probes: Sequence[Probe]) -> list[Probe]:
    """Short list of ambiguous rivals to refit: those of the largest predicted gains per number."""
    if without is None:
        return []
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
