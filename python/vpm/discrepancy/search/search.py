"""Search for missing effects: each round accepts at most one and drops those that are no longer needed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from vpm.discrepancy.confirmation.confirmation import Data, Judged, Trial
from vpm.discrepancy.diagnosis import Ambiguity, RankedCandidate, RefusedEffect
from vpm.discrepancy.parallel_candidates import ParallelCandidates
from vpm.discrepancy.screening.candidates import Key
from vpm.discrepancy.screening.probe import Probe
from vpm.discrepancy.search.backward_elimination import (
    Stage,
    drop_replaced,
    drop_springs,
    refitted,
    release_shown,
    without_tight_bounds,
)
from vpm.discrepancy.search.candidate_choice import Accepted
from vpm.discrepancy.search.effect_pair import Pair, together
from vpm.discrepancy.search.search_round import Round, Tell
from vpm.identify.tangent import has_tangent
from vpm.model import Model


@dataclass(frozen=True)
class Tried:
    """Candidates that the search tried in the round before an effect came in."""

    key: Key  #: The effect.
    without: Judged  #: The model without it, everything else fitted.
    probes: tuple[Probe, ...]
    trials: tuple[Trial, ...]


@dataclass(frozen=True)
class Over:
    """Last round of the search: candidates that it screened and refitted in vain."""

    probes: tuple[Probe, ...] = ()
    trials: tuple[Trial, ...] = ()


@dataclass(frozen=True)
class Search:
    """Outcome of the search, also of one that Ctrl-C ended.

    ``last`` is given if nothing has changed since the last effect came in; ``over`` is the last round, if it accepted
    nothing. ``left`` comes from a ranking: by joint the share of validation error power that effects leave. ``ranked``
    is its model, and ``within_laws`` says whether it leaves less than the errors of laws.
    """

    stages: tuple[Stage, ...]
    accepted: tuple[Accepted, ...]
    refused: tuple[RefusedEffect, ...]
    ranking: tuple[RankedCandidate, ...]
    interrupted: bool = False
    last: Tried | None = None
    over: Over = field(default_factory=Over)
    left: Mapping[str, float] = field(default_factory=dict)
    ranked: Model | None = None
    within_laws: bool = False

    @property
    def gone(self) -> set[Key]:
        """Effects that the search removed again, which do not come back."""
        removed = {(stage.effect, stage.site) for stage in self.stages if stage.change == "removed"}
        return removed - {entry.key for entry in self.accepted}

    @property
    def final(self) -> Judged:
        """Final model of the search."""
        return self.stages[-1].judged


def begin(start: Judged) -> Search:
    """Search that has found nothing yet."""
    return Search((Stage("recalibrated", "", "", start),), (), (), ())


def further(
    found: Search, data: Data, effects: Sequence[str] | None, limit: int, tell: Tell, each: ParallelCandidates
) -> Search:
    """Continue a search: add effects one at a time and drop replaced ones, until none is accepted any more.

    Removed effects do not come back.
    A new effect in the place of another one leaves what the other one had covered. A second effect that was refused
    before may be clear in that.
    """
    stages, accepted, ranking = list(found.stages), list(found.accepted), list(found.ranking)
    dropped = {(r.name, r.site): r.reason for r in found.refused if (r.name, r.site) in found.gone}
    refused: dict[Key, str] = {}
    last: Tried | None = None
    over = Over()
    interrupted = False
    first = 1 + max((candidate.round for candidate in ranking), default=0)
    waiting, tried = list[Key](), 0  # what a round would have accepted at other joints, too, and of how many
    for number in range(first, 2 * limit + 2):
        outcome = Round(stages[-1].judged, data, number, tell, each, tried)
        best, pair, again = None, None, False
        try:
            if len(accepted) < limit and not (accepted and outcome.done()):
                best = _next(outcome, waiting, dropped)
                again = best is not None
                if not again:
                    outcome = Round(stages[-1].judged, data, number, tell, each)
                    best, pair = _whole(outcome, effects, set(dropped), several=len(accepted) + 1 < limit)
                    waiting = outcome.elsewhere(best) if best is not None and pair is None else []
                    tried = outcome.tried
        except KeyboardInterrupt:
            interrupted = True
        ranking += outcome.ranked()
        if pair is not None:
            accepted.append(pair.first)
            stages.append(Stage("added", *pair.first.key, pair.first.trial.judged))
            tell(f"round {number}: accepted {pair.first.trial.probe.candidate.label}, beside another one")
            outcome, best = pair.outcome, pair.second
            ranking += outcome.ranked()
        refused = outcome.refused
        if best is None:
            over = Over(tuple(outcome.probes), tuple(outcome.trials))
            break
        # Beside the first of a pair, and in a round of a few, little else was tried.
        known = Tried(best.key, outcome.current, tuple(outcome.probes), tuple(outcome.trials))
        last = known if pair is None and not again else None
        accepted.append(best)
        stages.append(Stage("added", *best.key, best.trial.judged))
        try:
            tell(f"round {number}: accepted {best.trial.probe.candidate.label}")
            _reconsidered(stages, accepted, data, dropped)
        except KeyboardInterrupt:
            interrupted = True
        if interrupted:
            break
    try:
        if not interrupted:
            stages[-1], same = _loosened(stages[-1], data)
            last = last if same and not dropped else None
    except KeyboardInterrupt:
        interrupted = True
    return Search(
        tuple(stages), tuple(accepted), _listed({**dropped, **refused}), tuple(ranking), interrupted, last, over
    )


def _next(outcome: Round, waiting: list[Key], dropped: Mapping[Key, str]) -> Accepted | None:
    """First candidate that still waits for the search and is accepted beside what came in meanwhile."""
    while waiting:
        key = waiting.pop(0)
        if key not in dropped and (best := outcome.again(key)) is not None:
            return best
    return None


def _reconsidered(stages: list[Stage], accepted: list[Accepted], data: Data, dropped: dict[Key, str]) -> None:
    """Search after an effect came in: that is fitted to the end, and what it makes needless is dropped."""
    if has_tangent(accepted[-1].trial.judged.model, data.training):
        accepted[-1] = refitted(accepted[-1], data)
        stages[-1] = replace(stages[-1], judged=accepted[-1].trial.judged)
    drop_replaced(stages, accepted, data, dropped)
    drop_springs(stages, accepted, data, dropped)
    release_shown(stages, accepted, data)


def _whole(
    outcome: Round, effects: Sequence[str] | None, without: set[Key], *, several: bool
) -> tuple[Accepted | None, Pair | None]:
    """Best candidate of a search round, or the pair of effects where ``several`` may come in."""
    best = outcome.light(effects, without)
    if best is None or outcome.weak(best):
        best = outcome.heavy(effects, without) or best
    pair = together(outcome, best, outcome.data, effects, without) if several else None
    return best or (outcome.by_prediction(without) if pair is None else None), pair


def _loosened(stage: Stage, data: Data) -> tuple[Stage, bool]:
    """Last stage of the search without tight bounds, and whether it is unchanged."""
    loosened = replace(stage, judged=without_tight_bounds(stage.judged, data))
    return loosened, loosened.judged is stage.judged


def _listed(refused: dict[Key, str]) -> tuple[RefusedEffect, ...]:
    return tuple(RefusedEffect(name, site, reason) for (name, site), reason in refused.items())


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
