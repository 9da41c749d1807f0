"""Search for missing effects: each round accepts at most one and drops those that are no longer needed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from vpm.discrepancy.confirmation.confirmation import Data, Judged, Trial, gain_at, judge
from vpm.discrepancy.diagnosis import Ambiguity, RankedCandidate, RefusedEffect
from vpm.discrepancy.screening.candidates import Key
from vpm.discrepancy.screening.probe import Probe
from vpm.discrepancy.search.candidate_choice import Accepted
from vpm.discrepancy.search.search_round import Request, Round
from vpm.discrepancy.settings import CLEAR_GAIN, LEAST_GAIN, NORMAL_95_ONE_SIDED
from vpm.errors import DivergedError, ModelError
from vpm.identify import Gain, gain, segments
from vpm.identify.identifiability import Span, is_alias
from vpm.identify.response_along_motion import answers_at_once
from vpm.identify.tangent import has_tangent
from vpm.model import Model


@dataclass(frozen=True)
class Stage:
    """Stage of the search, with its model; ``change`` is "recalibrated", "added" or "removed"."""

    change: str
    effect: str
    site: str
    judged: Judged


@dataclass(frozen=True)
class Tried:
    """Candidates that the search tried in the round before an effect came in."""

    key: Key  #: The effect.
    without: Judged  #: The model without it, everything else fitted.
    probes: tuple[Probe, ...]
    trials: tuple[Trial, ...]


@dataclass(frozen=True)
class Search:
    """Outcome of the search, also of one that Ctrl-C ended.

    ``last`` is given if nothing has changed since the last effect came in. ``left`` comes from a ranking: by joint the
    share of validation error power that effects leave. ``ranked`` is its model, and ``within_laws`` says whether it
    leaves less than the errors of laws.
    """

    stages: tuple[Stage, ...]
    accepted: tuple[Accepted, ...]
    refused: tuple[RefusedEffect, ...]
    ranking: tuple[RankedCandidate, ...]
    interrupted: bool = False
    last: Tried | None = None
    left: Mapping[str, float] = field(default_factory=dict)
    ranked: Model | None = None
    within_laws: bool = False

    @property
    def final(self) -> Judged:
        """Final model of the search."""
        return self.stages[-1].judged


def begin(start: Judged) -> Search:
    """Search that has found nothing yet."""
    return Search((Stage("recalibrated", "", "", start),), (), (), ())


def further(found: Search, data: Data, request: Request) -> Search:
    """Continue a search: add effects one at a time and drop replaced ones, until none is accepted any more.

    Removed effects do not come back.
    """
    going = _Going(found, data, request)
    interrupted = False
    try:
        while going.another():
            pass
    except KeyboardInterrupt:
        interrupted = True
    return going.outcome(interrupted=interrupted)


class _Going:
    """Search that goes on: whatever Ctrl-C interrupts, `outcome` is what is known until then."""

    def __init__(self, found: Search, data: Data, request: Request) -> None:
        self.data, self.request = data, request
        self.stages, self.accepted = list(found.stages), list(found.accepted)
        self.ranking = list[RankedCandidate]()
        self.dropped: dict[Key, str] = {}
        self.last: Tried | None = None
        self.round: Round | None = None
        self.number = 0

    def another(self) -> bool:
        """Whether one more effect comes in; those that it makes needless are dropped."""
        self.number += 1
        if self.number > 2 * self.request.limit + 1:
            return False
        outcome = self._begun()
        if len(self.accepted) >= self.request.limit or (self.accepted and outcome.done()):
            return False
        best = self._best(outcome)
        if best is None:
            return False
        self.last = Tried(best.key, outcome.current, tuple(outcome.probes), tuple(outcome.trials))
        self.accepted.append(best)
        self.stages.append(Stage("added", *best.key, best.trial.judged))
        self.request.tell(f"round {self.number}: accepted {best.label}")
        self._reconsider()
        return True

    def outcome(self, *, interrupted: bool) -> Search:
        """Search as far as it went."""
        refused = {**self.dropped, **({} if self.round is None else self.round.refused)}
        ranked = [] if self.round is None else self.round.ranked()
        return Search(
            tuple(self.stages),
            tuple(self.accepted),
            tuple(RefusedEffect(*key, reason) for key, reason in refused.items()),
            (*self.ranking, *ranked),
            interrupted,
            None if self.dropped else self.last,
        )

    def _begun(self) -> Round:
        """Next round of the search; of the one before it, only the ranking is kept."""
        if self.round is not None:
            self.ranking += self.round.ranked()
        self.round = Round(self.stages[-1].judged, self.data, self.number, self.request)
        return self.round

    def _best(self, outcome: Round) -> Accepted | None:
        """Best candidate of a search round; where it leaves most, those with a motion of their own compete too."""
        best = outcome.light(set(self.dropped))
        if best is None or outcome.weak(best):
            best = outcome.heavy(set(self.dropped)) or best
        return best

    def _reconsider(self) -> None:
        """Fit the search's new effect to the end, and drop what it makes needless."""
        stages, accepted, data = self.stages, self.accepted, self.data
        if has_tangent(accepted[-1].trial.judged.model, data.training):
            accepted[-1] = refitted(accepted[-1], data)
            stages[-1] = replace(stages[-1], judged=accepted[-1].trial.judged)
        drop_replaced(stages, accepted, data, self.dropped)
        release_shown(stages, accepted, data)


