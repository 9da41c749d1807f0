"""What a model is most probably missing, by one criterion."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from vpm.catalogue import EFFECTS
from vpm.discrepancy.candidates import Key, slow_speeds
from vpm.discrepancy.side_by_side import Progress, SideBySide
from vpm.errors import DiagnosisError, VpmError
from vpm.experiment import Experiment, as_records
from vpm.identify import InverseDynamicsProblem
from vpm.model import Model
from vpm.ranking.fit import ASTRAY, Fitted, Fitter, View
from vpm.ranking.judgement import Judgement
from vpm.ranking.look import Look
from vpm.ranking.noise_model import fitted_noise
from vpm.ranking.observed import Observed, Observer
from vpm.ranking.posterior import alike, probabilities
from vpm.ranking.proposals import proposals
from vpm.ranking.race import raced
from vpm.ranking.result import Ranked, Ranking
from vpm.ranking.settings import Settings
from vpm.ranking.sizes import Sizes
from vpm.ranking.structure import Structure
from vpm.ranking.validation import gaps
from vpm.simulate import Setup
from vpm.weighing import Prior

Array = NDArray[np.float64]


def rank(
    model: Model,
    experiments: Experiment | Sequence[Experiment],
    validate: Experiment | Sequence[Experiment] | None = None,
    *,
    effects: Sequence[str] | None = None,
    settings: Settings | None = None,
    setup: Setup | None = None,
    workers: int | None = None,
    tell: Callable[[str], None] | None = None,
    progress: Progress | None = None,
) -> Ranking:
    """Order what ``model`` could be missing by what it removes of the error, and add the best for as long as it counts.

    Every structure, the model with some effects, is kept on the records by a slow observer, and fitted to what that
    leaves of two thirds of each record. What decides is the error power that an effect removes, there and from the
    third that is held back. Nothing is inverted or differentiated, and neither the controller nor a start at rest is
    asked for.

    Parameters
    ----------
    model : Model
        Its uncertain parameters are fitted with every structure.
    experiments : Experiment or sequence of Experiment
        Positions of joints and commands of actuators.
    validate : Experiment or sequence of Experiment, optional
        Records that decide nothing; `Ranking.gaps` is measured on them, once, when all is found.
    effects : sequence of str, optional
        Restrict the catalogue to these names.
    settings : Settings, optional
        The numbers that decide.
    setup : Setup, optional
        Integrator and hold.
    workers : int, optional
        Structures that are fitted at a time; one per core if not given. The result does not depend on it.
    tell, progress : callable, optional
        Called with a sentence for every round, and after every structure with what is being done, its name, how many
        are done and how many there are.

    Returns
    -------
    Ranking
        Ctrl-C during the search gives what is known until then, with ``interrupted``; earlier it raises.

    Raises
    ------
    DiagnosisError
        No record was given.
    VpmError
        A channel is missing, or the model runs away from the records.

    Examples
    --------
    >>> rank(model, log).effects
    (Ranked(effect='coulomb_friction', site='axis', judgement=Judgement(removed=0.97)),)
    """
    records = as_records(experiments)
    if not records:
        raise DiagnosisError("no record was given; pass at least one experiment")
    with threadpool_limits(1, user_api="blas"):
        each = SideBySide(workers, progress)
        names = tuple(EFFECTS if effects is None else effects)
        search = _Search(model, records, names, settings or Settings(), setup, each, tell or (lambda _: None))
        # What a validation record lacks is said before the search.
        held_out = Observed(model, [] if validate is None else as_records(validate), search.settings, setup)
        return search.run(held_out)


@dataclass(frozen=True, eq=False)
class _Trial:
    """An effect beside what was found, under one observer."""

    fitted: Fitted
    look: Look
    judgement: Judgement
    evidence: float = float("nan")

    @property
    def left(self) -> float:
        """Share of the error power that it leaves."""
        return 1.0 - self.judgement.removed


class _Search:
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
        self.fitter = Fitter(Observed(model, records, settings, setup), settings)
        self.sizes = Sizes(model, self.data)
        firsts = self.fitter.observed.firsts.priors
        values = np.append(model.theta, np.zeros(len(firsts)))
        self.start = Structure(model, values, known(model, self.data) | firsts, firsts=tuple(firsts))
        self.first: dict[float, Look] = {}  # looks at the model as it was, by bandwidth

    def run(self, held_out: Observed) -> Ranking:
        """See `rank`."""
        self.say("fitting what is uncertain")
        looks = self._looks(self.start)
        self.first = {look.fitted.observer.band: look for look in looks}
        recalibrated = looks[0].fitted.structure.repaired
        effects: list[Ranked] = []
        rounds: list[tuple[Ranked, ...]] = []
        interrupted = False
        try:
            while len(effects) < self.settings.effects:
                best, tried = self._round(looks)
                rounds.append(self._listed(best, tried))
                if best is None:
                    break
                effects.append(rounds[-1][0])
                share = 100.0 * best.judgement.removed
                self.say(f"{effects[-1].effect} at {effects[-1].site}: removes {share:.3g} % of the error power")
                looks = self._looks(best.fitted.structure, best.fitted)
                looks, needless = self._without_needless(looks)
                effects = [one for one in effects if one.key not in needless]
        except KeyboardInterrupt:
            interrupted = True
        found = looks[0].fitted.structure
        stages = (self.start.model, recalibrated, found.repaired)
        left = gaps(held_out, stages, self.settings.bands[0])
        effects = [replace(one, side=found.side(one.key)) for one in effects]
        return Ranking(tuple(effects), tuple(rounds), found.repaired, recalibrated, left, interrupted)

    def _looks(self, structure: Structure, fitted: Fitted | None = None) -> list[Look]:
        """A structure under each observer that can follow it, that under which it was ``fitted`` first.

        Raises
        ------
        VpmError
            None of them can.
        """
        looks = [] if fitted is None else [self._look(fitted)]
        reason: Exception = VpmError(f"{structure.model.name} runs away from the records")
        for band in self.settings.bands:
            if fitted is None or band != fitted.observer.band:
                try:
                    looks.append(self._look(self._fitted(structure, Observer(band))))
                except ASTRAY as error:  # a slow observer may lose what hangs behind a contact
                    reason = error
        if not looks:
            raise reason
        return looks

    def _look(self, fitted: Fitted) -> Look:
        return Look(fitted, self.fitter, self.first.get(fitted.observer.band))

    def _fitted(self, structure: Structure, observer: Observer) -> Fitted:
        """A structure fitted to the end, its channels in the sizes of what it leaves at first."""
        view = View(self.fitter.noise_of(structure, observer))
        return self.fitter.finished(self.fitter.fitted(structure, observer, view), view)

    def _round(self, looks: Sequence[Look]) -> tuple[_Trial | None, list[_Trial]]:
        """The best effect more, if one counts, and all that were tried."""
        chosen = proposals(looks, self.fitter, self.data, self.sizes, self.each, self.names)
        fits = raced(chosen, self.fitter, self.each)
        tried = [_Trial(fitted, one.look, one.look.judged(fitted)) for fitted, one in fits]
        counting = [trial for trial in self._finished(tried) if self._counts(trial)]
        if not counting:
            return None, tried
        first = min(counting, key=lambda trial: trial.left)
        equal = [trial for trial in counting if trial.look is first.look and self._as_good(trial, first)]
        best = min(equal, key=_plainness)
        several = {best.fitted.key: best}
        for trial in sorted(counting, key=lambda trial: trial.left):
            if trial.look is best.look:
                several.setdefault(trial.fitted.key, trial)
        weighed = self._weighed(list(several.values()))
        return weighed[0], weighed + tried

    def _counts(self, trial: _Trial) -> bool:
        return trial.fitted.structure.within_excitation and trial.judgement.counts(self.settings)

    def _as_good(self, trial: _Trial, first: _Trial) -> bool:
        """Whether it leaves no more than what the laws of the curves that either is a part of are wrong by."""
        told = (trial.judgement, first.judgement)
        return trial.left - first.left < max(one.removed * (self.settings.inexact / one.shape) ** 2 for one in told)

    def _finished(self, tried: Sequence[_Trial]) -> list[_Trial]:
        """Those that count and leave little, fitted to the end."""
        counting = [trial for trial in tried if self._counts(trial)]
        best: dict[Look, _Trial] = {}
        for trial in sorted(counting, key=lambda trial: trial.left):
            best.setdefault(trial.look, trial)
        hopeful = [
            trial
            for trial in counting
            if trial.left <= self.settings.finished * best[trial.look].left or self._as_good(trial, best[trial.look])
        ]

        def one_finished(trial: _Trial) -> _Trial:
            fitted = self.fitter.finished(trial.fitted, View(trial.look.view.noise))
            return replace(trial, fitted=fitted, judgement=trial.look.judged(fitted))

        ends = self.each("finishing", one_finished, hopeful, lambda trial: " at ".join(trial.fitted.key))
        return [end for end in ends if isinstance(end, _Trial)]

    def _weighed(self, trials: Sequence[_Trial]) -> list[_Trial]:
        """With the evidence that each adds, under the noise model of the first."""
        observed = self.fitter.observed
        noise = fitted_noise(trials[0].fitted.residual, observed.parts, self.settings.order)
        without = self.fitter.evidence(trials[0].look.fitted, noise)
        return [replace(trial, evidence=self.fitter.evidence(trial.fitted, noise) - without) for trial in trials]

    def _without_needless(self, looks: list[Look]) -> tuple[list[Look], list[Key]]:
        """Without those of the earlier effects that a later one has made needless."""
        needless: list[Key] = []
        for key in looks[0].fitted.structure.effects[:-1]:
            with contextlib.suppress(*ASTRAY):  # it runs away without, or another one rests on it
                without = self._fitted(looks[0].fitted.structure.without(key), looks[0].fitted.observer)
                if not self._look(without).judged(looks[0].fitted).counts(self.settings):
                    looks = self._looks(without.structure, without)
                    needless.append(key)
                    self.say(f"no longer needed: {' at '.join(key)}")
        return looks, needless

    def _listed(self, best: _Trial | None, tried: Sequence[_Trial]) -> tuple[Ranked, ...]:
        """All effects that were tried, what was added first, then those that leave least."""
        several: dict[Key, Ranked] = {}
        weighed = [trial for trial in tried if np.isfinite(trial.evidence)]
        *shares, _ = probabilities([trial.evidence - self.settings.odds for trial in weighed], self.settings.tempering)
        probability = {id(trial): float(share) for trial, share in zip(weighed, shares, strict=True)}
        for trial in sorted(tried, key=lambda trial: (trial is not best, trial.left)):
            ranked = self._ranked(trial, probability.get(id(trial), np.nan))
            several.setdefault(ranked.key, ranked)
        listed = tuple(several.values())
        if best is None:
            return listed
        return (replace(listed[0], rivals=self._rivals(best, weighed)), *listed[1:])

    def _rivals(self, best: _Trial, weighed: Sequence[_Trial]) -> tuple[str, ...]:
        """Effects that the records cannot tell from the best."""
        noise = fitted_noise(best.fitted.residual, self.fitter.observed.parts, self.settings.order)
        others = [trial.fitted for trial in weighed if trial.fitted.key != best.fitted.key]
        close = alike(best.fitted, others, self.fitter, noise, self.settings.same)
        return tuple(dict.fromkeys(" at ".join(one.key) for one in close))

    def _ranked(self, trial: _Trial, probability: float) -> Ranked:
        structure, without = trial.fitted.structure, trial.look.fitted.structure
        values = {name: value for name, value in structure.values.items() if name not in without.priors}
        side, band = structure.side(trial.fitted.key), trial.fitted.observer.band
        return Ranked(
            *trial.fitted.key,
            values,
            trial.judgement,
            band,
            side,
            trial.evidence,
            probability,
        )


def _plainness(trial: _Trial) -> tuple[bool, int, float]:
    """Orders what removes the same: the machine before its instruments, then fewer numbers."""
    name, _ = trial.fitted.key
    return EFFECTS[name].site == "sensor", len(trial.fitted.structure.priors), trial.left


def known(model: Model, data: InverseDynamicsProblem) -> dict[str, Prior]:
    """What the model file says of its parameters, and the speeds at which its dry friction turns round.

    Nobody knows these, and a wrong one leaves a gap at every reversal, where the finer effects live.
    """
    priors = {
        p.name: Prior(p.value, p.uncertainty, p.minimum, p.maximum)
        for p in model.parameters.values()
        if p.adjustable and p.uncertainty and np.isfinite(p.uncertainty)
    }
    for effect in model.effects:
        name = effect.parameter_names.get("transition_velocity")
        if name is None or name in priors or effect.at not in data.joints:
            continue
        joint = data.joints.index(effect.at)
        speeds = np.concatenate([np.abs(data.state(record)[1][:, joint]) for record in range(len(data.motions))])
        low, high = slow_speeds(float(np.quantile(speeds, 0.999)))
        spread = 0.25 * float(np.log(high / low))
        priors[name] = Prior(float(np.sqrt(low * high)), spread, low, high, logarithmic=True)
    return priors
