"""Search of a ranking: structures grow by one effect at a time."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from vpm.catalogue.kinds import Side
from vpm.model import Effect
from vpm.numbers import rough_percent
from vpm.ranking.choice_by_evidence import evidence, likely, weighed
from vpm.ranking.command_timing import against_timing
from vpm.ranking.disturbed_records import disturbed
from vpm.ranking.fit import ASTRAY, Fitted, Fitter, View
from vpm.ranking.judgement import Judgement
from vpm.ranking.load_taken_along import loaded
from vpm.ranking.look import Look
from vpm.ranking.model_structure import Structure
from vpm.ranking.noise_model import fitted_noise
from vpm.ranking.result import Gap, Ranked, Ranking
from vpm.ranking.settings import OFF_ENDS
from vpm.ranking.several_at_once import several_at_once, with_usual_friction
from vpm.ranking.trials import Trials
from vpm.ranking.tried_effect import Trial
from vpm.ranking.validation_errors import gaps
from vpm.simulate.setup import AUTOMATIC

#: Effect, site, and side of a joint that is split.
_Place: TypeAlias = tuple[str, str, Side]
#: What commands do between samples that were read, and not sent.
SMOOTH = ("first_order", "cubic")


class Search(Trials):
    """Search of a ranking over structures that grow by one effect at a time."""

    def run(self) -> Ranking:
        """Run the search of a ranking, see `rank`."""
        looks = self._first_looks()
        named: dict[_Place, Ranked] = {}
        rounds: list[tuple[Ranked, ...]] = []
        interrupted = False
        before: list[frozenset[tuple[str, ...]]] = []
        try:
            looks, rounds = with_usual_friction(self, looks)
            named = {_place(ranked): ranked for ranked, *_ in rounds}
            begun = set(named)
            for _ in range(2 * self.settings.effects):  # effects may replace each other, but not for ever
                present, there = looks[0].fitted.structure.effects, looks[0].fitted.structure.added
                places = frozenset(one.key for one in there)
                if len(present) == self.settings.effects or places in before:
                    break
                best, tried = self._round(looks)
                if smooth := self._held(looks, best):
                    looks = smooth
                    continue
                before.append(places)
                was = looks
                looks, together = several_at_once(self, looks, best, tried)
                best = None if together else best
                rounds += [self.listed(best, tried), *together]
                if best is None and not together:
                    break
                added = together or rounds[-1:]
                named |= {_place(ranked): ranked for ranked, *_ in added}
                if best is not None:
                    looks = [self.look(best.fitted)]  # known, should the next fits be interrupted
                    self.say(f"{best.label} {best.removing}")
                    looks = self.all_looks(looks[0])
                for one in there:
                    looks, several = self._reconsidered(one, looks)
                    if several:
                        rounds.append(several)
                        named[_place(several[0])] = several[0]
                if _is_worse(looks, was):
                    names = " and ".join(ranked.effect for ranked, *_ in added)
                    self.say(f"{names} does not do the work of what it makes needless")
                    looks = was
                    break
                if best is not None and present:
                    looks = self._out_of_a_dead_end(best, looks)
                looks = self._drawn_anew(looks)
            if set(named) - begun:
                looks, rounds = self._plainer(looks, rounds, named)
        except KeyboardInterrupt:
            interrupted = True
        ranking = self._ranking(looks, named, rounds, interrupted=interrupted)
        try:
            return replace(ranking, gaps=self._gaps(ranking))
        except KeyboardInterrupt:
            return replace(ranking, interrupted=True)

    def _first_looks(self) -> list[Look]:
        """Looks of the search at the model as it was, with what is uncertain fitted."""
        self.say("fitting what is uncertain")
        self.draw_pressures(self.start)
        looks = self.looks(self.start)
        self.first = {look.fitted.tracker.band: look for look in looks}
        return looks

    def _drawn_anew(self, looks: list[Look]) -> list[Look]:
        """Looks of the search with pressures as what was found draws them.

        While a leak was missing readings told pressures better than the model did, however much noise they pass on.
        """
        fitted = self.draw_pressures(looks[0].fitted.structure)
        if fitted is None:
            return looks
        self.first = {look.fitted.tracker.band: look for look in self.looks(self.start)}
        return self.all_looks(self.look(fitted))

    def _plainer(
        self, looks: list[Look], rounds: list[tuple[Ranked, ...]], named: dict[_Place, Ranked]
    ) -> tuple[list[Look], list[tuple[Ranked, ...]]]:
        """Search with one effect in the place of all, if that is more probable by the records and the model file.

        Known parameters go astray to make up for what is missing. Effects may then lead on from there, where a single
        one with what the file states explains all of it. One effect stands where its values leave the file in peace.
        """
        if len(looks[0].fitted.structure.effects) < 2 and self._are_by_the_file(looks):
            return looks, rounds
        with contextlib.suppress(*ASTRAY):
            bare = [one for one in self.first.values() if one.fitted.tracker == looks[0].fitted.tracker]
            best, tried = self._best(bare, [self._as_stated(look) for look in bare], looks[0].fitted)
            if best is not None and self._is_plainer(best, looks):
                self.say(f"{best.label} from what the file states does as well alone")
                rounds = [*rounds, self.listed(best, tried)]
                named[_place(rounds[-1][0])] = rounds[-1][0]
                return self.all_looks(self.look(best.fitted)), rounds
        return looks, rounds

    def _is_plainer(self, best: Trial, looks: Sequence[Look]) -> bool:
        """Whether one effect of a search is more probable than several under its tracker."""
        there = (look.fitted for look in looks if look.fitted.tracker == best.fitted.tracker)
        return any(self.advantage(best.fitted, one) > 0.0 for one in there)

    def _as_stated(self, look: Look) -> Look:
        """Look of the search at what the model file states, under the tracker of another one."""
        return self.look(self.fitter.unfitted(self.start, look.fitted.tracker))

    def _ranking(
        self,
        looks: Sequence[Look],
        named: Mapping[_Place, Ranked],
        rounds: list[tuple[Ranked, ...]],
        *,
        interrupted: bool,
    ) -> Ranking:
        """Ranking of a search, with the values under the tracker by which all of them predict the records best."""
        best = max(looks, key=lambda look: self._foresight(look.fitted.structure, looks))
        fits = best.fitted, self._first(best.fitted.structure)
        as_fitted = interrupted or best.fitted.structure.added
        found, first = (one.structure if as_fitted else self._likeliest(one) for one in fits)
        hold = self.fitter.tracked.setup.course
        effects = tuple(_named(named, one, found.values) for one in found.added)
        return Ranking(effects, tuple(rounds), found.repaired, first.repaired, {}, interrupted, hold, self._notes(best))

    def _first(self, found: Structure) -> Fitted:
        """First fit of the search; where it found a load, one with bodies as the model file states them.

        What values far from the file do in the place of a load is no calibration.
        """
        first, bodies = next(iter(self.first.values())).fitted, self.start.model.bodies
        kept = {name: one for name, one in self.start.priors.items() if name.partition(".")[0] not in bodies}
        far = first.structure.doubt_of(self.start.priors.keys() - kept.keys()) > self.settings.odds
        if far and any(one.type.is_load for one in found.added):
            with contextlib.suppress(*ASTRAY):
                return self.fitted(replace(self.start, priors=kept), first.tracker)
        return first

    def _likeliest(self, fitted: Fitted) -> Structure:
        """Structure of a search that names nothing at its most likely values, under the noise that it leaves.

        Errors last longer than a sample. A fit that takes them for as many independent ones believes the records too
        much and the model file too little. Beside effects, what a force leaves that nothing explains is no noise.
        """
        with contextlib.suppress(*ASTRAY):
            noise = fitted_noise(fitted.residual, self.fitter.tracked.parts, self.settings.order)
            return likely(fitted, self.fitter, noise).structure
        return fitted.structure

    def _foresight(self, structure: Structure, looks: Sequence[Look]) -> float:
        """Log-density of the fitted samples as a searched structure predicts them under all trackers together.

        Values that fit under one of them may be nonsense under another, as where a slow one lets a joint stick and
        slip at times of its own.
        """
        with contextlib.suppress(*ASTRAY):
            told = (self.fitter.unfitted(structure, look.fitted.tracker) for look in looks)
            return sum(self.predictive_density(fitted) for fitted in told)
        return -np.inf

    def _notes(self, look: Look) -> tuple[str, ...]:
        """Notes of the search on records that what it found does not explain."""
        return tuple(disturbed(self.fitter.tracked, look.fitted, self.settings))

    def _gaps(self, ranking: Ranking) -> dict[str, Gap]:
        """Errors of what the search found on validation records, under the fastest tracker that an effect came in by.

        A slow one lets a machine stick and slip where its own controller held it.
        """
        band = max((one.band for one in ranking.effects), default=self.settings.bands[0])
        return gaps(self.held_out_as_fitted, (self.start.model, ranking.recalibrated, ranking.model), band)

    def _held(self, looks: Sequence[Look], best: Trial | None) -> list[Look]:
        """Search again with commands that change between samples, where no effect does as well; else none.

        Where an effect counts, they are compared under its tracker. Where none does, a fast tracker shows what a slow
        one hides behind all else that is missing.
        """
        if self.fitter.tracked.setup.hold != AUTOMATIC:
            return []
        told = (self._held_under(look, best) for look in (looks if best is None else [best.look]))
        return next((smooth for smooth in told if smooth), [])

    def _held_under(self, now: Look, best: Trial | None) -> list[Look]:
        """Search again with commands that change between samples, if that counts under one tracker; else none.

        Commands that are held for a sample come half a sample late. A spring takes nearly all of that back, with three
        numbers more. It may leave less because it answers to noise otherwise, so samples have to be more probable by
        it. How a command was recorded is no law of the machine, so that its effect may be slight.
        """
        settings = self.settings
        ways: list[tuple[Judgement, Fitter, Fitted]] = []
        for course in SMOOTH:
            smooth, view = Fitter(self.fitter.tracked.with_hold(course), settings), View(now.noise)
            with contextlib.suppress(*ASTRAY):
                fitted = smooth.finished(smooth.fitted(now.fitted.structure, now.fitted.tracker, view), view)
                if (judgement := now.judged(fitted)).is_repeated(settings):
                    ways.append((judgement, smooth, fitted))
            if not ways:
                return []  # if straight lines are no better, no curve is
        *_, least = max(ways, key=lambda way: way[0].removed)
        noise = fitted_noise(least.residual, self.fitter.tracked.parts, settings.order)

        told = [evidence(fitted, smooth, noise) for _, smooth, fitted in ways]
        rivals = [(now.fitted, settings.odds)] + ([] if best is None else [(best.fitted, 0.0)])
        if any(max(told) - evidence(one, self.fitter, noise) <= more for one, more in rivals):
            return []
        judgement, self.fitter, fitted = ways[told.index(max(told))]
        self.say(
            f"commands that run on from sample to sample remove {rough_percent(judgement.removed)} of the error power"
        )
        self.first = {look.fitted.tracker.band: look for look in self.looks(self.start)}
        return self.all_looks(self.look(fitted))

    def _round(self, looks: Sequence[Look]) -> tuple[Trial | None, list[Trial]]:
        """Round of the search: the best additional effect, if one counts, and all that were tried.

        Where much is missing, known parameters go astray to make up for it, to values that are improbable by the model
        file. Fits from there need not lead back: where nothing counts then, they begin at what the file states.
        """
        best, tried = self._best(looks, [self._off_its_ends(look) for look in looks])
        if best is not None or self._are_by_the_file(looks):
            return best, tried
        if not looks[0].fitted.structure.effects:
            with contextlib.suppress(*ASTRAY):
                best, more = self._best(looks, [self._as_stated(look) for look in looks])
                tried = [*more, *tried]
        if best is None and (load := self._load(looks)) is not None:
            return load, [load, *tried]
        return best, tried

    def _are_by_the_file(self, looks: Sequence[Look]) -> bool:
        """Whether values that the model file allows explain the records of the search under one of its trackers."""
        return any(look.doubt <= self.settings.odds for look in looks)

    def _load(self, looks: Sequence[Look]) -> Trial | None:
        """Load that a body of the search took along, if it is more probable than its values far from the model file.

        It leaves no less error than these do: how improbable they are tells. A fit without the load begins where the
        one with it ended, too, for one may have stopped on its way back to the file.
        """
        found: list[Trial] = []
        for look in looks:
            without: float | None = None
            for structure in loaded(look.fitted.structure, self.start, self.extensions, self.names):
                with contextlib.suppress(*ASTRAY):
                    without = self.own_evidence(look.fitted) if without is None else without
                    fitted = self.fitted(structure, look.fitted.tracker)
                    more = (own := self.own_evidence(fitted)) - without
                    if more > self.settings.odds:
                        bare = self.fitted(fitted.structure.without(structure.effects[-1]), look.fitted.tracker)
                        more = min(more, own - self.own_evidence(bare))
                    found.append(replace(Trial.of(fitted, look), evidence=more))
        best = max(found, key=lambda one: one.evidence, default=None)
        return best if best is not None and best.evidence > self.settings.odds else None

    def _off_its_ends(self, look: Look) -> Look:
        """Look of the search from which fits with another effect can come back, see `Structure.off_its_ends`.

        No farther from their ends than an effect has to gain: else each fit has to come all the way back first.
        """
        fitted = look.fitted
        middle = fitted.structure.off_its_ends
        if middle is fitted.structure:
            return look
        for share in OFF_ENDS:
            begun = fitted.structure.moved(share * (middle.standard - fitted.structure.standard))
            with contextlib.suppress(*ASTRAY):
                other = self.fitter.unfitted(begun, fitted.tracker, look.view)
                if other.cost - fitted.cost < look.needed:
                    return self.look(other)
        return look

    def _best(
        self, looks: Sequence[Look], begun: Sequence[Look], beside: Fitted | None = None
    ) -> tuple[Trial | None, list[Trial]]:
        """Best additional effect of a search by fits from what was ``begun`` under each tracker, and all tried ones.

        Each fit has to promise as much as it would in a race with one that was made ``beside`` them.
        """
        tried: list[Trial] = []
        counting: list[Trial] = []
        for look, start in zip(looks, begun, strict=True):
            if not look.has_room():
                continue
            seen = self.tried(look, start, beside=beside)
            done = [self.by_its_own_size(trial) for trial in self.finished(seen)]
            ends = [self.examined(trial) for trial in done if trial.counts]
            tried += [*(trial for trial in ends if not trial.counts), *seen]
            counting += [trial for trial in ends if trial.counts]
            if not all(trial.look.has_room(trial.fitted) for trial in counting):
                break  # one leaves nothing that another effect could do better
        told: list[Trial] = []
        counting += self._counting_elsewhere(counting)
        while counting:
            best, *others = weighed(counting, self.fitter)
            best = self.against_validation(against_timing(best, self.fitter))
            if best.counts and best.evidence > self.settings.odds:
                self.others[best.key] = [trial.fitted.structure for trial in others]
                return best, [best, *others, *told, *tried]
            # It leaves less error because it answers to noise otherwise, or comes in time; no sample is more probable.
            # Or it does harm to validation records.
            told.append(best)
            counting = [trial for trial in counting if trial.fitted is not best.fitted]
        return None, told + tried

    def _counting_elsewhere(self, counting: Sequence[Trial]) -> list[Trial]:
        """Effects of the search that count under another tracker alone, fitted under the one by which all are weighed.

        Evidence compares effects under one tracker. A race there may have given one up that is the better name.
        """
        if not counting:
            return []
        first = min(counting, key=lambda trial: trial.left)
        there = {trial.key for trial in counting if trial.look is first.look}
        missing = {trial.key: trial.fitted.structure for trial in counting if trial.key not in there}
        ends = self.in_its_place(first.look, list(missing.values()))
        return [trial for trial in (self.examined(end) for end in ends) if trial.counts]

    def _out_of_a_dead_end(self, last: Trial, looks: list[Look]) -> list[Look]:
        """Search without its last effect, if that only led the fit of others out of a dead end."""
        try:
            bare = self.without(last.key, looks[0])
        except ASTRAY:
            return looks
        now = Trial.of(looks[0].fitted, bare, last.key)
        if last.look.judged(bare.fitted).least <= self.settings.worth or now.counts:
            return looks
        self.say(f"no longer needed: {last.label}")
        return self.all_looks(bare)

    def _reconsidered(self, one: Effect, looks: list[Look]) -> tuple[list[Look], tuple[Ranked, ...]]:
        """Search with an earlier effect dropped or replaced by a better one.

        What was found before the others came in was fitted to what they leave, too. A fast tracker hides what a slow
        one shows: an effect that counts under any of them stays. So does one without which nearly all of the error
        comes back: others then take its shape at absurd sizes.
        """
        bare: list[Look] = []
        key = (one.name, one.at)
        for look in looks:
            try:
                bare.append(self.without(key, look, one.side))
            except ASTRAY:  # it runs away without, or another one rests on it
                return looks, ()
            now = Trial.of(look.fitted, bare[-1], key)
            if one.type.is_load and self.advantage(look.fitted, bare[-1].fitted) > self.settings.odds:
                return looks, ()  # values far from the model file would take its place
            trials = (now, *self.in_its_place(bare[-1], self.others.get(key, ())))
            told = [self.examined(trial) for trial in trials if trial.counts]
            counting = [trial for trial in told if trial.counts]
            if counting or now.judgement.least > self.settings.clear:
                return self._exchanged(now, counting or [now], looks)
        self.say(f"no longer needed: {' at '.join(key)}")
        return self.all_looks(bare[0]), ()

    def _exchanged(
        self, now: Trial, counting: Sequence[Trial], looks: list[Look]
    ) -> tuple[list[Look], tuple[Ranked, ...]]:
        """Searched structure with the best counting effect in the place of another, or that one itself."""
        ordered = [now] if list(counting) == [now] else weighed(counting, self.fitter)
        if ordered[0].key == now.key:
            return looks, ()
        self.say(f"{ordered[0].label} does better than {now.label}")
        return self.all_looks(self.look(ordered[0].fitted)), self.listed(ordered[0], ordered)


def _place(ranked: Ranked) -> _Place:
    return *ranked.key, ranked.side


def _named(named: Mapping[_Place, Ranked], effect: Effect, values: Mapping[str, float]) -> Ranked:
    """Ranked effect of a searched structure at its ``values``; what split its joint may have changed its side since."""
    same = [one for one in named.values() if one.key == (effect.name, effect.at)]
    own = named.get((effect.name, effect.at, effect.side)) or same[-1]
    now = {name: values.get(name, value) for name, value in own.values.items()}
    return replace(own, side=effect.side, values=now)


def _is_worse(now: Sequence[Look], before: Sequence[Look]) -> bool:
    """Whether a searched structure with no more effects leaves more of fitted and held-back records."""
    fewer = len(now[0].fitted.structure.effects) <= len(before[0].fitted.structure.effects)
    same = [look for look in before if look.fitted.tracker == now[0].fitted.tracker]
    return fewer and any(now[0].judged(look.fitted).least > 0.0 for look in same)
