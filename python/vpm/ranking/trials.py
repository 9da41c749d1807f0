"""Trials of effects in a ranking: fits of structures under trackers, looks at them, and what they are worth."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from vpm.catalogue import EFFECTS
from vpm.catalogue.kinds import Side
from vpm.discrepancy.parallel_candidates import ParallelCandidates
from vpm.discrepancy.screening.candidates import Key
from vpm.errors import VpmError
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.ranking.choice_by_evidence import as_good, evidence, weighed
from vpm.ranking.fit import ASTRAY, Fitted, Fitter, View
from vpm.ranking.free_shape import against_free_shapes
from vpm.ranking.look import Look
from vpm.ranking.model_structure import Structure
from vpm.ranking.noise_model import fitted_noise
from vpm.ranking.own_vibration import below_own_vibration
from vpm.ranking.parameter_priors import Sizes, known
from vpm.ranking.posterior import robust_probabilities
from vpm.ranking.proposal_fits import raced
from vpm.ranking.proposals import proposals
from vpm.ranking.result import Ranked
from vpm.ranking.settings import OF_PRESSURES, Settings
from vpm.ranking.short_waves import wider_bands
from vpm.ranking.structure_extensions import Extensions
from vpm.ranking.substitute_records import shown, why_unbalanced
from vpm.ranking.tracked_records import TrackedRecords, Tracker
from vpm.ranking.tried_effect import Trial
from vpm.ranking.validation_errors import powers
from vpm.simulate import Setup


class Trials:
    """Trials of effects beside a structure: it is fitted, looked at, and weighed with each of them."""

    def __init__(
        self,
        model: Model,
        records: Sequence[Experiment],
        names: Sequence[str],
        settings: Settings,
        setup: Setup | None,
        each: ParallelCandidates,
        say: Callable[[str], None],
        unseen: Sequence[Experiment] = (),
    ) -> None:
        settings = below_own_vibration(settings, model, records)
        self.names, self.settings, self.each, self.say = names, settings, each, say
        self.fitter = Fitter(TrackedRecords(model, records, settings, setup), settings)
        self.held_out = TrackedRecords(model, unseen, settings, setup)
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
        self.rubbing: Structure | None = None  # with the usual friction of several joints that lack it
        self.others: dict[Key, list[Structure]] = {}  # what counted as well when an effect came in

    def draw_pressures(self, structure: Structure) -> Fitted | None:
        """Draw pressures, in all trials, with the bandwidth under which a structure makes the records most probable.

        Pressures that are drawn too slowly are what the model makes of noise of its drive, and those that are drawn too
        fast pass on noise of gauges. Either pushes the joints, and shows at the gauges. The least error would be
        another choice: slow ones hide a missing force, for oil that gives way takes it.

        The result is the structure as it was fitted, if the bandwidth is another one than before.
        """
        was = self.fitter
        if was.tracked.drawn_to == was.tracked.drawn_joints:
            return None
        told: list[tuple[float, Fitter, Fitted]] = []
        for band in OF_PRESSURES:
            self.fitter = Fitter(was.tracked.with_pressures(band), self.settings)
            with contextlib.suppress(*ASTRAY):
                fitted = self.fitted(structure, Tracker(self.settings.bands[0]))
                told.append((self.predictive_density(fitted), self.fitter, fitted))
        self.fitter = was
        if not told:
            return None
        _, fitter, fitted = max(told, key=lambda one: one[0])
        if fitter.tracked.of_pressures == was.tracked.of_pressures:
            return None
        self.fitter = fitter
        return fitted

    def looks(self, structure: Structure, known: Look | None = None) -> list[Look]:
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
                    looks.append(self.look(self.fitted(begun, Tracker(band))))
                except ASTRAY as error:
                    reason = error
        if not looks:
            raise reason
        looks = [look for look in looks if look.follows and not self._falls(look, looks)] or looks[-1:]
        return [look for look in looks if not any(self._predicts_worse(look, other) for other in looks)]

    def _falls(self, look: Look, others: Sequence[Look]) -> bool:
        """Whether a machine of the search falls over under a look's tracker, with values by which a faster one follows.

        What is left then says where noise led the model, and an effect that holds it up passes for missing.
        """
        faster = [one for one in others if one.follows and one.fitted.tracker.band > look.fitted.tracker.band]
        with contextlib.suppress(*ASTRAY):
            if not faster:
                return False
            known = faster[-1].fitted.structure
            return self.fitter.tracked.falls(known.model, known.theta, look.fitted.tracker)
        return True

    def _predicts_worse(self, look: Look, slower: Look) -> bool:
        """Whether a fast look of the search makes the records clearly less probable than a slower one.

        A tracker moves its model by the noise of sensors, too. Where that outweighs the errors that it corrects, a
        structure leaves less by answering less to noise, and its values lead astray. Predictions of the same samples
        are compared, each whitened by its own spectrum (A. Dawid, *J. Royal Statistical Society A* 147, 1984).
        """
        if look.fitted.tracker.band <= slower.fitted.tracker.band:
            return False
        told = (self.predictive_density(one.fitted) for one in (look, slower))
        return next(told) + self.settings.odds < next(told)

    def predictive_density(self, fitted: Fitted) -> float:
        """Log-density of the fitted samples as a tracker predicts them, whitened by their own spectrum."""
        noise = fitted_noise(fitted.residual, self.fitter.tracked.parts, self.settings.order)
        return float(np.sum(self.fitter.log_density(fitted, noise)))

    def all_looks(self, look: Look) -> list[Look]:
        """Looks at a tried structure under each tracker, one of which is known."""
        return self.looks(look.fitted.structure, look)

    def look(self, fitted: Fitted) -> Look:
        """Look at a tried structure as it was fitted, from which the search can go on.

        Raises
        ------
        VpmError
            Its derivatives run away from the records.
        """
        found = self.glance(fitted)
        _ = found.start
        return found

    def glance(self, fitted: Fitted) -> Look:
        """Look at a tried structure beside which others are judged, and no more."""
        return Look(fitted, self.fitter, self.first.get(fitted.tracker.band))

    def fitted(self, structure: Structure, tracker: Tracker) -> Fitted:
        """Fit of a structure to the end in the search, with channels scaled by their first residual."""
        view = View(self.fitter.noise_of(structure, tracker))
        return self.fitter.finished(self.fitter.fitted(structure, tracker, view), view)

    def without(self, key: Key, look: Look, side: Side | None = None) -> Look:
        """Searched structure without one effect, fitted again under its tracker, to judge that by."""
        return self.glance(self.fitted(look.fitted.structure.without(key, side), look.fitted.tracker))

    def tried(
        self, look: Look, begun: Look, names: Sequence[str] | None = None, beside: Fitted | None = None
    ) -> list[Trial]:
        """Most promising effects of a search round, fitted under one tracker from the structure that was ``begun``.

        They race with a fit that was made ``beside`` them, if one is given.
        """
        asked = self.names if names is None else names
        chosen = proposals(begun, self.fitter, self.data, self.extensions, self.each, asked, self.bands)
        saved = 0.0 if beside is None else begun.saved_by(beside)
        fits = raced(chosen, begun, self.fitter, self.each, saved)
        if fits and begun is not look:  # they begin far away, and take more steps
            best = min(fits, key=lambda one: one.cost)
            fits = [self.fitter.finished(best, View(begun.noise)), *(one for one in fits if one is not best)]
        return [Trial.of(fitted, look, ended=False) for fitted in fits]

    def finished(self, tried: Sequence[Trial]) -> list[Trial]:
        """Fits of one tracker in a search round that are worth it, finished to the end."""
        worth = [t for t in tried if t.judgement.removed > self.settings.worth and t.fitted.structure.shows(t.key)]
        if not worth:
            return []
        best = min(worth, key=lambda trial: trial.left)
        most = self.settings.finished * best.left
        hopeful = [
            t
            for t in worth
            if t.left <= most
            or as_good(t, best, self.settings)
            or best.contains(t)
            or t.look.leaves_little(t.fitted)  # it may have been given up ahead of its end
        ]

        def one_finished(trial: Trial) -> Trial:
            view = View(trial.look.noise)
            fitted = self.fitter.finished(trial.fitted, view)
            ends = [fitted, *self._detours(fitted, view)] if trial.moves_apart else [fitted]
            return Trial.of(min(ends, key=lambda one: one.cost), trial.look)

        ends = self.each("finishing", one_finished, _foremost(hopeful), lambda trial: trial.label)
        return [end for end in ends if isinstance(end, Trial)]

    @property
    def held_out_as_fitted(self) -> TrackedRecords:
        """Validation records of the search, with commands and pressures between samples as fits have them."""
        tracked = self.fitter.tracked
        return self.held_out.with_hold(tracked.setup.course).with_pressures(tracked.of_pressures)

    def against_validation(self, trial: Trial) -> Trial:
        """Trial of the search that counts, refuted where its effect does harm to validation records.

        What makes up for errors of laws in some motions is wrong in others. Of what is missing, records that do not
        excite it say nothing: an effect has to add as much to the error power there as it had to remove.
        """
        if not trial.counts or not self.held_out.records:
            return trial
        held_out, band = self.held_out_as_fitted, trial.fitted.tracker.band
        without, with_it = (powers(held_out, one.structure.repaired, band) for one in (trial.look.fitted, trial.fitted))
        added = float(np.prod(with_it / np.maximum(without, 1e-300))) - 1.0
        if not added > self.settings.worth:
            return trial
        return replace(trial, judgement=replace(trial.judgement, refuted=added))

    def examined(self, trial: Trial) -> Trial:
        """Trial of the search that counts, asked what it explains of noise, and what other shapes would do."""
        judged = replace(trial.judgement, apart=self._stays_apart(trial))
        return against_free_shapes(replace(trial, judgement=judged).beside_mirror_image, self.fitter)

    def _stays_apart(self, trial: Trial) -> bool:
        """Whether contacts of a tried effect of the search never meet, as the slowest tracker moves them.

        Far from its contacts a backlash passes on a little by their roundings, in proportion to its way. It may be as
        stiff there as the spring that is missing.
        """
        structure, (name, site) = trial.fitted.structure, trial.key
        if not EFFECTS[name].has_play or (behind := structure.model.joint_behind(site)) is None:
            return False
        model = structure.repaired
        gap = model.parameters[model.effect(name, site, structure.side(trial.key)).parameter_names["gap"]].value
        ways = self.fitter.tracked.outputs(model, [f"{behind}.position"])
        return any(float(np.max(np.abs(way))) < 0.5 * gap for way in ways)

    def by_its_own_size(self, trial: Trial) -> Trial:
        """Trial of the search whose effect is as large as it is in its own structure, if its look is none to go by.

        Known parameters may take most of an effect's place by values that the model file rules out. What it does
        beside those is then as little as what a law is wrong by.
        """
        looked, own = trial.look.fitted.structure, trial.fitted.structure
        if looked.doubt - own.doubt <= self.settings.odds:
            return trial
        size = max(trial.judgement.size, self.glance(trial.fitted).size_of(trial.key))
        return replace(trial, judgement=replace(trial.judgement, size=size))

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
            quick = self.fitted(fitted.structure, detour).structure
            return [self.fitter.finished(self.fitter.fitted(quick, fitted.tracker, view), view)]
        except ASTRAY:
            return []

    def in_its_place(self, look: Look, others: Sequence[Structure]) -> list[Trial]:
        """Last effects of other structures in the place of a searched one, fitted."""

        def one_fitted(other: Structure) -> Trial:
            structure, view = look.fitted.structure.with_last_of(other), View(look.noise)
            fitted = self.fitter.fitted(structure, look.fitted.tracker, view, rough=True)
            return Trial.of(fitted, look, ended=False)

        ends = self.each("exchanging", one_fitted, others, lambda other: " at ".join(other.effects[-1]))
        return self.finished([end for end in ends if isinstance(end, Trial)])

    def weighed_beside_others(self, key: Key, look: Look) -> Trial:
        """Effect of a searched structure with its evidence, judged against the structure without it."""
        return weighed([Trial.of(look.fitted, self.without(key, look), key).beside_mirror_image], self.fitter)[0]

    def advantage(self, fitted: Fitted, other: Fitted) -> float:
        """Evidence of a fit of the search over another one under the same tracker, nats, each under its own noise.

        Under the noise of the one, what it leaves passes for noise, however much of it the other explains.
        """
        return self.own_evidence(fitted) - self.own_evidence(other)

    def own_evidence(self, fitted: Fitted) -> float:
        """Evidence of a fit of the search under the noise that it leaves, nats."""
        return evidence(
            fitted, self.fitter, fitted_noise(fitted.residual, self.fitter.tracked.parts, self.settings.order)
        )

    def stands(self, trial: Trial) -> bool:
        """Whether a weighed effect of the search counts and is more probable than chance."""
        return trial.counts and trial.evidence > self.settings.odds

    def listed(self, best: Trial | None, tried: Sequence[Trial]) -> tuple[Ranked, ...]:
        """All effects that the search tried: the accepted one, what was weighed, then by the error that they leave."""
        several: dict[Key, Ranked] = {}
        told = [trial for trial in tried if np.isfinite(trial.evidence)]
        gains = [trial.evidence - self.settings.odds for trial in told]
        *shares, _, _ = robust_probabilities(gains, self.settings.tempering, self.settings.astray)
        probability = {id(trial): float(share) for trial, share in zip(told, shares, strict=True)}
        labels = {trial.label: probability[id(trial)] for trial in told}
        for trial in sorted(tried, key=lambda trial: (trial is not best, np.isnan(trial.evidence), trial.left)):
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


def _foremost(trials: Sequence[Trial]) -> list[Trial]:
    """Fits of a search round, of each effect the one that has come farthest: most others end there, too.

    Where a joint is split all are kept, for impacts let fits end in many places.
    """
    best: dict[tuple[Key, Side], Trial] = {}
    for trial in sorted(trials, key=lambda one: one.fitted.cost):
        best.setdefault((trial.key, trial.fitted.structure.side(trial.key)), trial)
    return [trial for trial in trials if trial.moves_apart or trial in best.values()]
