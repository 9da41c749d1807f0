"""What a model is most probably missing, by one criterion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from vpm.discrepancy.candidates import Key, slow_speeds
from vpm.discrepancy.side_by_side import Failure, Progress, SideBySide
from vpm.errors import DiagnosisError, VpmError
from vpm.experiment import Experiment, as_records
from vpm.identify import InverseDynamicsProblem
from vpm.model import Model
from vpm.ranking.fit import Fitted, Fitter
from vpm.ranking.observed import Observed, Observer
from vpm.ranking.proposals import Proposal, proposals
from vpm.ranking.result import Ranked, Ranking
from vpm.ranking.settings import Settings
from vpm.ranking.sizes import Sizes
from vpm.ranking.structure import Structure
from vpm.simulate import Setup
from vpm.weighing import Prior

Array = NDArray[np.float64]


def rank(
    model: Model,
    experiments: Experiment | Sequence[Experiment],
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
        return _Search(model, records, settings or Settings(), setup, each, tell or (lambda _: None)).run()


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
        self.start = Structure(model, model.theta.copy(), known(model, self.data))

    def run(self) -> Ranking:
        """See `rank`."""
        self.say("fitting what is uncertain")
        found = self.fitter.settled(self.fitter.fitted(self.start, Observer(self.settings.bands[0])))
        rounds: list[tuple[Ranked, ...]] = []
        effects: list[Ranked] = []
        while len(effects) < self.settings.effects:
            found, tried = self._round(found)
            rounds.append(tuple(self._ranked(one, found) for one in tried))
            if not tried or rounds[-1][0].evidence < self.settings.odds:
                break
            best = rounds[-1][0]
            close = [one for one in rounds[-1][1:] if best.evidence - one.evidence < self.settings.same]
            rivals = tuple(f"{one.effect} at {one.site}" for one in close)
            effects.append(replace(best, rivals=rivals))
            self.say(f"{best.effect} at {best.site}: {best.evidence:.1f} nats")
            found, needless = self._without_needless(tried[0])
            effects = [one for one in effects if (one.effect, one.site) not in needless]
            if needless:
                self.say("no longer needed: " + ", ".join(" at ".join(key) for key in needless))
        model = found.structure.model.with_parameters(found.structure.values)
        return Ranking(tuple(effects), tuple(rounds), model, found.observer.band, found.log_likelihood)

    def _round(self, found: Fitted) -> tuple[Fitted, list[Fitted]]:
        """What had been found, and structures with one effect more, the most probable first; each effect once.

        What the best of them makes of the parameters that had been found may be better without it too: a fit that had
        not come to its end is no evidence for one effect more.
        """
        while True:
            tried = self._tried(found)
            if not tried or tried[0].evidence - found.evidence < self.settings.odds:
                return found, tried
            other = self._settled_without(tried[0], tried[0].structure.effects[-1])
            if other is None or other.evidence < found.evidence + self.settings.same:
                return found, tried
            found = other

    def _tried(self, found: Fitted) -> list[Fitted]:
        chosen = proposals(found, self.fitter, self.data, self.sizes, self.each)
        trials = self.each("fitting", self._fitted, chosen, lambda one: " at ".join(one.key))
        hopeful = {
            id(trial)
            for trial in trials
            if isinstance(trial, Fitted) and trial.evidence + 2.0 * trial.promise > found.evidence
        }
        several = [[one for one in fits if id(one) in hopeful] for fits in _by_effect(trials)]
        last = [one for fits in several[: self.settings.finalists] for one in fits[: self.settings.optima]]
        ends = self.each("settling", self.fitter.settled, last, lambda one: " at ".join(one.structure.effects[-1]))
        return [fits[0] for fits in _by_effect([*ends, *trials])]

    def _fitted(self, proposal: Proposal) -> Fitted:
        goal = proposal.reference.cost
        return self.fitter.searched(proposal.structure, proposal.observer, proposal.view, goal)

    def _without_needless(self, found: Fitted) -> tuple[Fitted, list[Key]]:
        """Without those of the earlier effects that a later one has made needless."""
        needless: list[Key] = []
        for key in found.structure.effects[:-1]:
            other = self._settled_without(found, key)
            if other is not None and found.evidence - other.evidence < self.settings.odds:
                found = other
                needless.append(key)
        return found, needless

    def _settled_without(self, found: Fitted, key: Key) -> Fitted | None:
        """The same without an effect; None where that runs away or another one rests on it."""
        try:
            structure = found.structure.without(key)
            return self.fitter.settled(self.fitter.fitted(structure, found.observer, found.colour))
        except (VpmError, ArithmeticError):
            return None

    @staticmethod
    def _ranked(one: Fitted, found: Fitted) -> Ranked:
        effect, site = one.structure.effects[-1]
        values = {name: value for name, value in one.structure.values.items() if name not in found.structure.priors}
        return Ranked(effect, site, one.evidence - found.evidence, values)


def _by_effect(trials: Sequence[Fitted | Failure]) -> list[list[Fitted]]:
    """The fits of each effect, the most probable first."""
    several: dict[Key, list[Fitted]] = {}
    whole = [one for one in trials if isinstance(one, Fitted) and one.structure.seen and np.isfinite(one.evidence)]
    for trial in sorted(whole, key=lambda one: -one.evidence):
        several.setdefault(trial.structure.effects[-1], []).append(trial)
    return list(several.values())


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
