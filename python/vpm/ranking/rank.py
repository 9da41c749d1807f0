"""What a model is most probably missing, by one criterion."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from vpm.catalogue import EFFECTS
from vpm.discrepancy.candidates import Key, slow_speeds
from vpm.discrepancy.side_by_side import Progress, SideBySide
from vpm.errors import DiagnosisError
from vpm.experiment import Experiment, as_records
from vpm.identify import InverseDynamicsProblem
from vpm.model import Model
from vpm.ranking.fit import ASTRAY, Fitted, Fitter
from vpm.ranking.observed import Observed, Observer
from vpm.ranking.posterior import alike, probabilities
from vpm.ranking.proposals import SIDES, proposals
from vpm.ranking.race import raced
from vpm.ranking.result import Ranked, Ranking
from vpm.ranking.settings import Settings
from vpm.ranking.sizes import Sizes
from vpm.ranking.structure import Structure, sides_taken
from vpm.ranking.validation import gaps
from vpm.simulate import Setup
from vpm.weighing import Prior

Array = NDArray[np.float64]


def rank(
    model: Model,
    experiments: Experiment | Sequence[Experiment],
    validate: Experiment | Sequence[Experiment] | None = None,
    *,
    settings: Settings | None = None,
    setup: Setup | None = None,
    workers: int | None = None,
    tell: Callable[[str], None] | None = None,
    progress: Progress | None = None,
) -> Ranking:
    """Order what ``model`` could be missing by its evidence in records, and add the best for as long as it pays.

    Every structure, the model with some effects, is kept on the records by the same observer, and what is left of each
    channel is whitened by an autoregression of its own. Evidence is the logarithm of the probability density of the
    records, by Laplace's method about the most probable values (D. MacKay, *Neural Computation* 4, 1992). Nothing is
    inverted or differentiated, and neither the controller nor a start at rest is asked for.

    Parameters
    ----------
    model : Model
        Its uncertain parameters are fitted with every structure.
    experiments : Experiment or sequence of Experiment
        Positions of joints and commands of actuators; all of them are fitted.
    validate : Experiment or sequence of Experiment, optional
        Records that decide nothing; `Ranking.gaps` is measured on them, once, when all is found.
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

    Raises
    ------
    DiagnosisError
        No record was given.
    VpmError
        A channel is missing, or the model runs away from the records.

    Examples
    --------
    >>> rank(model, log).effects
    (Ranked(effect='coulomb_friction', site='axis', evidence=2091.0),)
    """
    records = as_records(experiments)
    if not records:
        raise DiagnosisError("no record was given; pass at least one experiment")
    with threadpool_limits(1, user_api="blas"):
        each = SideBySide(workers, progress)
        search = _Search(model, records, settings or Settings(), setup, each, tell or (lambda _: None))
        # What a validation record lacks is said before the search.
        held_out = Observed(model, [] if validate is None else as_records(validate), search.settings, setup)
        return search.run(held_out)


class _Search:
    """Structures that grow by one effect at a time."""

    def __init__(
        self,
        model: Model,
        records: Sequence[Experiment],
        settings: Settings,
        setup: Setup | None,
        each: SideBySide,
        say: Callable[[str], None],
    ) -> None:
        self.settings, self.each, self.say = settings, each, say
        self.data = InverseDynamicsProblem(model, records)
        self.fitter = Fitter(Observed(model, records, settings, setup), settings)
        self.sizes = Sizes(model, self.data)
        firsts = self.fitter.observed.firsts.priors
        values = np.append(model.theta, np.zeros(len(firsts)))
        self.start = Structure(model, values, known(model, self.data) | firsts, firsts=tuple(firsts))
        self.bare = 0.0  # log likelihood of the records without any effect
        self.effects: list[Ranked] = []  # what was added

    def run(self, held_out: Observed) -> Ranking:
        """See `rank`."""
        self.say("fitting what is uncertain")
        found = recalibrated = self.fitter.finished(self.fitter.fitted(self.start, Observer(self.settings.bands[0])))
        rounds: list[tuple[Ranked, ...]] = []
        complete = np.nan
        while len(self.effects) < self.settings.effects:
            found, best, tried = self._round(found)
            recalibrated = found if not found.structure.effects else recalibrated
            listed, nothing = self._listed(found, best, tried)
            rounds.append(listed)
            if best is None:
                complete = nothing
                break
            self.effects.append(listed[0])
            self.say(f"{listed[0].effect} at {listed[0].site}: {listed[0].evidence:.1f} nats")
            found, needless = self._without_needless(best)
            self.effects = [one for one in self.effects if one.key not in needless]
            if needless:
                self.say("no longer needed: " + ", ".join(" at ".join(key) for key in needless))
        stages = (self.start.model, recalibrated.structure.repaired, found.structure.repaired)
        left = gaps(held_out, stages, found.observer, self.settings.bands[0])
        return Ranking(
            tuple(replace(one, side=found.structure.side(one.key)) for one in self.effects),
            tuple(rounds),
            stages[-1],
            found.observer.band,
            found.log_likelihood,
            complete,
            left,
        )

    def _listed(self, found: Fitted, best: Fitted | None, tried: Sequence[Fitted]) -> tuple[tuple[Ranked, ...], float]:
        """All effects that were tried, the best first, with their probabilities; and that of nothing being missing."""
        coarse = self.fitter.equally_coarse(found)
        ranked = [self._ranked(one, coarse) for one in tried]
        if best is not None:
            others = [one for one in ranked if one.key != best.key]
            ranked = [replace(self._ranked(best, found), rivals=self._rivals(best.key, tried)), *others]
        gains = [one.evidence - one.needed for one in ranked]
        *shares, nothing = probabilities(gains, self.settings.tempering).tolist()
        return tuple(replace(one, probability=share) for one, share in zip(ranked, shares, strict=True)), nothing

    def _rivals(self, key: Key, tried: Sequence[Fitted]) -> tuple[str, ...]:
        """Effects that the records cannot tell from one of those that were tried."""
        own = next(one for one in tried if one.key == key)
        close = [one for one in tried if one is not own and abs(one.evidence - own.evidence) < self.settings.odds]
        return tuple(" at ".join(one.key) for one in alike(own, close, self.fitter, self.settings.same))

    def _round(self, found: Fitted) -> tuple[Fitted, Fitted | None, list[Fitted]]:
        """What had been found, with the best effect more if one pays, and all that were tried, the most probable first.

        What an effect makes of the parameters that had been found may be better without it too: a fit that had not come
        to its end is no evidence for one effect more, and if that takes all that it brought, all are tried again.
        """
        while True:
            if not found.structure.effects:
                self.bare = found.log_likelihood
            coarse = self.fitter.equally_coarse(found)
            tried = self._tried(coarse)
            price = {one.key: self._price(found, one.key) for one in tried}
            worth = sorted(tried, key=lambda one: price[one.key] - one.evidence)
            for one in worth[: self.settings.finalists]:
                if one.evidence - coarse.evidence < price[one.key]:
                    return found, None, tried
                best = self._turned(self.fitter.finished(one), one.key[1])
                without, before = self._without(best, one.key), found
                if without is not None and (without := self._turned(without, one.key[1])).evidence > found.evidence:
                    found = without
                again = found.evidence > before.evidence + self.settings.odds
                if best.evidence - found.evidence >= self._price(found, one.key):
                    return found, self._anew(best, found) if again else best, tried
                if again:
                    break
            else:
                return found, None, tried

    def _anew(self, best: Fitted, found: Fitted) -> Fitted:
        """The last effect fitted once more from its start values, beside a fit of all others that came further."""
        tried = self._tried(self.fitter.equally_coarse(found), best.key)
        ends = [self._turned(self.fitter.finished(one), one.key[1]) for one in tried]
        return max([best, *ends], key=lambda one: one.evidence)

    def _price(self, found: Fitted, key: Key) -> float:
        """Evidence that another effect has to bring, nats.

        No law is exact. What those that were found do otherwise has a share of the power that they explain beside the
        noise, and an effect that takes up no more than that is none. The share is larger for an effect at the same site
        that shows over the same state: one curve with two shapes.
        """
        curve = [one for one in self.effects if one.site == key[1] and _states(one.key) & _states(key)]
        anywhere = self._otherwise(max(found.log_likelihood - self.bare, 0.0), self.settings.inexact)
        along = self._otherwise(sum(one.evidence for one in curve), self.settings.inexact_curve)
        return self.settings.odds + max(anywhere, along)

    def _otherwise(self, explained: float, share: float) -> float:
        """Nats in this share of a power, of which so many nats tell the ratio to the noise."""
        samples = sum(int(part.stop - part.start) for part in self.fitter.observed.parts)
        power = float(np.expm1(min(2.0 * explained / samples, 700.0)))
        return 0.5 * samples * float(np.log1p(share**2 * power))

    def _tried(self, found: Fitted, only: Key | None = None) -> list[Fitted]:
        chosen = proposals(found, self.fitter, self.data, self.sizes, self.each, only)
        needed = [found.evidence + self._price(found, one.key) for one in chosen]
        trials = raced(chosen, needed, self.fitter, self.each)
        hopeful = [
            trial
            for trial, proposal in trials
            if trial.evidence + 2.0 * trial.predicted_gain > proposal.reference.fitted.evidence
        ]
        several = [_distinct(fits)[: self.settings.optima] for fits in _by_effect(hopeful)]
        refined = self._refined(several[: self.settings.finalists])
        return [fits[0] for fits in _by_effect([*refined, *(trial for trial, _ in trials)])]

    def _refined(self, several: Sequence[Sequence[Fitted]]) -> list[Fitted]:
        """Fits of the first of these effects refined, and those of the others that may come as far by as much."""
        first = [one for fits in several[:1] for one in fits]
        ends = self._each_refined(first)
        lift = max((end.evidence - one.evidence for end, one in zip(ends, first, strict=True)), default=0.0)
        best = max((end.evidence for end in ends), default=-np.inf)
        others = [one for fits in several[1:] for one in fits if one.evidence + lift > best]
        return ends + self._each_refined(others)

    def _each_refined(self, fits: Sequence[Fitted]) -> list[Fitted]:
        """Each refined, or as it was where that cannot be computed."""
        ends = self.each("refining", self.fitter.refined, fits, lambda one: " at ".join(one.key))
        return [end if isinstance(end, Fitted) else one for end, one in zip(ends, fits, strict=True)]

    def _without_needless(self, found: Fitted) -> tuple[Fitted, list[Key]]:
        """Without those of the earlier effects that a later one has made needless."""
        needless: list[Key] = []
        for key in found.structure.effects[:-1]:
            other = self._without(found, key)
            if other is not None and found.evidence - other.evidence < self.settings.odds:
                found = other
                needless.append(key)
        return found, needless

    def _without(self, found: Fitted, key: Key) -> Fitted | None:
        """The same without an effect; None where that runs away or another one rests on it."""
        try:
            return self.fitter.without(found, key)
        except ASTRAY:
            return None

    def _turned(self, found: Fitted, joint: str) -> Fitted:
        """With what acts at a joint on its other side, where it has two and that is better."""
        model = found.structure.model
        sides = sides_taken(model, joint)
        if not sides or not model.joint_behind(joint):
            return found
        turned = [found]
        for side in SIDES:
            with contextlib.suppress(*ASTRAY):
                if sides != {side}:
                    other = self.fitter.fitted(found.structure.beside(joint, side), found.observer, found.noise)
                    turned.append(self.fitter.finished(other))
        return max(turned, key=lambda one: one.evidence)

    def _ranked(self, one: Fitted, found: Fitted) -> Ranked:
        values = {name: value for name, value in one.structure.values.items() if name not in found.structure.priors}
        needed, side = self._price(found, one.key), one.structure.side(one.key)
        return Ranked(*one.key, one.evidence - found.evidence, values, needed=needed, side=side)


def _states(key: Key) -> set[str]:
    """States over which an effect shows."""
    return set(EFFECTS[key[0]].signature.lives_in)


def _by_effect(trials: Sequence[Fitted]) -> list[list[Fitted]]:
    """The fits of each effect, the most probable first."""
    several: dict[Key, list[Fitted]] = {}
    whole = [one for one in trials if one.structure.within_excitation and np.isfinite(one.evidence)]
    for trial in sorted(whole, key=lambda one: -one.evidence):
        several.setdefault(trial.key, []).append(trial)
    return list(several.values())


def _distinct(fits: Sequence[Fitted]) -> list[Fitted]:
    """Without those that ended where another one did."""
    ends: dict[tuple[Observer, float], Fitted] = {}
    for one in fits:
        ends.setdefault((one.observer, round(one.evidence, 1)), one)
    return list(ends.values())


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
