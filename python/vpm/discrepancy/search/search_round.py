"""Round of the search: screen every candidate, refit with the most promising, accept or refuse each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from vpm.catalogue import EFFECTS
from vpm.discrepancy.confirmation.confirmation import Data, InTime, Judged, Trial, confirm, finished, gain_at, in_time
from vpm.discrepancy.confirmation.refusal import Thresholds, explains_most, refuse_probe, refuse_timing, refuse_trial
from vpm.discrepancy.diagnosis import RankedCandidate
from vpm.discrepancy.noise.noise_floor import noise_alone, only_ringing, structure
from vpm.discrepancy.parallel_candidates import Failure, ParallelCandidates
from vpm.discrepancy.screening.candidates import Candidate, Key, candidates, left_out
from vpm.discrepancy.screening.probe import (
    Probe,
    most_promising,
    prepare,
    probe,
    refit_effort,
    screening_effort,
)
from vpm.discrepancy.search.candidate_choice import Accepted, choose
from vpm.discrepancy.settings import CLEAR_GAIN, FEW, FLOOR_FACTOR, RINGING, SHORT_LIST, SLIGHT
from vpm.identify import gain, gaps, segments
from vpm.identify.response_along_motion import answers_at_once, bends
from vpm.identify.tangent import drives_on_tangent
from vpm.numbers import power

#: Called with a sentence on what is being done.
Tell = Callable[[str], None]


@dataclass(frozen=True)
class Request:
    """Request for names of missing effects: what is tried, who hears of it, and who computes."""

    effects: Sequence[str] | None  #: All that a search tries if None.
    limit: int  #: Most effects to accept.
    tell: Tell
    each: ParallelCandidates
    names: str = "search"  #: Where names come from.


class Round:
    """One round of the search."""

    def __init__(self, current: Judged, data: Data, number: int, request: Request) -> None:
        self.current, self.data, self.number, self.request = current, data, number, request
        self.tell, self.each = request.tell, request.each
        self.refused: dict[Key, str] = {}
        self._ranking: dict[Key, RankedCandidate] = {}
        self._promising: list[Probe] = []
        self._supported: list[Trial] = []
        self.probes: list[Probe] = []
        self.trials: list[Trial] = []

    def done(self) -> bool:
        """Whether a round has nothing to explain: the residual is noise, as far as links ring by it."""
        return noise_alone(self.current.model, self.data, self.timed.validation)

    def light(self, without: set[Key]) -> Accepted | None:
        """Best candidate of the round among those whose regressor needs the measured motion alone."""
        self.screen(without, heavy=False)
        self.confirm()
        return self.best()

    def heavy(self, without: set[Key]) -> Accepted | None:
        """Best candidate of the round among those with a motion of their own, if more than noise is left."""
        model = self.current.model
        left = structure(model, self.data.training, self.data.validation, self.timed.fitted, self.timed.validation)
        quiet = not left.present and left.above_white <= FLOOR_FACTOR
        if quiet or self._leaves_slight() or self.done():
            return None
        self.screen(without, heavy=True)
        self.confirm()
        return self.best()

    def _leaves_slight(self) -> bool:
        """Whether what the round has to explain is less of any channel than laws are wrong by.

        No candidate does more than all of it: each would be refused as slight, for a hidden motion is no exact law.
        """
        left = gaps(self.data.validation, self.current.validation).values()
        return max((share for _, share, _ in left), default=0.0) <= SLIGHT

    def weak(self, best: Accepted) -> bool:
        """Whether the best candidate of the round leaves most of the error, so that a hidden motion is tried too.

        An unmeasured motion shows in the efforts of all joints, in part as several lighter effects would. So an effect
        that explains little has to compete with it. Where links bend already, or drives have states, its probes take
        long, and come after all others.
        """
        tried = any(EFFECTS[name].winds_up for name, _ in self._ranking)
        return best.trial.there.relative < CLEAR_GAIN and not tried and answers_at_once(self.current.model)

    def screen(self, without: set[Key], *, heavy: bool) -> None:
        """Screen all or some candidates of the round, and set aside impossible ones."""
        current, data, effects = self.current, self.data, self.request.effects
        self._promising = []
        found = candidates(current.model, data.training, current.fit.residual, effects)
        self.refused.update(left_out(current.model, effects))
        listed = [c for c in found if c.key not in without and self._is_heavy(c) == heavy]
        self.tell(f"round {self.number}: screening {len(listed)} candidates")
        screen = partial(probe, prepare(current.baseline, data.training, listed), data.training)
        results = self.each(f"round {self.number}: screening", screen, listed, lambda c: c.label, screening_effort)
        for candidate, result in zip(listed, results, strict=True):
            key = candidate.key
            if isinstance(result, Failure):
                self._ranking[key] = RankedCandidate(*key, self.number, 0.0, float("nan"), accepted=False)
                self.refused[key] = result.reason
                continue
            self._ranking[key] = RankedCandidate(*key, self.number, result.drop, float("nan"), accepted=False)
            self.probes.append(result)
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
        """Whether a candidate of the round adds an unmeasured motion, simulated for every probe.

        Where the log holds that motion, it is evidence like any. The same holds for bending of a rigid beam beside
        flexible ones. Light effects would only imitate them.
        """
        model, motion = self.current.model, candidate.effect.motion
        if bends(model) and motion == "bending" and candidate.site in model.beams:
            return False
        logged = {f"{candidate.site}_{suffix}.position" for suffix in ("bending", "deflection")}
        return bool(motion) and not logged & set(self.data.training.shown)

    def confirm(self) -> None:
        """Refit with the most promising candidates of the round and judge them on validation data."""
        short_list = most_promising(self._promising)
        if short_list:
            self.tell(f"round {self.number}: refitting with {', '.join(p.candidate.label for p in short_list)}")
        self._refit(short_list)
        supported = {trial.probe.candidate.key for trial in self._supported}
        if any(EFFECTS[name].late for name, _ in supported):
            # Predicted gains do not discriminate delays, so that all of them compete.
            kin = [one for one in self._promising if one.candidate.effect.late]
            kin = [one for one in kin if one not in short_list]
            self._refit(kin)
            short_list = [*short_list, *kin]
        tried = {one.candidate.key for one in short_list}
        for key in (p.candidate.key for p in self._promising if p.candidate.key not in tried):
            self.refused[key] = (
                f"{SHORT_LIST} candidates explain more of the training residual, and none of them was enough"
            )

    def _refit(self, short_list: Sequence[Probe]) -> None:
        """Refit with each of some candidates of the round, and accept or refuse it."""
        if drives_on_tangent(self.current.model, self.data.training) and len(short_list) > 1:
            # What one of them explains tells which of the others are worth a refit.
            first = max(short_list, key=lambda p: p.drop)
            supported = len(self._supported)
            self._tried([first], np.inf)
            rest = [one for one in short_list if one is not first]
            left = [power(t.judged.fit.residual) for t in self._supported[supported:]]
            self._tried(rest, min(left, default=np.inf))
        else:
            self._tried(short_list, np.inf)

    def _tried(self, short_list: Sequence[Probe], rival: float) -> None:
        """Trials of some candidates of the round side by side; ``rival`` is the residual of another, see `confirm`."""
        thresholds = self.thresholds()
        what = f"round {self.number}: refitting"
        confirmed = partial(confirm, self.current, self.data, rival=rival)
        trials = self.each(what, confirmed, short_list, lambda p: p.candidate.label, refit_effort)
        for tried_one, trial in zip(short_list, trials, strict=True):
            key = tried_one.candidate.key
            if isinstance(trial, Failure):
                self.refused[key] = trial.reason
                continue
            self._ranking[key] = replace(self._ranking[key], unseen=trial.validation.relative)
            self.trials.append(trial)
            if reason := self._refused(trial, thresholds):
                self.refused[key] = reason
            else:
                self._supported.append(trial)

    def thresholds(self) -> Thresholds:
        """Thresholds of the round for an effect when so many have been tried."""
        return Thresholds(len(self._ranking) * self.number, self.data.interval)

    @cached_property
    def timed(self) -> InTime:
        """Residuals of the round's model without the effect of uncertain sample times."""
        return in_time(self.current, self.data)

    def _refused(self, trial: Trial, thresholds: Thresholds) -> str:
        """Reason why a trial of the round is refused, or ""."""
        reason = refuse_trial(trial, thresholds) or self._only_timing(trial, thresholds)
        return reason or only_ringing(self.current, self.data, trial)

    def _only_timing(self, trial: Trial, thresholds: Thresholds) -> str:
        """Why an otherwise accepted trial of the round does no more than shifted commands do, or ""."""
        if self.timed.shift == 0.0 or explains_most(trial):
            return ""
        shifted = in_time(trial.judged, self.data)
        before, validation = self.timed.validation, shifted.validation
        timed = gain(before, validation, segments(self.data.validation))
        if trial.there is trial.here and timed.relative > 0.0:
            site = trial.probe.candidate.site
            timed = gain_at(self.current.model, self.data.validation, site, before, validation) or timed
        return refuse_timing(timed, self.timed.shift, thresholds, beside=shifted.shift)

    def best(self) -> Accepted | None:
        """Candidate that the round accepts, if any; it has to stand when fitted to the end."""
        while self._supported:
            best = choose(self._supported, self.data)
            whole = finished(self.current, self.data, best.trial)
            if whole is best.trial:
                self.mark(best.key)
                return best
            place = next(n for n, trial in enumerate(self._supported) if trial is best.trial)
            if reason := self._refused(whole, self.thresholds()):
                self.refused[best.key] = reason
                del self._supported[place]
            else:
                self._supported[place] = whole
        return None

    def mark(self, accepted: Key) -> None:
        """Mark the accepted candidates in the ranking of the round."""
        for key, entry in self._ranking.items():
            self._ranking[key] = replace(entry, accepted=key == accepted)

    def ranked(self) -> list[RankedCandidate]:
        """Ranked candidates of the round: accepted ones, then by validation gain, then by predicted gain."""
        return sorted(self._ranking.values(), key=_by_gain)


def _by_gain(candidate: RankedCandidate) -> tuple[int, float]:
    """Sort key of the round's ranking: predicted gain."""
    if candidate.accepted:
        return 0, 0.0
    if candidate.unseen > 0.0:
        return 1, -candidate.unseen
    return 2, -candidate.screened
