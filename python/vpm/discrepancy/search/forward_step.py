"""Forward step after the search: one more effect, accepted by closed-loop predictions.

Candidates are those that the last round of the search refused. They explain a modest part of the residual, or help
everywhere except at one dominant reversal. Each gets a closed-loop prediction beside that of the model found so far.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from vpm.catalogue import EFFECTS
from vpm.discrepancy.confirmation.confirmation import Data, Trial, confirm, judge
from vpm.discrepancy.confirmation.delay_in_motion import WITHIN
from vpm.discrepancy.confirmation.prediction_comparison import (
    WORTH_A_FIT,
    Comparison,
    compared,
    criterion,
    fitted_prediction,
    predicted,
)
from vpm.discrepancy.confirmation.refusal import WORTH_A_NAME, Thresholds, impossible_trial
from vpm.discrepancy.confirmation.whittle_likelihood import ClosedLoopPrediction, misfit
from vpm.discrepancy.parallel_candidates import ParallelCandidates
from vpm.discrepancy.screening.probe import Probe, impossible_values
from vpm.discrepancy.screening.short_list import same_models
from vpm.discrepancy.search.backward_elimination import Stage
from vpm.discrepancy.search.candidate_choice import Accepted, choose
from vpm.discrepancy.search.search import Search
from vpm.errors import VpmError

#: Effects that are asked for, of those that take most of the training residual.
ASKED = 3
#: So many of those with the largest predicted gain are fitted.
FITTED = 2


@dataclass(frozen=True)
class _Predicted:
    """Effect of a forward step with its closed-loop prediction, and its trial on the residual if any."""

    probe: Probe
    trial: Trial | None
    run: ClosedLoopPrediction


def forward_step(found: Search, data: Data, each: ParallelCandidates) -> Search:
    """Forward step of the search: the effect that closed-loop predictions of all records support most."""
    promising = _promising(found)
    before = predicted(found.final, data) if promising else None
    if before is None:
        return found
    tried = each("one effect more: running", partial(_run, found, data, before), promising, lambda p: p.candidate.label)
    least = criterion(before) - WORTH_A_FIT
    worth = [one for one in tried if isinstance(one, _Predicted) and criterion(one.run) < least]
    first = fitted_prediction(before, data) if worth else None
    if first is None:
        return found
    thresholds = Thresholds(max(1, len(found.ranking)), min(m.dt for m in data.training.motions))
    supported = []
    for one in sorted(worth, key=lambda one: criterion(one.run))[:FITTED]:
        second = fitted_prediction(one.run, data)
        said = None if second is None else compared(first, second, data)
        if said is not None and said.sure(thresholds):
            supported.append((one, said))
    supported.sort(key=lambda one: criterion(one[1].run))
    more = [entry for one, said in supported if (entry := _accepted(found, data, one, said)) is not None]
    return _added(found, _best(more, data)) if more else found


def _best(more: Sequence[Accepted], data: Data) -> Accepted:
    """Best effect for a forward step; among delays and lags the chosen one."""
    late = [entry for entry in more if entry.effect.late]
    if len(late) < 2 or more[0] is not late[0]:
        return more[0]
    return choose([entry.trial for entry in late], data)


def _promising(found: Search) -> list[Probe]:
    """Candidates for a forward step: refused effects of the largest training gain, and springs in series.

    A spring swings above the band of the residual, which may hardly show it.
    """
    present = {entry.key for entry in found.accepted} | found.gone
    refused = [p for p in found.over.probes if p.candidate.key not in present]
    springs = [p for p in refused if p.candidate.effect.elastic]
    springs.sort(key=lambda p: list(EFFECTS).index(p.candidate.effect.name))
    twins = same_models(springs)
    springs = [p for p in springs if p.candidate.key not in twins]
    shares = {p.candidate.key: _taken(p, found.over.trials) for p in refused}
    rest = [p for p in refused if _possible(p) and shares[p.candidate.key] >= WORTH_A_NAME]
    return [*sorted(rest, key=lambda p: -shares[p.candidate.key])[:ASKED], *springs]


def _possible(probe: Probe) -> bool:
    # Springs are tried with all others of their kind, and predictions of a backlash are chaotic.
    return bool(probe.free) and not impossible_values(probe) and not probe.candidate.effect.motion


def _taken(probe: Probe, tried: Sequence[Trial]) -> float:
    """Share of the training residual that a candidate for a forward step explains, fitted or screened."""
    mine = [
        1.0 - (t.training.after / t.training.before) ** 2
        for t in tried
        if t.probe.candidate.key == probe.candidate.key and t.training.before > 0.0
    ]
    return max([probe.drop, *mine])


def _run(found: Search, data: Data, before: ClosedLoopPrediction, probe: Probe) -> _Predicted | str:
    """Closed-loop prediction of a model with one more effect for a forward step, or why there is none."""
    if probe.candidate.effect.elastic:
        run = _sprung(found, data, before, probe)
        return "no run with it does better" if run is None else _Predicted(probe, None, run)
    known = (trial for trial in found.over.trials if trial.probe is probe)
    trial = next(known, None) or confirm(found.final, data, probe)
    if reason := impossible_trial(trial, min(m.dt for m in data.training.motions)):
        return reason
    run = predicted(trial.judged, data)
    return "it cannot follow the references" if run is None else _Predicted(probe, trial, run)


def _sprung(found: Search, data: Data, before: ClosedLoopPrediction, probe: Probe) -> ClosedLoopPrediction | None:
    """Closed-loop prediction for a forward step by a spring in series, from its best start; None if none fits."""
    candidate, starts = probe.candidate, []
    for start in candidate.starts:
        model = before.model.with_effect(candidate.effect.name, at=candidate.site, **start)
        try:
            left, _ = before.problem.evaluate(model, model.theta)
        except VpmError:
            continue
        starts.append((misfit(before, left), model))
    cost, model = min(starts, key=lambda one: one[0], default=(np.inf, before.model))
    if cost >= misfit(before):
        return None
    names = model.effect(*candidate.key).parameter_names
    free = (*before.free, *(dotted for short, dotted in names.items() if short not in candidate.fixed))
    return predicted(replace(found.final, model=model, free=free), data)


def _accepted(found: Search, data: Data, tried: _Predicted, comparison: Comparison) -> Accepted | None:
    """Effect accepted by a forward step: refitted near its predicted values, with the gain of predictions."""
    final, run = found.final, comparison.run
    own = tuple(name for name in run.free if name not in final.free)
    bounds, values = dict(final.bounds if tried.trial is None else tried.trial.judged.bounds), {}
    for name in own:
        value, std = run.estimated(name)
        if not np.isfinite(std):  # a dead zone that swallows every command, for instance: nothing says how wide it is
            return None
        parameter = run.model.parameters[name]
        bounds[name] = max(parameter.minimum, value - WITHIN * std), min(parameter.maximum, value + WITHIN * std)
        values[name] = float(np.clip(value, *bounds[name]))
    known = {name: final.model.parameters[name].value for name in final.free}
    model = run.model.with_parameters(known) if tried.trial is None else tried.trial.judged.model
    try:
        trial = tried.trial or confirm(final, data, tried.probe)
        judged = judge(model.with_parameters(values), (*final.free, *own), data, bounds)
    except VpmError:
        return None
    judged_by_prediction = replace(
        trial, judged=judged, training=comparison.training, validation=comparison.validation, simulated=None, away=None
    )
    return Accepted(
        replace(judged_by_prediction, parameters=own, held=(), clear=True, from_prediction=True, diverged=""), ()
    )


def _added(found: Search, more: Accepted) -> Search:
    """Search with the effect of a forward step added."""
    name, site = more.key
    ranking = [*found.ranking]
    last = max((n for n, c in enumerate(ranking) if (c.name, c.site) == more.key), default=None)
    if last is not None:
        ranking[last] = replace(ranking[last], accepted=True, unseen=more.trial.validation.relative)
    return replace(
        found,
        stages=(*found.stages, Stage("added", name, site, more.trial.judged)),
        accepted=(*found.accepted, more),
        refused=tuple(r for r in found.refused if (r.name, r.site) != more.key),
        ranking=tuple(ranking),
        last=None,
    )
