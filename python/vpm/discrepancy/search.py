"""Search: screen every candidate, refit the most promising, accept at most one, drop what is not needed any more."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from vpm.catalogue import EFFECTS
from vpm.discrepancy.candidates import Candidate, Key, candidates, left_out
from vpm.discrepancy.confirmation import Data, Judged, Trial, confirm, judge
from vpm.discrepancy.diagnosis import Ambiguity, RankedCandidate, RefusedEffect
from vpm.discrepancy.driven import compare_driven
from vpm.discrepancy.motion_only import LATE
from vpm.discrepancy.refusal import (
    LEAST_GAIN,
    NORMAL_95_ONE_SIDED,
    Thresholds,
    refuse_probe,
    refuse_timing,
    refuse_trial,
)
from vpm.discrepancy.ringing import NOISE_ONLY, noise_alone, only_ringing
from vpm.discrepancy.screening import Probe, prepare, probe
from vpm.discrepancy.side_by_side import Failure, SideBySide
from vpm.discrepancy.structural import coupled
from vpm.discrepancy.structure import structure
from vpm.discrepancy.timing import InTime, in_time
from vpm.errors import DivergedError, ModelError
from vpm.identify import gain, segments
from vpm.identify.along import bends
from vpm.identify.tangent import has_tangent

#: Candidates refitted in one round: those that promise most for their numbers, and those that promise most of all.
#: Without the latter, several names of one regressor, as a constant force and a tilted world, crowd out a law of two
#: numbers that takes more than any of them.
SHORT_LIST, RICHEST = 7, 2
#: An instrument is blamed for what the machine may have done only if it leaves less than this share of the gap.
SENSOR_SHARE = 0.25

#: Effects that add a motion nobody measures, which has to be simulated for every probe.
HEAVY = ("joint_compliance", "backlash", "link_flexibility")
#: What leaves up to so many times as much as the best explains the data as well, if it is also little of the whole gap.
SAME = 1.5
#: Difference of two logarithms of evidence that says nothing.
TIE = 0.01
#: Share by which what screening promises of two candidates may differ by rounding alone.
TWIN = 1e-6
#: Factor by which the last fit may exceed the bound of a transition velocity.
MORE_ROOM = 3.0
#: Where links bend already, the noise of the measured motion rings in them: a spring more has to promise this share of
#: the residual, and only the best is refitted.
RINGING, FEW = 0.2, 1
#: A refinement leaves less than this share of the mean square that the plainer effect leaves.
REFINED = 0.5

#: Called with a sentence on what is being done.
Tell = Callable[[str], None]


@dataclass(frozen=True)
class Accepted:
    """An effect that came in, the trial that let it in, and those that would have done as well."""

    trial: Trial
    rivals: tuple[str, ...]

    @property
    def key(self) -> Key:
        """Effect and site."""
        return self.trial.probe.candidate.key


@dataclass(frozen=True)
class Stage:
    """The model at one point of the search; ``change`` is "recalibrated", "added" or "removed"."""

    change: str
    effect: str
    site: str
    judged: Judged


@dataclass(frozen=True)
class Search:
    """Outcome of the whole search, or of what was done of it when Ctrl-C was pressed."""

    stages: tuple[Stage, ...]
    accepted: tuple[Accepted, ...]
    refused: tuple[RefusedEffect, ...]
    ranking: tuple[RankedCandidate, ...]
    interrupted: bool = False

    @property
    def final(self) -> Judged:
        """The model that came out."""
        return self.stages[-1].judged


def search(
    start: Judged, data: Data, effects: Sequence[str] | None, limit: int, tell: Tell, each: SideBySide
) -> Search:
    """Add effects one at a time, and drop earlier ones that later ones replace, until none is believed any more."""
    stages = [Stage("recalibrated", "", "", start)]
    accepted: list[Accepted] = []
    ranking: list[RankedCandidate] = []
    dropped: dict[Key, str] = {}
    refused: dict[Key, str] = {}
    interrupted = start.fit.interrupted
    for number in range(1, 0 if interrupted else 2 * limit + 2):
        outcome = _Round(stages[-1].judged, data, number, tell, each)
        best = None
        try:
            if len(accepted) < limit and not (accepted and outcome.done()):
                best = outcome.light(effects, set(dropped)) or outcome.heavy(effects, set(dropped))
        except KeyboardInterrupt:
            interrupted = True
        ranking += outcome.ranked()
        refused = outcome.refused
        if best is None:
            break
        if has_tangent(best.trial.judged.model, data.training):
            best = _settled(best, data)
        accepted.append(best)
        stages.append(Stage("added", *best.key, best.trial.judged))
        tell(f"round {number}: accepted {best.trial.probe.candidate.label}")
        if best.trial.judged.fit.interrupted:
            interrupted = True
            break
        try:
            _drop_replaced(stages, accepted, data, dropped)
        except KeyboardInterrupt:
            interrupted = True
            break
    if not interrupted:
        stages[-1] = replace(stages[-1], judged=_without_tight_bounds(stages[-1].judged, data))
    listed = _listed({**dropped, **refused})
    return Search(tuple(stages), tuple(accepted), listed, tuple(ranking), interrupted)


def _settled(best: Accepted, data: Data) -> Accepted:
    """What was fitted on a tangent, fitted to the end: the next round starts from it."""
    judged = best.trial.judged
    try:
        exact = judge(judged.model, judged.free, data, dict(judged.bounds))
    except DivergedError:
        return best
    return replace(best, trial=replace(best.trial, judged=exact))


class _Round:
    """One round of the search."""

    def __init__(self, current: Judged, data: Data, number: int, tell: Tell, each: SideBySide) -> None:
        self.current, self.data, self.number, self.tell, self.each = current, data, number, tell, each
        self.refused: dict[Key, str] = {}
        self._ranking: dict[Key, RankedCandidate] = {}
        self._promising: list[Probe] = []
        self._believed: list[Trial] = []

    def done(self) -> bool:
        """Whether what is left is noise alone, as far as links that bend make it ring."""
        return noise_alone(self.current.model, self.data, self.timed.unseen)

    def light(self, effects: Sequence[str] | None, without: set[Key]) -> Accepted | None:
        """The best of the candidates whose regressor follows from the measured motion alone."""
        self.screen(effects, without, heavy=False)
        self.confirm()
        return self.best()

    def heavy(self, effects: Sequence[str] | None, without: set[Key]) -> Accepted | None:
        """The best of those with a motion of their own, tried only where more than noise is left to explain."""
        left = structure(self.current.model, self.data.training, self.data.unseen, self.timed.fitted, self.timed.unseen)
        if not left.present and left.coloured <= NOISE_ONLY:
            return None
        if self.done():
            return None
        self._promising = []
        self.screen(effects, without, heavy=True)
        self.confirm()
        return self.best()

    def screen(self, effects: Sequence[str] | None, without: set[Key], *, heavy: bool) -> None:
        """Probe every candidate and set aside those that cannot be."""
        current, data = self.current, self.data
        found = candidates(current.model, data.training, current.fit.residual, effects)
        self.refused.update(left_out(current.model, data.training, effects))
        listed = [c for c in found if c.key not in without and self._is_heavy(c) == heavy]
        self.tell(f"round {self.number}: screening {len(listed)} candidates")
        screen = partial(probe, prepare(current.baseline, data.training, listed), data.training)
        results = self.each(f"round {self.number}: screening", screen, listed, lambda c: c.label)
        for candidate, result in zip(listed, results, strict=True):
            key = candidate.key
            if isinstance(result, Failure):
                self._ranking[key] = RankedCandidate(*key, self.number, 0.0, float("nan"), accepted=False)
                self.refused[key] = result.reason
                continue
            self._ranking[key] = RankedCandidate(*key, self.number, result.drop, float("nan"), accepted=False)
            if reason := refuse_probe(result):
                self.refused[key] = reason
            else:
                self._promising.append(result)
        self._promising.sort(key=lambda p: -p.score)
        if heavy and bends(current.model):
            for one in self._promising:
                if one.drop < RINGING:
                    self.refused[one.candidate.key] = (
                        f"it would lower the training error by {100.0 * one.drop:.2g} % of its mean square, which "
                        "links that ring along a noisy motion leave as well"
                    )
            self._promising = [one for one in self._promising if one.drop >= RINGING][:FEW]

    def _is_heavy(self, candidate: Candidate) -> bool:
        """Whether it adds a motion that nobody measures; where the log holds that motion, it is evidence like any.

        So is the bending of a rigid beam beside others that bend: light effects would only imitate it.
        """
        model, name = self.current.model, candidate.effect.name
        if bends(model) and name == "link_flexibility" and candidate.site in model.beams:
            return False
        logged = {f"{candidate.site}_{suffix}.position" for suffix in ("bending", "deflection")}
        return name in HEAVY and not logged & set(self.data.training.shown)

    def confirm(self) -> None:
        """Refit with the most promising ones and judge them on unseen data."""
        short_list = _short_list(self._promising)
        if short_list:
            self.tell(f"round {self.number}: refitting with {', '.join(p.candidate.label for p in short_list)}")
        twins = _twins(short_list)
        self._refit([one for one in short_list if one.candidate.key not in twins])
        believed = {trial.probe.candidate.key for trial in self._believed}
        again = [one for one in short_list if twins.get(one.candidate.key) in believed]
        self._refit(again)
        for one in short_list:
            key = one.candidate.key
            if key in twins and one not in again:
                effect, site = twins[key]
                self.refused[key] = f"it is {effect} at {site} by another name here: {self.refused[twins[key]]}"
        tried = {one.candidate.key for one in short_list}
        for key in (p.candidate.key for p in self._promising if p.candidate.key not in tried):
            self.refused[key] = (
                f"{SHORT_LIST} candidates explain more of the training residual, and none of them was enough"
            )

    def _refit(self, short_list: Sequence[Probe]) -> None:
        """Refit with each of some candidates, and believe or refuse it."""
        tried = len(self._ranking) * self.number
        thresholds = Thresholds(tried, min(m.dt for m in self.data.training.motions))
        refit = partial(confirm, self.current, self.data)
        trials = self.each(f"round {self.number}: refitting", refit, short_list, lambda p: p.candidate.label)
        for tried_one, trial in zip(short_list, trials, strict=True):
            key = tried_one.candidate.key
            if isinstance(trial, Failure):
                self.refused[key] = trial.reason
                continue
            self._ranking[key] = replace(self._ranking[key], unseen=trial.unseen.relative)
            if reason := self._refused(trial, thresholds):
                self.refused[key] = reason
            else:
                self._believed.append(trial)

    @cached_property
    def timed(self) -> InTime:
        """Residuals of the model at hand with what the times of samples leave open."""
        return in_time(self.current, self.data)

    def _refused(self, trial: Trial, thresholds: Thresholds) -> str:
        """Why a trial is not believed, or ""."""
        reason = refuse_trial(trial, thresholds) or self._only_timing(trial, thresholds)
        return reason or only_ringing(self.current, self.data, trial)

    def _only_timing(self, trial: Trial, thresholds: Thresholds) -> str:
        """Why a trial that would be believed does no more than a shift of the commands does, or ""."""
        if self.timed.shift == 0.0:
            return ""
        unseen = in_time(trial.judged, self.data).unseen
        timed = gain(self.timed.unseen, unseen, segments(self.data.unseen))
        return refuse_timing(timed, self.timed.shift, thresholds)

    def best(self) -> Accepted | None:
        """The candidate that leaves least for its numbers; of those that are as good, the best simulation.

        One that refines another only takes its place if it leaves less than ``REFINED`` of what that leaves.
        """
        if not self._believed:
            return None
        first = min(self._believed, key=_cost)
        plain = [t for t in self._believed if _plainer(t, first)]
        first = min(plain, key=_cost) if plain else first
        equals = [t for t in self._believed if _as_good(t, first)]
        chosen = self._in_time(_first_named(equals))
        key = chosen.probe.candidate.key
        self._ranking[key] = replace(self._ranking[key], accepted=True)
        return Accepted(chosen, tuple(t.probe.candidate.label for t in equals if t is not chosen))

    def _in_time(self, chosen: Trial) -> Trial:
        """Of delay and lag, where both would do: what the reference tells from the other, else the delay.

        A delay shifts in time; a lag does so too and weakens what is fast, which has to be seen.
        """
        if chosen.probe.candidate.effect.name not in LATE:
            return chosen
        alike = [
            t for t in self._believed if t.probe.candidate.effect.name in LATE and _left(t) <= SAME * _left(chosen)
        ]
        lags = [t for t in alike if t.probe.candidate.effect.name == LATE[0]]
        delays = [t for t in alike if t not in lags]
        if not lags or not delays:
            return chosen
        lag, delay = min(lags, key=_evidence), min(delays, key=_evidence)
        told = compare_driven(lag.judged, delay.judged, self.data)
        if told is None:
            return chosen
        return lag if told.prefers_first else delay

    def ranked(self) -> list[RankedCandidate]:
        """Candidates of this round: what was accepted, what helped on unseen data, then by what screening promises."""
        return sorted(self._ranking.values(), key=_promise)


def _twins(short_list: Sequence[Probe]) -> dict[Key, Key]:
    """Candidates with a motion of their own that are an earlier one by another name, with that one.

    A rigid link that bends at its root is a drive that winds up: no digit of what screening says parts the two. Refits
    of such machines take long, so that one of each pair has to be enough where it is refused.
    """
    found: dict[Key, Key] = {}
    for place, one in enumerate(short_list):
        for other in short_list[:place]:
            heavy = {one.candidate.effect.name, other.candidate.effect.name} == {"joint_compliance", "link_flexibility"}
            same = len(one.free) == len(other.free) and abs(one.drop - other.drop) <= TWIN * abs(other.drop)
            if heavy and same and other.candidate.key not in found:
                found[one.candidate.key] = other.candidate.key
    return found


def _short_list(promising: Sequence[Probe]) -> list[Probe]:
    """What is refitted, of probes by falling score."""
    richest = {p.candidate.key for p in sorted(promising, key=lambda p: -p.drop)[:RICHEST]}
    return [p for rank, p in enumerate(promising) if rank < SHORT_LIST or p.candidate.key in richest]


def _promise(candidate: RankedCandidate) -> tuple[int, float]:
    """Sorts a ranking."""
    if candidate.accepted:
        return 0, 0.0
    if candidate.unseen > 0.0:
        return 1, -candidate.unseen
    return 2, -candidate.screened


def _left(trial: Trial) -> float:
    """Share of the unseen mean square that a trial leaves."""
    return max(1.0 - trial.unseen.relative, 1e-12)


def _cost(trial: Trial) -> float:
    """Information criterion of G. Schwarz (*Annals of Statistics* 6, 1978) per independent piece of the unseen data."""
    pieces = max(trial.unseen.pieces, 3)
    return float(np.log(_left(trial)) + len(trial.parameters) * np.log(pieces) / pieces)


def _plainer(trial: Trial, first: Trial) -> bool:
    """Whether a trial says in fewer numbers nearly what ``first`` says, at the same site and confusable with it."""
    mine, other = trial.probe.candidate, first.probe.candidate
    alike = other.effect.name in mine.effect.confused_with or mine.effect.name in other.effect.confused_with
    fewer = len(trial.parameters) < len(first.parameters)
    return mine.site == other.site and alike and fewer and REFINED * _left(trial) <= _left(first)


def _as_good(trial: Trial, first: Trial) -> bool:
    """Whether a trial explains the unseen data as the first one does, with no more numbers."""
    close = trial.unseen.relative >= first.unseen.relative - LEAST_GAIN and _left(trial) <= SAME * _left(first)
    return close and len(trial.parameters) <= len(first.parameters)


def _evidence(trial: Trial) -> float:
    """Logarithm of what is left of the gap in both views; the machine is blamed before its instruments."""
    left = np.log(max(trial.unseen.after, 1e-300) / trial.unseen.before)
    if trial.probe.candidate.effect.site == "sensor":
        left -= np.log(SENSOR_SHARE)
    # Errors of coupled joints cancel; see refusal.CLEAR_GAIN.
    if trial.simulated is not None and trial.simulated.before > 0.0 and not coupled(trial.judged.model):
        left += np.log(max(trial.simulated.after, 1e-300) / trial.simulated.before)
    return float(left)


def _drop_replaced(stages: list[Stage], accepted: list[Accepted], data: Data, dropped: dict[Key, str]) -> None:
    """Backward elimination: drop every earlier effect without which the model predicts the unseen data as well.

    Where a parameter of a later effect was held because the data show it only together with one of the earlier effect,
    it is set free for the trial: a spring whose rest was held beside a constant force needs that force no more if it
    may rest elsewhere. One name for what two would say is the shorter answer. A size that was held is another force
    under another name, as a difference of dry friction is a constant one in motion: the first one named stays.
    """
    newest = accepted[-1]
    for entry in accepted[:-1]:
        current = stages[-1].judged
        own = set(entry.trial.parameters)
        freed = {alias.parameter for other in accepted for alias in other.trial.held if alias.partner in own}
        if any(current.model.parameters[name].kind == "linear" for name in freed):
            continue
        try:
            model = current.model.without_effect(*entry.key)
            known = tuple(name for name in current.free if name in model.parameters)
            free = (*known, *sorted(name for name in freed - set(known) if name in model.parameters))
            bounds = {name: pair for name, pair in current.bounds.items() if name in free}
            reduced = judge(model, free, data, bounds)
        except (DivergedError, ModelError):
            continue  # without it the model cannot follow the unseen data at all, or another effect cannot stand
        loss = gain(reduced.unseen, current.unseen, segments(data.unseen))
        if loss.relative < LEAST_GAIN:
            accepted.remove(entry)
            accepted[:] = [_released(other, freed) for other in accepted]
            stages.append(Stage("removed", *entry.key, reduced))
            dropped[entry.key] = f"it is not needed any more beside {newest.trial.probe.candidate.label}"


def _first_named(equals: Sequence[Trial]) -> Trial:
    """The trial with the best evidence; of several that no digit of the data parts, the first in the catalogue.

    On a single link a drive that winds up and a link that bends at its root are one and the same model, and rounding
    would decide.
    """
    best = min(map(_evidence, equals))
    tied = [t for t in equals if _evidence(t) <= best + TIE]
    return min(tied, key=lambda t: list(EFFECTS).index(t.probe.candidate.effect.name))


def _without_tight_bounds(final: Judged, data: Data) -> Judged:
    """The same model fitted with more room where a transition velocity stands at its upper bound.

    The bound keeps dry friction apart from viscous friction while candidates compete; once the names stand, it need not
    cut the fit short. The training records decide, and the unseen ones may not be predicted worse for it.
    """
    bounds = dict(final.bounds)
    for name, (low, high) in final.bounds.items():
        shape = name.endswith("transition_velocity") and name in final.free
        if shape and final.model.parameters[name].value > 0.999 * high:
            bounds[name] = low, MORE_ROOM * high
    if bounds == final.bounds:
        return final
    try:
        refitted = judge(final.model, final.free, data, bounds)
    except DivergedError:
        return final
    better = gain(final.fit.residual, refitted.fit.residual, segments(data.training)).relative > LEAST_GAIN
    kept = gain(final.unseen, refitted.unseen, segments(data.unseen)).harm <= NORMAL_95_ONE_SIDED
    return refitted if better and kept else final


def _released(entry: Accepted, freed: set[str]) -> Accepted:
    """An accepted effect of which parameters that were held are fitted now."""
    trial = entry.trial
    mine = tuple(alias.parameter for alias in trial.held if alias.parameter in freed)
    if not mine:
        return entry
    held = tuple(alias for alias in trial.held if alias.parameter not in freed)
    return replace(entry, trial=replace(trial, held=held, parameters=(*trial.parameters, *mine)))


def _listed(refused: dict[Key, str]) -> tuple[RefusedEffect, ...]:
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
