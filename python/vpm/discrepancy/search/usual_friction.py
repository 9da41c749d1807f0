"""Usual friction at several joints together, where a search on inverse-dynamics residuals begins.

Nobody knows the friction of a robot beforehand, so that its description often has none. Added one effect at a time,
uncertain parameters and other effects take what friction at the other joints would explain. All of it together is one
regression.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from vpm.catalogue import EFFECTS
from vpm.discrepancy.confirmation.confirmation import Data, Judged, Trial, in_time, is_clear, judge, measured
from vpm.discrepancy.confirmation.refusal import Thresholds, refuse_trial
from vpm.discrepancy.screening.candidates import TRANSITION, Candidate, candidates, joint_at
from vpm.discrepancy.screening.probe import Probe
from vpm.discrepancy.search.candidate_choice import Accepted
from vpm.discrepancy.search.search import Search, Stage
from vpm.discrepancy.search.search_round import Request
from vpm.discrepancy.settings import CLEAR_GAIN
from vpm.errors import VpmError
from vpm.identify.response_along_motion import answers_at_once
from vpm.model import Model
from vpm.numbers import power


def with_usual_friction(found: Search, data: Data, request: Request) -> Search:
    """Search that begins with the usual friction of several joints; as it was where that does not do most of the work.

    Each size has to be clear on training records. Without each effect, all else fitted again, validation records have
    to be predicted clearly worse where it acts. What does not do that leaves, of each joint the least first.
    """
    start = found.final
    if not answers_at_once(start.model):
        return found
    usual = [name for name, one in EFFECTS.items() if one.usual == "friction"]
    usual = [name for name in usual if request.effects is None or name in request.effects]
    listed = [c for c in candidates(start.model, data.training, start.fit.residual, usual) if c.neutral]
    if len(_joints(start, listed)) < 2:
        return found
    alone = replace(data, simulation=None)
    request.tell(f"fitting the friction of {len(_joints(start, listed))} joints together")
    try:
        judged = _fitted(start, data, listed)
        while len(_joints(start, listed)) > 1 and len(listed) <= request.limit:
            unclear = [c for c in listed if not is_clear(judged, _own(judged, c))]
            trials = [] if unclear else [_beside(judged, alone, candidate) for candidate in listed]
            tried = len(usual) * len(start.model.joints)
            leaving = unclear or _leaving(trials, Thresholds(tried, data.interval))
            if not leaving:
                trials.sort(key=lambda trial: -trial.there.relative)
                stages = [Stage("added", *trial.probe.candidate.key, judged) for trial in trials]
                accepted = [Accepted(trial, ()) for trial in trials]
                return replace(found, stages=(*found.stages, *stages), accepted=(*found.accepted, *accepted))
            listed = [c for c in listed if c not in leaving]
            judged = _fitted(start, data, listed)
    except VpmError:
        pass  # a search one effect after the other says what it is that fails
    return found


def _joints(start: Judged, listed: Sequence[Candidate]) -> set[str]:
    return {joint_at(start.model, candidate.site) for candidate in listed}


def _own(judged: Judged, candidate: Candidate) -> tuple[str, ...]:
    """Fitted parameters of a candidate's friction."""
    names = judged.model.effect(*candidate.key).parameter_names.values()
    return tuple(name for name in names if name in judged.free)


def _fitted(start: Judged, data: Data, listed: Sequence[Candidate]) -> Judged:
    """Model with all listed friction, fitted: first its sizes, then the speeds at which it turns round, too.

    Parameters begin where they were stated: a fit without friction may have led them far away.
    """
    stated = {name: data.training.nominal.parameters[name].value for name in start.free}
    model, sizes, turning = start.model.with_parameters(stated), list[str](), dict[str, tuple[float, float]]()
    for candidate in listed:
        model = model.with_effect(candidate.effect.name, at=candidate.site, **_middle(candidate))
        names = model.effect(*candidate.key).parameter_names
        sizes += _sizes(model, candidate)
        turning |= {names[short]: ends for short, ends in candidate.bounds.items() if short == TRANSITION}
    bounds, free = dict(start.bounds), (*start.free, *sizes)
    rough = judge(model, free, replace(data, simulation=None), bounds)
    return judge(rough.model, (*free, *turning), data, bounds | turning)


def _middle(candidate: Candidate) -> dict[str, float]:
    return dict(candidate.starts[len(candidate.starts) // 2])


def _beside(judged: Judged, data: Data, candidate: Candidate) -> Trial:
    """Trial of one friction beside all others, by one step of a fit without it.

    Commands may then hold up to a sample later or earlier, so that what is lost by it is no less than it says.
    """
    model, own = judged.model.without_effect(*candidate.key), _own(judged, candidate)
    free, bounds = judged.kept_in(model)
    less = judge(model, free, data, bounds, linear_only=True)
    timed = in_time(less, data)
    less = replace(less, fit=replace(less.fit, residual=timed.fitted), validation=timed.validation)
    values = {name: judged.model.parameters[name].value for name in own}
    spread = {name: float(judged.fit.std[judged.free.index(name)]) for name in own}
    drop = 1.0 - power(judged.fit.residual) / power(timed.fitted)
    return measured(less, data, Probe(candidate, judged.model, own, (), (), values, spread, drop), judged, own, (), "")


def _sizes(model: Model, candidate: Candidate) -> list[str]:
    """Parameters of a friction that are sizes, in which efforts are linear."""
    names = model.effect(*candidate.key).parameter_names
    return [name for short, name in names.items() if not candidate.effect.parameter(short).shape]


def _leaving(trials: Sequence[Trial], thresholds: Thresholds) -> list[Candidate]:
    """Friction that validation records do not ask for, or that does not do most of the work where it acts.

    Of each joint that which does least: what it did, the other friction there may do.
    """
    least: dict[str, Trial] = {}
    for trial in trials:
        if trial.there.relative < CLEAR_GAIN or refuse_trial(trial, thresholds):
            joint = joint_at(trial.judged.model, trial.probe.candidate.site)
            least[joint] = min(trial, least.get(joint, trial), key=lambda one: one.there.relative)
    return [trial.probe.candidate for trial in least.values()]
