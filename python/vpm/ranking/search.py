"""Structures that grow by one effect at a time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from vpm.discrepancy.candidates import Key
from vpm.discrepancy.side_by_side import SideBySide
from vpm.errors import VpmError
from vpm.experiment import Experiment
from vpm.identify import InverseDynamicsProblem
from vpm.model import Model
from vpm.ranking.extensions import Extensions
from vpm.ranking.fit import ASTRAY, Fitted, Fitter, View
from vpm.ranking.look import Look, same_curve
from vpm.ranking.noise_model import fitted_noise
from vpm.ranking.observed import Observed, Observer
from vpm.ranking.posterior import apart, probabilities
from vpm.ranking.proposals import proposals
from vpm.ranking.race import raced
from vpm.ranking.result import Ranked, Ranking
from vpm.ranking.settings import Settings
from vpm.ranking.sizes import Sizes, known
from vpm.ranking.structure import Structure
from vpm.ranking.trial import Trial
from vpm.ranking.validation import gaps
from vpm.simulate import Setup

#: What commands do between samples that were read, and not sent.
STRAIGHT = "first_order"


class Search:
    """Structures that grow by one effect at a time."""

    def __init__(
        self,
        model: Model,
        records: Sequence[Experiment],
        names: Sequence[str],
        settings: Settings,
        setup: Setup | None,
        each: SideBySide,
        say: Callable[[str], None],
    ) -> None:
        self.names, self.settings, self.each, self.say = names, settings, each, say
        self.data = InverseDynamicsProblem(model, records)
        self.hold_known = setup is not None
        self.fitter = Fitter(Observed(model, records, settings, setup), settings)
        self.extensions = Extensions(Sizes(model, self.data))
        firsts = self.fitter.observed.firsts.priors
        values = np.append(model.theta, np.zeros(len(firsts)))
        self.start = Structure(model, values, known(model, self.data) | firsts, firsts=tuple(firsts))
        self.first: dict[float, Look] = {}  # looks at the model as it was, by bandwidth
        self.others: dict[Key, list[Structure]] = {}  # what counted as well when an effect came in

    def run(self, held_out: Observed) -> Ranking:
        """See `rank`."""
        self.say("fitting what is uncertain")
        looks = self._looks(self.start)
        self.first = {look.fitted.observer.band: look for look in looks}
        named: dict[Key, Ranked] = {}
        rounds: list[tuple[Ranked, ...]] = []
        interrupted = False
        try:
            for _ in range(2 * self.settings.effects):  # effects may replace each other, but not for ever
                if len(looks[0].fitted.structure.effects) == self.settings.effects:
                    break
                best, tried = self._round(looks)
                if smooth := self._held(looks, best):
                    looks = smooth
                    continue
                rounds.append(self._listed(best, tried))
                if best is None:
                    break
                named[best.key] = rounds[-1][0]
                self.say(f"{best.label} removes {100.0 * best.judgement.removed:.3g} % of the error power")
                looks = [self._look(best.fitted)]  # known, should the next fits be interrupted
                looks = self._all_looks(looks[0])
                for key in looks[0].fitted.structure.effects[:-1]:
                    looks, several = self._reconsidered(key, looks)
                    if several:
                        rounds.append(several)
                        named[several[0].key] = several[0]
        except KeyboardInterrupt:
            interrupted = True
        found = looks[0].fitted.structure
        recalibrated = next(iter(self.first.values())).fitted.structure.repaired
        stages = (self.start.model, recalibrated, found.repaired)
        hold = self.fitter.observed.setup.hold
        left = gaps(held_out.with_hold(hold), stages, self.settings.bands[0])
        effects = tuple(replace(named[key], side=found.side(key)) for key in found.effects)
        return Ranking(effects, tuple(rounds), found.repaired, recalibrated, left, interrupted, hold)

    def _held(self, looks: list[Look], best: Trial | None) -> list[Look]:
        """The same under commands that run straight from sample to sample, where no effect does as well; else none.

        Commands that are held for a sample come half a sample late, and no effect takes all of that back.
        """
        if self.hold_known:
            return []
        now, observed = looks[0], self.fitter.observed
        smooth = Fitter(observed.with_hold(STRAIGHT), self.settings)
        view = View(now.view.noise)
        try:
            fitted = smooth.finished(smooth.fitted(now.fitted.structure, now.fitted.observer, view), view)
        except ASTRAY:
            return []
        judgement = now.judged(fitted)
        if not judgement.counts(self.settings) or (best and best.judgement.removed >= judgement.removed):
            return []
        noise = fitted_noise(fitted.residual, observed.parts, self.settings.order)
        if smooth.evidence(fitted, noise) - self.fitter.evidence(now.fitted, noise) <= self.settings.odds:
            return []
        self.say(f"commands that run from sample to sample remove {100.0 * judgement.removed:.3g} % of the error power")
        self.fitter, self.hold_known = smooth, True
        self.first = {look.fitted.observer.band: look for look in self._looks(self.start)}
        return self._all_looks(self._look(fitted))

    def _looks(self, structure: Structure, known: Look | None = None) -> list[Look]:
        """A structure under each observer that can follow it, that which is known first.

        Raises
        ------
        VpmError
            None of them can.
        """
        looks = [] if known is None else [known]
        reason: Exception = VpmError(f"{structure.model.name} runs away from the records")
        for band in self.settings.bands:
            if known is None or band != known.fitted.observer.band:
                try:
                    looks.append(self._look(self._fitted(structure, Observer(band))))
                except ASTRAY as error:  # a slow observer may lose what hangs behind a contact
                    reason = error
        if not looks:
            raise reason
        return looks

    def _all_looks(self, look: Look) -> list[Look]:
        return self._looks(look.fitted.structure, look)

    def _look(self, fitted: Fitted) -> Look:
        return Look(fitted, self.fitter, self.first.get(fitted.observer.band))

    def _fitted(self, structure: Structure, observer: Observer) -> Fitted:
        """A structure fitted to the end, its channels in the sizes of what it leaves at first."""
        view = View(self.fitter.noise_of(structure, observer))
        return self.fitter.finished(self.fitter.fitted(structure, observer, view), view)

    def _round(self, looks: Sequence[Look]) -> tuple[Trial | None, list[Trial]]:
        """The best effect more, if one counts, and all that were tried."""
        tried: list[Trial] = []
        counting: list[Trial] = []
        for look in (look for look in looks if look.has_room()):
            seen = self._tried(look)
            tried += seen
            counting += [trial for trial in self._finished(seen) if self._counts(trial)]
            if any(not trial.look.has_room(trial.judgement.removed) for trial in counting):
                break  # nothing could be missing beside it
        told: list[Trial] = []
        while counting:
            weighed = self._weighed(counting)
            if weighed[0].evidence > self.settings.odds:
                self.others[weighed[0].key] = [trial.fitted.structure for trial in weighed[1:]]
                return weighed[0], weighed + told + tried
            # It leaves less error because it answers to noise otherwise; no sample is more probable by it.
            told.append(weighed[0])
            counting = [trial for trial in counting if trial.fitted is not weighed[0].fitted]
        return None, told + tried

    def _rivals(self, counting: Sequence[Trial]) -> tuple[list[Trial], list[Trial]]:
        """Those that leave as little as the best of those that count, then one of each other effect beside it.

        Of several that draw the same curve, the plainest one alone: a richer one fits what laws are wrong by.
        """
        first = min(counting, key=lambda trial: trial.left)
        here = sorted((trial for trial in counting if trial.look is first.look), key=lambda trial: trial.left)
        plain: list[Trial] = []
        for trial in sorted((one for one in here if self._as_good(one, first)), key=lambda one: one.numbers):
            if not any(same_curve(trial.key, other.key) for other in plain):
                plain.append(trial)
        others = {trial.key: trial for trial in reversed(here)}
        for trial in plain:
            del others[trial.key]
        return plain, list(others.values())[::-1]

    def _tried(self, look: Look) -> list[Trial]:
        """The most promising effects, fitted under one observer."""
        chosen = proposals(look, self.fitter, self.data, self.extensions, self.each, self.names)
        return [Trial.of(fitted, look) for fitted in raced(chosen, look, self.fitter, self.each)]

    def _counts(self, trial: Trial) -> bool:
        return trial.fitted.structure.shows(trial.key) and trial.judgement.counts(self.settings)

    def _as_good(self, trial: Trial, first: Trial) -> bool:
        """Whether it leaves no more than what the laws of the curves that either is a part of are wrong by."""
        told = (trial.judgement, first.judgement)
        return trial.left - first.left < max(one.removed * (self.settings.inexact / one.shape) ** 2 for one in told)

    def _finished(self, tried: Sequence[Trial]) -> list[Trial]:
        """Those of one observer that are worth it and leave little, fitted to the end."""
        worth = [t for t in tried if t.judgement.removed > self.settings.worth and t.fitted.structure.shows(t.key)]
        if not worth:
            return []
        best = min(worth, key=lambda trial: trial.left)
        most = self.settings.finished * best.left
        hopeful = [trial for trial in worth if trial.left <= most or self._as_good(trial, best)]

        def one_finished(trial: Trial) -> Trial:
            fitted = self.fitter.finished(trial.fitted, View(trial.look.view.noise))
            return Trial.of(fitted, trial.look)

        ends = self.each("finishing", one_finished, hopeful, lambda trial: trial.label)
        return [end for end in ends if isinstance(end, Trial)]

    def _weighed(self, counting: Sequence[Trial]) -> list[Trial]:
        """The best of those that count, then the others, with the evidence that each adds under one noise model.

        It is the most probable one of those that leave as little. Of what nobody can tell from it a part of the machine
        comes before an instrument.
        """
        plain, others = self._rivals(counting)
        observed, first = self.fitter.observed, min(plain, key=lambda trial: trial.left)
        noise = fitted_noise(first.fitted.residual, observed.parts, self.settings.order)
        without = self.fitter.evidence(first.look.fitted, noise)
        trials = [*plain, *others]
        weighed = [replace(trial, evidence=self.fitter.evidence(trial.fitted, noise) - without) for trial in trials]
        likely = max(weighed[: len(plain)], key=lambda trial: trial.evidence)
        nats = apart(likely.fitted, [trial.fitted for trial in trials], self.fitter, noise)
        alike = [trial for trial, far in zip(weighed, nats, strict=True) if far < self.settings.same]
        best = min(alike, key=lambda trial: (trial.is_instrument, -trial.evidence))
        rivals = tuple(trial.label for trial in alike if trial is not best)
        return [replace(best, rivals=rivals), *(trial for trial in weighed if trial is not best)]

    def _reconsidered(self, key: Key, looks: list[Look]) -> tuple[list[Look], tuple[Ranked, ...]]:
        """Without an earlier effect that a later one has made needless, or with a better one in its place.

        What was found before the others came in was fitted to what they leave, too.
        """
        whole = looks[0].fitted
        try:
            look = self._look(self._fitted(whole.structure.without(key), whole.observer))
        except ASTRAY:  # it runs away without, or another one rests on it
            return looks, ()
        now = Trial.of(whole, look, key)
        trials = [now, *self._in_its_place(look, self.others.get(key, ()))]
        counting = [trial for trial in trials if self._counts(trial)]
        if not counting:
            self.say(f"no longer needed: {' at '.join(key)}")
            return self._all_looks(look), ()
        if counting == [now]:
            return looks, ()
        weighed = self._weighed(counting)
        if weighed[0].key == key:
            return looks, ()
        self.say(f"{weighed[0].label} does better than {' at '.join(key)}")
        return self._all_looks(self._look(weighed[0].fitted)), self._listed(weighed[0], weighed)

    def _in_its_place(self, look: Look, others: Sequence[Structure]) -> list[Trial]:
        """The last effects of other structures here; those that leave little, fitted to the end."""

        def one_fitted(other: Structure) -> Trial:
            structure, view = look.fitted.structure.with_last_of(other), View(look.view.noise)
            fitted = self.fitter.fitted(structure, look.fitted.observer, view)
            return Trial.of(fitted, look)

        ends = self.each("exchanging", one_fitted, others, lambda other: " at ".join(other.effects[-1]))
        return self._finished([end for end in ends if isinstance(end, Trial)])

    def _listed(self, best: Trial | None, tried: Sequence[Trial]) -> tuple[Ranked, ...]:
        """All effects that were tried, what was added first, then those that leave least."""
        several: dict[Key, Ranked] = {}
        weighed = [trial for trial in tried if np.isfinite(trial.evidence)]
        *shares, _ = probabilities([trial.evidence - self.settings.odds for trial in weighed], self.settings.tempering)
        probability = {id(trial): float(share) for trial, share in zip(weighed, shares, strict=True)}
        for trial in sorted(tried, key=lambda trial: (trial is not best, trial.left)):
            ranked = self._ranked(trial, probability.get(id(trial), np.nan))
            several.setdefault(ranked.key, ranked)
        return tuple(several.values())

    def _ranked(self, trial: Trial, probability: float) -> Ranked:
        structure, without = trial.fitted.structure, trial.look.fitted.structure
        values = {name: value for name, value in structure.values.items() if name not in without.priors}
        side, band = structure.side(trial.key), trial.fitted.observer.band
        return Ranked(
            *trial.key,
            values,
            trial.judgement,
            band,
            side,
            trial.evidence,
            probability,
            trial.rivals,
        )
