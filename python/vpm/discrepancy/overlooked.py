"""One effect more of which a balance of effort sees too little to be sure: asked of runs of the model itself.

What was refused in the last round of the search, for it explains a modest part of what is left, or helps everywhere but
at a reversal that outweighs all else, gets a run of its own beside that of the model with all that was accepted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from vpm.discrepancy.choice import Accepted
from vpm.discrepancy.confirmation import Data, Trial, confirm, judge
from vpm.discrepancy.elimination import Stage
from vpm.discrepancy.motion_only import WITHIN
from vpm.discrepancy.own_run import OwnRun
from vpm.discrepancy.refusal import WORTH_A_NAME, Thresholds, impossible_trial
from vpm.discrepancy.runs import WORTH_A_FIT, Told, compared, criterion, first_run, fitted_run
from vpm.discrepancy.screening import Probe, impossible_values
from vpm.discrepancy.search import Search
from vpm.discrepancy.short_list import same_models
from vpm.discrepancy.side_by_side import SideBySide
from vpm.errors import VpmError

#: Effects that are asked for, of those that take most of the training residual.
ASKED = 3
#: Digits of the share that one takes.
DIGITS = 4


def overlooked(found: Search, data: Data, each: SideBySide) -> Search:
    """The search with the one effect more that runs ask for most, if training and unseen records are sure of it."""
    promising = _promising(found)
    before = first_run(found.final, data) if promising else None
    if before is None:
        return found
    asked = each("overlooked: running", partial(_run, found, data), promising, lambda p: p.candidate.label)
    least = criterion(before) - WORTH_A_FIT
    worth = [one for one in asked if isinstance(one, tuple) and criterion(one[1]) < least]
    first = fitted_run(before, data) if worth else None
    if first is None:
        return found
    thresholds = Thresholds(max(1, len(found.ranking)), min(m.dt for m in data.training.motions))
    told = []
    for trial, run in sorted(worth, key=lambda one: criterion(one[1])):
        second = fitted_run(run, data)
        said = None if second is None else compared(first, second, data)
        if said is not None and said.sure(thresholds):
            told.append((trial, said))
    if not told:
        return found
    trial, said = min(told, key=lambda one: criterion(one[1].run))
    more = _accepted(data, trial, said)
    return found if more is None else _added(found, more)


def _promising(found: Search) -> list[Probe]:
    """What takes most of the training residual of that which was refused in the last round."""
    present = {entry.key for entry in found.accepted} | found.gone
    refused = {p.candidate.key: p for p in found.over.probes if _possible(p) and p.candidate.key not in present}
    shares = {key: _taken(p, found.over.trials) for key, p in refused.items()}
    worth_it = [p for key, p in refused.items() if shares[key] >= WORTH_A_NAME]
    # Of two names of one model the first in the catalogue is asked for.
    best = sorted(worth_it, key=lambda p: -round(shares[p.candidate.key], DIGITS))[:ASKED]
    twins = same_models(best)
    return [p for p in best if p.candidate.key not in twins]


def _possible(probe: Probe) -> bool:
    return bool(probe.free) and not impossible_values(probe) and probe.candidate.effect.name != "backlash"


def _taken(probe: Probe, tried: Sequence[Trial]) -> float:
    """Share of the training residual that an effect takes, as fitted or as screened."""
    mine = [
        1.0 - (t.training.after / t.training.before) ** 2
        for t in tried
        if t.probe.candidate.key == probe.candidate.key and t.training.before > 0.0
    ]
    return max([probe.drop, *mine])


def _run(found: Search, data: Data, probe: Probe) -> tuple[Trial, OwnRun] | str:
    """A model with an effect fitted to the balance, and its run; or why there is none."""
    known = (trial for trial in found.over.trials if trial.probe is probe)
    trial = next(known, None) or confirm(found.final, data, probe)
    if reason := impossible_trial(trial, min(m.dt for m in data.training.motions)):
        return reason
    run = first_run(trial.judged, data)
    return "it cannot follow the references" if run is None else (trial, run)


def _accepted(data: Data, trial: Trial, told: Told) -> Accepted | None:
    """The effect with the balance fitted near what the runs say of it, and with what these gain."""
    bounds, values = dict(trial.judged.bounds), {}
    for name in trial.parameters:
        value, std = told.run.estimated(name)
        parameter = trial.judged.model.parameters[name]
        bounds[name] = max(parameter.minimum, value - WITHIN * std), min(parameter.maximum, value + WITHIN * std)
        values[name] = float(np.clip(value, *bounds[name]))
    try:
        judged = judge(trial.judged.model.with_parameters(values), trial.judged.free, data, bounds)
    except VpmError:
        return None
    told_by_runs = replace(trial, judged=judged, training=told.training, unseen=told.unseen, simulated=None, away=None)
    return Accepted(replace(told_by_runs, clear=True, alone=True), ())


def _added(found: Search, more: Accepted) -> Search:
    """A search with one effect more."""
    name, site = more.key
    ranking = [*found.ranking]
    last = max((n for n, c in enumerate(ranking) if (c.name, c.site) == more.key), default=None)
    if last is not None:
        ranking[last] = replace(ranking[last], accepted=True, unseen=more.trial.unseen.relative)
    return replace(
        found,
        stages=(*found.stages, Stage("added", name, site, more.trial.judged)),
        accepted=(*found.accepted, more),
        refused=tuple(r for r in found.refused if (r.name, r.site) != more.key),
        ranking=tuple(ranking),
        last=None,
    )