def ambiguities(accepted: Sequence[Accepted]) -> tuple[Ambiguity, ...]:
    """Ambiguities that the search saw: rivals of an accepted effect in its round, and parameters held beside it."""
    found = []
    for entry in accepted:
        candidate = entry.trial.probe.candidate
        if entry.rivals:
            reason = "they predict the validation data equally well"
            reason = "the records do not discriminate them" if entry.ranked else reason
            found.append(Ambiguity(candidate.effect.name, candidate.site, entry.rivals, reason))
        for alias in entry.trial.held:
            reason = f"{alias.parameter} was held at its start: these data show it only together with {alias.partner}"
            found.append(Ambiguity(candidate.effect.name, candidate.site, (alias.partner,), reason))
    return tuple(found)


def drop_replaced(stages: list[Stage], accepted: list[Accepted], data: Data, dropped: dict[Key, str]) -> None:
    """Backward elimination of each earlier effect without which the model predicts validation data as well.

    A parameter of a later effect may have been held because the data show it only together with the earlier effect. It
    is set free for the trial: a spring that may rest elsewhere needs no constant force beside it. One name for what two
    would say is the shorter answer. The same holds for a size, such as a difference of dry friction beside a constant
    force, which are one effect in motion. Where neither size has work to do beside it, these data do not tell, and both
    names stay. Where efforts follow at once, one step tells what does most of the work.
    """
    newest = accepted[-1]
    for entry in accepted[:-1]:
        current = stages[-1].judged
        own = set(entry.trial.parameters)
        freed = {alias.parameter for other in accepted for alias in other.trial.held if alias.partner in own}
        renamed = any(current.model.parameters[name].kind == "linear" for name in freed)
        try:
            model = current.model.without_effect(*entry.key)
            known = tuple(name for name in current.free if name in model.parameters)
            free = (*known, *sorted(name for name in freed - set(known) if name in model.parameters))
            bounds = {name: pair for name, pair in current.bounds.items() if name in free}
            if answers_at_once(current.model):
                near = judge(model, free, replace(data, simulation=None), bounds, linear_only=True)
                if _work(entry, near, current, data).relative >= CLEAR_GAIN:
                    continue
            reduced = judge(model, free, data, bounds)
        except (DivergedError, ModelError):
            continue  # without it the model cannot follow the validation data at all, or another effect cannot stand
        needless = _work(entry, reduced, current, data).relative < LEAST_GAIN
        if needless and (not renamed or _renamed(current, reduced, model, known, data)):
            accepted.remove(entry)
            accepted[:] = [_released(other, freed) for other in accepted]
            stages.append(Stage("removed", *entry.key, reduced))
            dropped[entry.key] = f"it is not needed any more beside {newest.trial.probe.candidate.label}"


