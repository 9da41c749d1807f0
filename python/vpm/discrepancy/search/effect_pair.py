"""Pair of effects: each is refused alone, and both together predict the validation records.

With two effects missing, the fit of one alone lets its parameters imitate the other on the training records. It then
predicts the validation records worse than no effect, so the right effect is refused and a wrong one comes in. So the
refused effect that explains most of the training residual gets a partner. Both come in if each is accepted beside the
other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from vpm.catalogue import EFFECTS
from vpm.discrepancy.confirmation.confirmation import Data, Judged, Trial, judge, shrinkage
from vpm.discrepancy.confirmation.refusal import CLEAR_GAIN, refuse_trial
from vpm.discrepancy.screening.candidates import Key
from vpm.discrepancy.search.candidate_choice import Accepted, cost
from vpm.discrepancy.search.search_round import Round
from vpm.errors import DivergedError
from vpm.identify import gain, segments

#: What leads leaves less than this share of what the best single effect leaves of the training records.
CLEARLY_LESS = 0.5


@dataclass(frozen=True)
class Pair:
    """Pair of effects that the search accepts together."""

    first: Accepted  #: With the model that has this one alone, and what it gains beside the other one.
    outcome: Round  #: The round in which the second one came in beside it.
    second: Accepted


def together(
    outcome: Round, best: Accepted | None, data: Data, effects: Sequence[str] | None, without: set[Key]
) -> Pair | None:
    """Search for a pair of effects, in place of the one that would come in alone or of none.

    Parameters
    ----------
    outcome : Round
        After its candidates were refitted.
    best : Accepted or None
        What would come in alone.
    data : Data
    effects : sequence of str or None
        Names that are tried.
    without : set of Key
        Effects that were dropped already.
    """
    lead = _lead(outcome, best)
    if lead is None:
        return None
    partner = outcome.after(lead.judged).light(effects, without)
    if partner is None or not _do_more(outcome, best, lead, partner.trial, data):
        return None
    name, site = lead.probe.candidate.key
    judged = _without(partner.trial.judged, (name, site), data)
    # A delay or lag is chosen among its kind again, with the partner in its place.
    kin = [one for one, entry in EFFECTS.items() if entry.late] if lead.probe.candidate.effect.late else [name]
    names = [one for one in kin if effects is None or one in effects]
    beside = outcome.after(judged)
    second = beside.light(names, without)
    first = replace(partner.trial, judged=judged)
    if second is None or not _do_more(outcome, best, first, second.trial, data):
        return None
    outcome.mark(partner.key)
    return Pair(Accepted(first, ()), beside, second)


def _lead(outcome: Round, best: Accepted | None) -> Trial | None:
    """Leading effect of a pair: refused alone, with clearly the largest gain on the training residual."""
    if best is not None and best.trial.validation.relative >= CLEAR_GAIN:
        return None
    least = 1.0 - CLEARLY_LESS * (1.0 if best is None else 1.0 - best.trial.training.relative)
    refused = [t for t in outcome.trials if t.probe.candidate.key in outcome.refused and not t.diverged]
    leads = [t for t in refused if t.training.relative >= least]
    return max(leads, key=lambda t: t.training.relative, default=None)


def _do_more(outcome: Round, best: Accepted | None, first: Trial, second: Trial, data: Data) -> bool:
    """Whether a pair of effects is accepted, and leaves less for its numbers than the best single effect."""
    current, judged = outcome.current, second.judged
    simulated = None
    if data.simulation is not None and current.simulated is not None and judged.simulated is not None:
        simulated = gain(current.simulated, judged.simulated, segments(data.simulation))
    both = replace(
        second,
        parameters=(*first.parameters, *second.parameters),
        training=gain(current.fit.residual, judged.fit.residual, segments(data.training)),
        validation=gain(
            current.validation,
            judged.validation * shrinkage(data.validation, current, judged),
            segments(data.validation),
        ),
        simulated=simulated,
    )
    if both.validation.relative < CLEAR_GAIN or refuse_trial(both, outcome.thresholds()):
        return False
    return best is None or cost(both, data.training.nominal) < cost(best.trial, data.training.nominal)


def _without(judged: Judged, key: Key, data: Data) -> Judged:
    """Model without one effect of a pair, fitted again; judged by the residual alone where it cannot simulate."""
    model = judged.model.without_effect(*key)
    free = tuple(name for name in judged.free if name in model.parameters)
    bounds = {name: pair for name, pair in judged.bounds.items() if name in free}
    try:
        return judge(model, free, data, bounds)
    except DivergedError:
        return judge(model, free, replace(data, simulation=None), bounds)
