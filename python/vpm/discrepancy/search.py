"""Greedy search: screen every candidate, refit the most promising, accept at most one, and begin again."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeVar

from vpm.discrepancy.candidates import candidates
from vpm.discrepancy.confirmation import Data, Judged, Trial, confirm
from vpm.discrepancy.diagnosis import Ambiguity, RankedCandidate, RefusedEffect
from vpm.discrepancy.refusal import Thresholds, refuse_probe, refuse_trial
from vpm.discrepancy.screening import Probe, probe
from vpm.identify import gain, segments

#: Candidates refitted in one round.
SHORT_LIST = 6
#: Another candidate is as good as the accepted one if it reaches this share of its gain.
TIE_SHARE = 0.9

Item = TypeVar("Item")
Outcome = TypeVar("Outcome")

#: Called with a sentence on what is being done.
Tell = Callable[[str], None]


@dataclass(frozen=True)
class Accepted:
    """An effect that came in, and the trial that let it in."""

    trial: Trial
    rivals: tuple[str, ...]


@dataclass(frozen=True)
class Round:
    """One round of the search: what was tried, what came in, and why the rest did not."""

    accepted: Accepted | None
    refused: tuple[RefusedEffect, ...]
    ranking: tuple[RankedCandidate, ...]


@dataclass(frozen=True)
class Search:
    """Outcome of the whole search."""

    final: Judged
    stages: tuple[Judged, ...]
    accepted: tuple[Accepted, ...]
    refused: tuple[RefusedEffect, ...]
    ranking: tuple[RankedCandidate, ...]


def search(start: Judged, data: Data, effects: Sequence[str] | None, limit: int, tell: Tell) -> Search:
    """Add effects one at a time until none is believed any more."""
    current, stages = start, [start]
    accepted: list[Accepted] = []
    rounds: list[Round] = []
    while True:
        last = len(accepted) == limit
        outcome = _round(current, data, effects, len(rounds) + 1, tell, look_only=last)
        rounds.append(outcome)
        if outcome.accepted is None:
            break
        accepted.append(outcome.accepted)
        current = outcome.accepted.trial.judged
        stages.append(current)
    ranking = tuple(entry for outcome in rounds for entry in outcome.ranking)
    return Search(current, tuple(stages), tuple(accepted), rounds[-1].refused, ranking)


def _round(
    current: Judged, data: Data, effects: Sequence[str] | None, number: int, tell: Tell, *, look_only: bool
) -> Round:
    listed = candidates(current.model, data.training, current.fit.residual, effects)
    thresholds = Thresholds(len(listed) * number, min(m.dt for m in data.training.motions))
    refused: dict[tuple[str, str], str] = {}
    promising: list[Probe] = []
    base = current.baseline
    ranking: dict[tuple[str, str], RankedCandidate] = {}
    tell(f"round {number}: screening {len(listed)} candidates")
    for candidate, result in zip(listed, _side_by_side(partial(probe, base, data.training), listed), strict=True):
        key = (candidate.effect.name, candidate.site)
        ranking[key] = RankedCandidate(*key, number, result.drop, float("nan"), accepted=False)
        if reason := refuse_probe(result):
            refused[key] = reason
        else:
            promising.append(result)
    promising.sort(key=lambda p: -p.score)
    short_list = promising[:SHORT_LIST]
    if short_list:
        tell(f"round {number}: refitting with {', '.join(p.candidate.label for p in short_list)}")
    trials = _side_by_side(partial(confirm, current, data), short_list)
    for trial in trials:
        key = (trial.probe.candidate.effect.name, trial.probe.candidate.site)
        ranking[key] = replace(ranking[key], unseen=trial.unseen.relative)
        if reason := refuse_trial(trial, thresholds):
            refused[key] = reason
    for result in promising[SHORT_LIST:]:
        key = (result.candidate.effect.name, result.candidate.site)
        refused[key] = f"{SHORT_LIST} candidates explain more of the training residual, and none of them was enough"
    believed = [t for t in trials if (t.probe.candidate.effect.name, t.probe.candidate.site) not in refused]
    order = tuple(sorted(ranking.values(), key=lambda c: -c.screened))
    if not believed or look_only:
        return Round(None, _listed(refused), order)
    best = max(believed, key=lambda t: t.score)
    key = (best.probe.candidate.effect.name, best.probe.candidate.site)
    order = tuple(replace(c, accepted=True) if (c.name, c.site) == key else c for c in order)
    tell(f"round {number}: accepted {best.probe.candidate.label}")
    return Round(Accepted(best, _rivals(best, believed, data)), _listed(refused), order)


def _side_by_side(work: Callable[[Item], Outcome], items: Sequence[Item]) -> list[Outcome]:
    """Results in the order of the items; the core lets go of the interpreter, so threads use all processors."""
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(work, items))


def _rivals(best: Trial, believed: Sequence[Trial], data: Data) -> tuple[str, ...]:
    """Believed candidates whose prediction of the unseen data is as good, within its uncertainty."""
    tied = []
    for other in believed:
        if other is best or other.unseen.relative < TIE_SHARE * best.unseen.relative:
            continue
        difference = gain(other.judged.unseen, best.judged.unseen, segments(data.unseen))
        if abs(difference.score) < 2.0 and len(other.parameters) <= len(best.parameters):
            tied.append(other.probe.candidate.label)
    return tuple(tied)


def _listed(refused: dict[tuple[str, str], str]) -> tuple[RefusedEffect, ...]:
    return tuple(RefusedEffect(name, site, reason) for (name, site), reason in refused.items())


def ambiguities(accepted: Sequence[Accepted]) -> tuple[Ambiguity, ...]:
    """What the data cannot tell from each accepted effect: rivals in its round, and parameters held for its sake."""
    found = []
    for entry in accepted:
        candidate = entry.trial.probe.candidate
        if entry.rivals:
            reason = "they predict the unseen data equally well"
            found.append(Ambiguity(candidate.effect.name, candidate.site, entry.rivals, reason))
        for alias in entry.trial.held:
            reason = f"{alias.parameter} was held at its start: these data show it only together with {alias.partner}"
            found.append(Ambiguity(candidate.effect.name, candidate.site, (alias.partner,), reason))
    return tuple(found)