def _work(entry: Accepted, reduced: Judged, current: Judged, data: Data) -> Gain:
    """Validation gain of an effect before elimination over the model without it, of all or at its joint alone."""
    site = entry.trial.probe.candidate.site
    whole = gain(reduced.validation, current.validation, segments(data.validation))
    own = gain_at(current.model, data.validation, site, reduced.validation, current.validation)
    return whole if own is None else max(whole, own, key=lambda one: one.relative)


def _renamed(current: Judged, reduced: Judged, model: Model, free: tuple[str, ...], data: Data) -> bool:
    """Whether released parameters only take over the work of an effect that elimination dropped.

    Without them, and without the effect, ``model`` with ``free`` fitted predicts the validation data worse. With them
    it simulates the validation records as well. Where there is none, as many numbers as before would tell nothing.
    """
    if current.simulated is not None and reduced.simulated is not None and data.simulation is not None:
        simulated = gain(current.simulated, reduced.simulated, segments(data.simulation))
        if simulated.relative < -LEAST_GAIN and simulated.harm > NORMAL_95_ONE_SIDED:
            return False
    bounds = {name: pair for name, pair in current.bounds.items() if name in free}
    bare = judge(model, free, replace(data, simulation=None), bounds)
    work = gain(bare.validation, reduced.validation, segments(data.validation))
    return work.relative >= LEAST_GAIN and work.score >= NORMAL_95_ONE_SIDED


def release_shown(stages: list[Stage], accepted: list[Accepted], data: Data) -> None:
    """Release after elimination what was held because something hid it that a later effect explains.

    It stays released if the model predicts validation data better with it. Without this a payload beside an unknown
    mass, named while friction was missing, never gets its place.
    """
    current = stages[-1].judged
    names = [alias.parameter for entry in accepted for alias in entry.trial.held]
    names = [name for name in dict.fromkeys(names) if name in current.model.parameters and name not in current.free]
    if not names or len(accepted) == 1:
        return
    model = current.model
    _, columns = data.training.evaluate(model, model.theta, [model.index(name) for name in names])
    known, shown = Span.of(current.fit.jacobian), list[str]()
    for name, column in zip(names, columns.T, strict=True):
        if np.any(column) and not is_alias(column, known, current.fit.residual):
            shown.append(name)
            known = known.beside(column[:, None])
    if not shown:
        return
    try:
        judged = judge(model, (*current.free, *shown), data, dict(current.bounds))
    except DivergedError:
        return
    if gain(current.validation, judged.validation, segments(data.validation)).relative > 0.0:
        stages[-1] = replace(stages[-1], judged=judged)
        accepted[:] = [_released(entry, set(shown)) for entry in accepted]


def _released(entry: Accepted, freed: set[str]) -> Accepted:
    """Accepted effect whose held parameters are released during elimination."""
    trial = entry.trial
    mine = tuple(alias.parameter for alias in trial.held if alias.parameter in freed)
    if not mine:
        return entry
    held = tuple(alias for alias in trial.held if alias.parameter not in freed)
    return replace(entry, trial=replace(trial, held=held, parameters=(*trial.parameters, *mine)))


def refitted(best: Accepted, data: Data) -> Accepted:
    """Refit before elimination, to the end, of a model that was fitted on a tangent."""
    judged = best.trial.judged
    try:
        exact = judge(judged.model, judged.free, data, dict(judged.bounds))
    except DivergedError:
        return best
    return replace(best, trial=replace(best.trial, judged=exact))
