"""Search of a ranking: structures grow by one effect at a time."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from vpm.catalogue import EFFECTS
from vpm.discrepancy.parallel_candidates import ParallelCandidates
from vpm.discrepancy.screening.candidates import Key
from vpm.errors import VpmError
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.numbers import rough_percent
from vpm.ranking.both_sides import on_both_sides
from vpm.ranking.choice_by_evidence import as_good, evidence, weighed
from vpm.ranking.disturbed_records import disturbed
from vpm.ranking.fit import ASTRAY, Fitted, Fitter, View
from vpm.ranking.free_shape import against_free_shapes
from vpm.ranking.judgement import Judgement
from vpm.ranking.look import Look
from vpm.ranking.model_structure import Structure
from vpm.ranking.noise_model import fitted_noise
from vpm.ranking.own_vibration import below_own_vibration
from vpm.ranking.parameter_priors import Sizes, known
from vpm.ranking.posterior import robust_probabilities
from vpm.ranking.proposal_fits import raced
from vpm.ranking.proposals import proposals
from vpm.ranking.result import Gap, Ranked, Ranking
from vpm.ranking.settings import Settings
from vpm.ranking.several_places import alike
from vpm.ranking.short_waves import wider_bands
from vpm.ranking.structure_extensions import Extensions
from vpm.ranking.substitute_records import shown, why_unbalanced
from vpm.ranking.tracked_records import TrackedRecords, Tracker
from vpm.ranking.tried_effect import Trial
from vpm.ranking.usual_friction import with_usual_friction
from vpm.ranking.validation_errors import gaps
from vpm.simulate import Setup
from vpm.simulate.setup import AUTOMATIC

#: What commands do between samples that were read, and not sent.
SMOOTH = ("first_order", "cubic")


class Search:
    """Search of a ranking over structures that grow by one effect at a time."""

    def __init__(
        self,
        model: Model,
        records: Sequence[Experiment],
        names: Sequence[str],
        settings: Settings,
        setup: Setup | None,
        each: ParallelCandidates,
        say: Callable[[str], None],
    ) -> None:
        settings = below_own_vibration(settings, model, records)
        self.names, self.settings, self.each, self.say = names, settings, each, say
        self.fitter = Fitter(TrackedRecords(model, records, settings, setup), settings)
        self.data = shown(model, self.fitter.tracked)
        self.bands = () if why_unbalanced(model, records) else wider_bands(model, self.data)
        self.sizes = Sizes(model, self.data)
        self.extensions = Extensions(self.sizes)
        firsts = self.fitter.tracked.firsts.priors
        values = np.append(model.theta, np.zeros(len(firsts)))
        self.start = Structure(
            model, values, known(model, self.data, self.fitter.tracked) | firsts, firsts=tuple(firsts)
        )
        self.first: dict[float, Look] = {}  # looks at the model as it was, by bandwidth
        self.others: dict[Key, list[Structure]] = {}  # what counted as well when an effect came in

    def run(self, held_out: TrackedRecords) -> Ranking:
        """Run the search of a ranking, see `rank`."""
        self.say("fitting what is uncertain")
        looks = self._looks(self.start)
        self.first = {look.fitted.tracker.band: look for look in looks}
        named: dict[Key, Ranked] = {}
        rounds: list[tuple[Ranked, ...]] = []
        interrupted = False
        before: list[frozenset[Key]] = []
        try:
            looks, rounds = self._brought_back(looks)
            named = {ranked.key: ranked for ranked, *_ in rounds}
            for _ in range(2 * self.settings.effects):  # effects may replace each other, but not for ever
                present = looks[0].fitted.structure.effects
                if len(present) == self.settings.effects or frozenset(present) in before:
                    break
                best, tried = self._round(looks)
                if smooth := self._held(looks, best):
                    looks = smooth
                    continue
                before.append(frozenset(present))
                looks, together = self._several_at_once(looks, best, tried)
                rounds.append(self._listed(None if together else best, tried))
                if together:
                    rounds += together
                    named |= {ranked.key: ranked for ranked, *_ in together}
                    continue
                if best is None:
                    break
                named[best.key] = rounds[-1][0]
                was, looks = looks, [self._look(best.fitted)]  # known, should the next fits be interrupted
                self.say(f"{best.label} {_removing(best)}")
                looks = self._all_looks(looks[0])
                for key in present:
                    looks, several = self._reconsidered(key, looks)
                    if several:
                        rounds.append(several)
                        named[several[0].key] = several[0]
                if _is_worse(looks, was):
                    self.say(f"{best.label} does not do the work of what it makes needless")
                    looks = was
                    break
                if present:
                    looks = self._out_of_a_dead_end(best, looks)
        except KeyboardInterrupt:
            interrupted = True
        found = looks[0].fitted.structure
        recalibrated = next(iter(self.first.values())).fitted.structure.repaired
        hold = self.fitter.tracked.setup.course
        effects = tuple(replace(named[key], side=found.side(key)) for key in found.effects)
        ranking = Ranking(
            effects, tuple(rounds), found.repaired, recalibrated, {}, interrupted, hold, self._notes(looks)
        )
        try:
            return replace(ranking, gaps=self._gaps(held_out.with_hold(hold), ranking))
        except KeyboardInterrupt:
            return replace(ranking, interrupted=True)

    def _notes(self, looks: list[Look]) -> tuple[str, ...]:
        """Notes of the search on records that what it found does not explain."""
        return tuple(disturbed(self.fitter.tracked, looks[0].fitted, self.settings))

    def _gaps(self, held_out: TrackedRecords, ranking: Ranking) -> dict[str, Gap]:
        """Errors of what the search found on validation records, under the fastest tracker that an effect came in by.

        A slow one lets a machine stick and slip where its own controller held it.
        """
        band = max((one.band for one in ranking.effects), default=self.settings.bands[0])
        return gaps(held_out, (self.start.model, ranking.recalibrated, ranking.model), band)

    def _held(self, looks: list[Look], best: Trial | None) -> list[Look]:
        """Search again with commands that change between samples, where no effect does as well; else none.

        Commands that are held for a sample come half a sample late. A spring takes nearly all of that back, with three
        numbers more. It may leave less because it answers to noise otherwise, so samples have to be more probable by
        it. How a command was recorded is no law of the machine, so that its effect may be slight.
        """
        if self.fitter.tracked.setup.hold != AUTOMATIC:
            return []
        now, settings = looks[0] if best is None else best.look, self.settings
        ways: list[tuple[Judgement, Fitter, Fitted]] = []
        for course in SMOOTH:
            smooth, view = Fitter(self.fitter.tracked.with_hold(course), settings), View(now.view.noise)
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
        self.first = {look.fitted.tracker.band: look for look in self._looks(self.start)}
        return self._all_looks(self._look(fitted))

    def _looks(self, structure: Structure, known: Look | None = None) -> list[Look]:
        """Looks of the search at a structure under each tracker that can follow it.

        A slow tracker may lose what hangs behind a contact, or let a leg fall over. What it leaves then says nothing.
        Where one follows, fits under the next begin at its values: these hide more, and begun afar they may end early.
        A fast one that predicts worse is left out, see `_predicts_worse`.

        Raises
        ------
        VpmError
            All of them run away.
        """
        looks = [] if known is None else [known]
        reason: Exception = VpmError(f"{structure.model.name} runs away from the records")
        for band in self.settings.bands:
            if known is None or band != known.fitted.tracker.band:
                begun = next((look.fitted.structure for look in looks if look.follows), structure)
                try:
                    looks.append(self._look(self._fitted(begun, Tracker(band))))
                except ASTRAY as error:
                    reason = error
        if not looks:
            raise reason
        looks = [look for look in looks if look.follows] or looks[-1:]
        return [look for look in looks if not any(self._predicts_worse(look, other) for other in looks)]

    def _predicts_worse(self, look: Look, slower: Look) -> bool:
        """Whether a fast look of the search makes the records clearly less probable than a slower one.

        A tracker moves its model by the noise of sensors, too. Where that outweighs the errors that it corrects, a
        structure leaves less by answering less to noise, and its values lead astray. Predictions of the same samples
        are compared, each whitened by its own spectrum (A. Dawid, *J. Royal Statistical Society A* 147, 1984).
        """
        if look.fitted.tracker.band <= slower.fitted.tracker.band:
            return False
        told = (self._predictive_density(one.fitted) for one in (look, slower))
        return next(told) + self.settings.odds < next(told)

    def _predictive_density(self, fitted: Fitted) -> float:
        """Log-density of the fitted samples as a tracker predicts them, whitened by their own spectrum."""
        noise = fitted_noise(fitted.residual, self.fitter.tracked.parts, self.settings.order)
        return float(np.sum(self.fitter.log_density(fitted, noise)))

    def _all_looks(self, look: Look) -> list[Look]:
        return self._looks(look.fitted.structure, look)

    def _look(self, fitted: Fitted) -> Look:
        return Look(fitted, self.fitter, self.first.get(fitted.tracker.band))

    def _fitted(self, structure: Structure, tracker: Tracker) -> Fitted:
        """Fit of a structure to the end in the search, with channels scaled by their first residual."""
        view = View(self.fitter.noise_of(structure, tracker))
        return self.fitter.finished(self.fitter.fitted(structure, tracker, view), view)

    def _round(self, looks: Sequence[Look]) -> tuple[Trial | None, list[Trial]]:
        """Round of the search: the best additional effect, if one counts, and all that were tried.

        Where much is missing, known parameters go far astray to make up for it, and fits from there need not lead back.
        Where nothing counts then, fits begin at what the model file states.
        """
        best, tried = self._best(looks, looks)
        if best is not None or not looks[0].fitted.structure.is_far(self.settings.reach):
            return best, tried
        with contextlib.suppress(*ASTRAY):
            stated = [self._look(self.fitter.unfitted(self.start, look.fitted.tracker)) for look in looks]
            best, more = self._best(looks, stated)
            tried = [*more, *tried]
        return best, tried

    def _best(self, looks: Sequence[Look], begun: Sequence[Look]) -> tuple[Trial | None, list[Trial]]:
        """Best additional effect of a search by fits from what was ``begun`` under each tracker, and all tried ones."""
        tried: list[Trial] = []
        counting: list[Trial] = []
        for look, start in zip(looks, begun, strict=True):
            if not look.has_room():
                continue
            seen = self._tried(look, start)
            ends = [against_free_shapes(trial, self.fitter) for trial in self._finished(seen) if trial.counts]
            tried += [*(trial for trial in ends if not trial.counts), *seen]
            counting += [trial for trial in ends if trial.counts]
            if any(not trial.look.has_room(trial.fitted) for trial in counting):
                break  # nothing could be missing beside it
        told: list[Trial] = []
        while counting:
            best, *others = weighed(counting, self.fitter)
            if best.evidence > self.settings.odds:
                self.others[best.key] = [trial.fitted.structure for trial in others]
                return best, [best, *others, *told, *tried]
            # It leaves less error because it answers to noise otherwise; no sample is more probable by it.
            told.append(best)
            counting = [trial for trial in counting if trial.fitted is not best.fitted]
        return None, told + tried

    def _several_at_once(
        self, looks: list[Look], best: Trial | None, tried: Sequence[Trial]
    ) -> tuple[list[Look], list[tuple[Ranked, ...]]]:
        """Search round with several effects at once, where no effect alone does as well."""
        looks, together = self._at_several_places(looks, best, tried)
        if not (best or together):
            looks, together = self._resting_on_another(looks, tried)
        return (looks, together) if best or together else self._rubbing_on_both_sides(looks)

    def _at_several_places(
        self, looks: list[Look], best: Trial | None, tried: Sequence[Trial]
    ) -> tuple[list[Look], list[tuple[Ranked, ...]]]:
        """Search round with one effect at several places, where no effect alone does as well."""
        room = self.settings.effects - len(looks[0].fitted.structure.effects)
        if best is not None and not best.look.has_room(best.fitted):
            return looks, []
        comparable = [one for one in tried if best is None or one.look is best.look]
        for trial in alike(comparable, room, self.fitter, self.each):
            with contextlib.suppress(*ASTRAY):
                if not trial.counts or (best is not None and not self._is_likelier(trial, best)):
                    continue
                look = self._look(trial.fitted)
                new = [key for key in trial.fitted.structure.effects if key not in trial.look.fitted.structure.effects]
                found = [self._weighed_beside_others(key, look) for key in new]
                if all(map(self._stands, found)):
                    self.say(f"{trial.key[0]} at {' and '.join(site for _, site in new)} together {_removing(trial)}")
                    return self._all_looks(look), [self._listed(one, [one]) for one in found]
        return looks, []

    def _brought_back(self, looks: list[Look]) -> tuple[list[Look], list[tuple[Ranked, ...]]]:
        """Search begun with the usual friction that counts, of a model that is lost at several joints without it."""
        if why_unbalanced(self.start.model, self.fitter.tracked.experiments) or not all(look.is_lost for look in looks):
            return looks, []
        with contextlib.suppress(*ASTRAY):
            most = self.settings.effects
            structure = with_usual_friction(looks[0], self.data, self.extensions, self.sizes, self.names, most)
            if structure is not None:
                return self._with_needed(structure, looks, self._stands, "bring the model back to its records")
        return looks, []

    def _resting_on_another(
        self, looks: list[Look], tried: Sequence[Trial]
    ) -> tuple[list[Look], list[tuple[Ranked, ...]]]:
        """Search with an effect and one that rests on it, where none counts alone.

        Friction that differs along the way by as much as there is of it has no mean that piece after piece shows.
        """
        resting = {name: needed for name in self.names if (needed := EFFECTS[name].requires)}
        bare = {one.key: one for one in sorted(tried, key=lambda one: -one.left) if one.key[0] in resting.values()}
        for first in sorted(bare.values(), key=lambda one: one.left):
            with contextlib.suppress(*ASTRAY):
                look = self._look(self.fitter.finished(first.fitted, View(first.look.view.noise)))
                names = [name for name, needed in resting.items() if needed == first.key[0]]
                beside = self._finished(self._tried(look, look, names))
                counting = [two for two in beside if two.counts and two.key[1] == first.key[1]]
                best = min(counting, key=lambda two: two.left, default=None)
                if best is None:
                    continue
                both = weighed([Trial.of(best.fitted, first.look, first.key)], self.fitter)[0]
                if not self._stands(both):
                    continue
                self.say(f"{first.label} and {best.key[0]} together {_removing(both)}")
                (second,) = self._listed(None, weighed([best], self.fitter))
                (one,) = self._listed(both, [both])
                own = {name: value for name, value in one.values.items() if name not in second.values}
                return self._all_looks(self._look(best.fitted)), [(replace(one, values=own),), (second,)]
        return looks, []

    def _rubbing_on_both_sides(self, looks: list[Look]) -> tuple[list[Look], list[tuple[Ranked, ...]]]:
        """Search with friction on both sides of split joints, where that makes the records more probable.

        Masses and springs that the model file rules out may stand for friction that is on the wrong side. They leave no
        error, and only the evidence knows of the file.
        """
        with contextlib.suppress(*ASTRAY):
            structure = on_both_sides(looks[0].fitted.structure, self.extensions, self.names, self.settings.effects)
            return self._with_needed(structure, looks, self._spares_file, "on the other side of what gives way, too")
        return looks, []

    def _with_needed(
        self, structure: Structure, looks: list[Look], stands: Callable[[Trial], bool], done: str
    ) -> tuple[list[Look], list[tuple[Ranked, ...]]]:
        """Searched structure with several effects at once, but for those that do not stand beside the others."""
        before = looks[0].fitted.structure.effects
        while new := [key for key in structure.effects if key not in before]:
            look = self._look(self._fitted(structure, looks[0].fitted.tracker))
            found = [self._weighed_beside_others(key, look) for key in new]
            needless = [one.key for one in found if not stands(one)]
            if not needless:
                self.say(f"{' and '.join(one.label for one in found)} {done}")
                return self._all_looks(look), [self._listed(one, [one]) for one in found]
            structure = look.fitted.structure
            for key in needless:
                structure = structure.without(key)
        return looks, []

    def _is_likelier(self, trial: Trial, other: Trial) -> bool:
        """Whether a fit of the search is clearly more probable than another one under the same tracker."""
        noise = fitted_noise(trial.fitted.residual, self.fitter.tracked.parts, self.settings.order)
        told = [evidence(one.fitted, self.fitter, noise) for one in (trial, other)]
        return told[0] - told[1] > self.settings.odds

    def _weighed_beside_others(self, key: Key, look: Look) -> Trial:
        """Effect of a searched structure with its evidence, judged against the structure without it."""
        return weighed([Trial.of(look.fitted, self._without(key, look), key)], self.fitter)[0]

    def _stands(self, trial: Trial) -> bool:
        """Whether a weighed effect of the search counts and is more probable than chance."""
        return trial.counts and trial.evidence > self.settings.odds

    def _spares_file(self, trial: Trial) -> bool:
        """Whether a weighed effect of the search is more probable than chance, and what the file states is with it."""
        without, with_it = (one.structure.doubt for one in (trial.look.fitted, trial.fitted))
        return trial.evidence > self.settings.odds and without - with_it > self.settings.tolerance

    def _tried(self, look: Look, begun: Look, names: Sequence[str] | None = None) -> list[Trial]:
        """Most promising effects of a search round, fitted under one tracker from the structure that was ``begun``."""
        asked = self.names if names is None else names
        chosen = proposals(begun, self.fitter, self.data, self.extensions, self.each, asked, self.bands)
        return [Trial.of(fitted, look, ended=False) for fitted in raced(chosen, begun, self.fitter, self.each)]

    def _finished(self, tried: Sequence[Trial]) -> list[Trial]:
        """Fits of one tracker in a search round that are worth it, finished to the end."""
        worth = [t for t in tried if t.judgement.removed > self.settings.worth and t.fitted.structure.shows(t.key)]
        if not worth:
            return []
        best = min(worth, key=lambda trial: trial.left)
        most = self.settings.finished * best.left
        hopeful = [t for t in worth if t.left <= most or as_good(t, best, self.settings) or best.contains(t)]

        def one_finished(trial: Trial) -> Trial:
            view = View(trial.look.view.noise)
            fitted = self.fitter.finished(trial.fitted, view)
            ends = [fitted, *self._detours(fitted, view)] if trial.splits else [fitted]
            return Trial.of(min(ends, key=lambda one: one.cost), trial.look)

        ends = self.each("finishing", one_finished, hopeful, lambda trial: trial.label)
        return [end for end in ends if isinstance(end, Trial)]

    def _detours(self, fitted: Fitted, view: View) -> list[Fitted]:
        """Fits of a splitting effect in the search, continued from where a faster tracker leads.

        A slow tracker lets a load behind a backlash go its own way. Few of its impacts are in step with those of the
        record, and fits end in many places. A fast one holds it in step (H. Abarbanel, *Predicting the Future*,
        Springer 2013).
        """
        detour = Tracker(max(self.settings.bands))
        if detour == fitted.tracker:
            return []
        try:
            quick = self._fitted(fitted.structure, detour).structure
            return [self.fitter.finished(self.fitter.fitted(quick, fitted.tracker, view), view)]
        except ASTRAY:
            return []

    def _out_of_a_dead_end(self, last: Trial, looks: list[Look]) -> list[Look]:
        """Search without its last effect, if that only led the fit of others out of a dead end."""
        try:
            bare = self._without(last.key, looks[0])
        except ASTRAY:
            return looks
        now = Trial.of(looks[0].fitted, bare, last.key)
        if last.look.judged(bare.fitted).least <= self.settings.worth or now.counts:
            return looks
        self.say(f"no longer needed: {last.label}")
        return self._all_looks(bare)

    def _reconsidered(self, key: Key, looks: list[Look]) -> tuple[list[Look], tuple[Ranked, ...]]:
        """Search with an earlier effect dropped or replaced by a better one.

        What was found before the others came in was fitted to what they leave, too. A fast tracker hides what a slow
        one shows: an effect that counts under any of them stays.
        """
        bare: list[Look] = []
        for look in looks:
            try:
                bare.append(self._without(key, look))
            except ASTRAY:  # it runs away without, or another one rests on it
                return looks, ()
            now = Trial.of(look.fitted, bare[-1], key)
            trials = (now, *self._in_its_place(bare[-1], self.others.get(key, ())))
            told = [against_free_shapes(trial, self.fitter) for trial in trials if trial.counts]
            if counting := [trial for trial in told if trial.counts]:
                return self._exchanged(now, counting, looks)
        self.say(f"no longer needed: {' at '.join(key)}")
        return self._all_looks(bare[0]), ()

    def _without(self, key: Key, look: Look) -> Look:
        """Searched structure without one effect, fitted again under its tracker."""
        return self._look(self._fitted(look.fitted.structure.without(key), look.fitted.tracker))

    def _exchanged(
        self, now: Trial, counting: Sequence[Trial], looks: list[Look]
    ) -> tuple[list[Look], tuple[Ranked, ...]]:
        """Searched structure with the best counting effect in the place of another, or that one itself."""
        ordered = [now] if list(counting) == [now] else weighed(counting, self.fitter)
        if ordered[0].key == now.key:
            return looks, ()
        self.say(f"{ordered[0].label} does better than {now.label}")
        return self._all_looks(self._look(ordered[0].fitted)), self._listed(ordered[0], ordered)

    def _in_its_place(self, look: Look, others: Sequence[Structure]) -> list[Trial]:
        """Last effects of other structures in the place of a searched one, fitted."""

        def one_fitted(other: Structure) -> Trial:
            structure, view = look.fitted.structure.with_last_of(other), View(look.view.noise)
            fitted = self.fitter.fitted(structure, look.fitted.tracker, view)
            return Trial.of(fitted, look, ended=False)

        ends = self.each("exchanging", one_fitted, others, lambda other: " at ".join(other.effects[-1]))
        return self._finished([end for end in ends if isinstance(end, Trial)])

    def _listed(self, best: Trial | None, tried: Sequence[Trial]) -> tuple[Ranked, ...]:
        """All effects that the search tried: accepted ones, then by the error that they leave."""
        several: dict[Key, Ranked] = {}
        told = [trial for trial in tried if np.isfinite(trial.evidence)]
        gains = [trial.evidence - self.settings.odds for trial in told]
        *shares, _, _ = robust_probabilities(gains, self.settings.tempering, self.settings.astray)
        probability = {id(trial): float(share) for trial, share in zip(told, shares, strict=True)}
        labels = {trial.label: probability[id(trial)] for trial in told}
        for trial in sorted(tried, key=lambda trial: (trial is not best, trial.left)):
            own = probability.get(id(trial), np.nan)
            alike = sum(labels.get(label, 0.0) for label in trial.rivals)
            ranked = self._ranked(trial, own, own + alike)
            several.setdefault(ranked.key, ranked)
        return tuple(several.values())

    def _ranked(self, trial: Trial, probability: float, class_probability: float) -> Ranked:
        structure, without = trial.fitted.structure, trial.look.fitted.structure
        values = {name: value for name, value in structure.values.items() if name not in without.priors}
        side, band = structure.side(trial.key), trial.fitted.tracker.band
        return Ranked(
            *trial.key,
            values,
            trial.judgement,
            band,
            side,
            trial.evidence,
            probability,
            trial.rivals,
            class_probability,
        )


def _removing(trial: Trial) -> str:
    return f"removes {rough_percent(trial.judgement.removed)} of the error power"


def _is_worse(now: Sequence[Look], before: Sequence[Look]) -> bool:
    """Whether a searched structure with no more effects leaves more of fitted and held-back records."""
    fewer = len(now[0].fitted.structure.effects) <= len(before[0].fitted.structure.effects)
    same = [look for look in before if look.fitted.tracker == now[0].fitted.tracker]
    return fewer and any(now[0].judged(look.fitted).least > 0.0 for look in same)
