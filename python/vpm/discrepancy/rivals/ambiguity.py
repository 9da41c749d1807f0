"""Ambiguity: rival effects that predict the validation records as well as an accepted effect."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from vpm.discrepancy.confirmation.confirmation import Data, Judged, Trial, confirm, judge
from vpm.discrepancy.diagnosis import Ambiguity
from vpm.discrepancy.parallel_candidates import Failure
from vpm.discrepancy.screening.candidates import Candidate, Key, candidates, joint_at
from vpm.discrepancy.screening.probe import Probe, impossible_values, linear_step, probe, refit_effort, screening_effort
from vpm.discrepancy.search.candidate_choice import Accepted, alike
from vpm.discrepancy.search.search import Tried
from vpm.discrepancy.search.search_round import Request
from vpm.discrepancy.settings import CLEAR_GAIN, CLEARLY, LEAST_SHARE, RIVALS_TRIED
from vpm.errors import DivergedError
from vpm.identify import InverseDynamicsProblem, gain, segments
from vpm.identify.identifiability import COPY_SHARE, Span
from vpm.identify.response_along_motion import answers_at_once, bends
from vpm.model import Model
from vpm.numbers import NORMAL_95, power


@dataclass(frozen=True)
class Rivals:
    """Rivals of an accepted effect: trials in its place that predict the validation records as well."""

    effect: str
    site: str
    trials: tuple[Trial, ...]  #: Those that predict the validation data as well.
    tried: tuple[Trial, ...] = ()  #: All that were refitted in its place.
    without: Judged | None = None  #: The model without it; None where that cannot be computed.

    @property
    def label(self) -> str:
        """Label of the ambiguous effect that rivals compete with: ``effect at site``."""
        return f"{self.effect} at {self.site}"


def listed(known: Sequence[Ambiguity], found: Sequence[Rivals]) -> tuple[Ambiguity, ...]:
    """Ambiguities for the result: those that the search saw, and rivals found afterwards, each named once."""
    said = {(a.name, a.site, other) for a in known for other in a.others}
    more = []
    for entry in found:
        labels = (trial.probe.candidate.label for trial in entry.trials)
        names = tuple(label for label in labels if (entry.effect, entry.site, label) not in said)
        if names:
            reason = "put in its place and fitted, it predicts the validation data as well"
            more.append(Ambiguity(entry.effect, entry.site, names, reason))
    return (*known, *more)


def rivals(
    final: Judged, data: Data, accepted: Sequence[Accepted], request: Request, last: Tried | None = None
) -> tuple[Rivals, ...]:
    """Ambiguity of each accepted effect: rivals in its place that predict the validation data as well.

    All rivals are screened on the model without the effect; the few with nearly the same share of the training residual
    are refitted. They have to predict the validation records as well as the effect. What the ``last`` effect competed
    with when it came in is not worked out again.
    """
    known = {last.key: last} if last is not None else {}
    left = request.each(
        "what each adds: refitting without", partial(_without, final, data, known), accepted, lambda one: one.label
    )
    return tuple(
        Rivals(*entry.key, ())
        if isinstance(without, Failure)
        else _rivals_of(entry, final, without, data, request, known.get(entry.key))
        for entry, without in zip(accepted, left, strict=True)
    )


def _rivals_of(
    entry: Accepted, final: Judged, without: Judged, data: Data, request: Request, last: Tried | None
) -> Rivals:
    """Ambiguity of one accepted effect: its rivals, put in its place in the model without it."""
    known = {} if last is None else {trial.probe.candidate.key: trial for trial in last.trials}
    if last is not None:
        probes = [one for one in last.probes if _could_do(last.without.model, entry, one.candidate)]
    else:
        offered = candidates(without.model, data.training, without.fit.residual, request.effects)
        screened = request.each(
            "what else would do: screening",
            partial(probe, without.baseline, data.training),
            [one for one in offered if _could_do(without.model, entry, one)],
            lambda one: f"{one.label} for {entry.label}",
            screening_effort,
        )
        probes = [one for one in screened if isinstance(one, Probe)]
    probes = [probe_beside(final, without, data.training, entry, one) for one in probes]
    listed = _short_list(final, without, probes)
    trials = request.each(
        "what else would do: refitting",
        partial(confirm, without, data),
        [one for one in listed if one.candidate.key not in known],
        lambda one: f"{one.candidate.label} for {entry.label}",
        refit_effort,
    )
    tried = [known[one.candidate.key] for one in listed if one.candidate.key in known]
    tried += [trial for trial in trials if isinstance(trial, Trial)]
    good = tuple(trial for trial in tried if as_good(final, trial, data))
    return Rivals(*entry.key, good, tuple(tried), without)


def _without(final: Judged, data: Data, known: Mapping[Key, Tried], entry: Accepted) -> Judged:
    """Model without one accepted effect, all else fitted again; ambiguity is judged on it.

    Efforts that follow at once are linear in sizes, and nearly so in all else: one step does.
    """
    if entry.key in known:
        return known[entry.key].without
    model = final.model.without_effect(*entry.key)
    free, bounds = final.kept_in(model)
    return judge(model, free, data, bounds, linear_only=answers_at_once(final.model))


def _could_do(model: Model, entry: Accepted, candidate: Candidate) -> bool:
    """Whether a candidate acts near enough to an accepted effect to make it ambiguous.

    A motion of its own is no rival of friction that does most of the work at its joint: no swing takes energy alike.
    """
    heavier = bool(candidate.effect.motion) and not entry.effect.motion
    rubs = entry.effect.usual == "friction" and entry.trial.there.relative >= CLEAR_GAIN
    return _near(model, candidate, entry) and not (heavier and (rubs or bends(model)))


def _short_list(final: Judged, without: Judged, probes: Sequence[Probe]) -> list[Probe]:
    """Short list of ambiguous rivals to refit: those of the largest predicted gains per number."""
    whole = power(without.fit.residual)
    least = LEAST_SHARE * (whole - power(final.fit.residual))
    good = [p for p in probes if p.free and not impossible_values(p) and p.drop * whole >= least]
    return sorted(good, key=lambda p: -p.score)[:RIVALS_TRIED]


def _near(model: Model, candidate: Candidate, entry: Accepted) -> bool:
    """Whether a rival acts on the joint of an effect, or is confusable with it, so that it is ambiguous.

    What has no motion of its own and acts at another joint alone changes no effort at this one.
    """
    name, site = entry.key
    if candidate.key == (name, site):
        return False
    here, there = joint_at(model, site), joint_at(model, candidate.site)
    if here and there and here != there and not (candidate.effect.motion or entry.effect.motion):
        return False
    own = entry.trial.probe.candidate.effect
    return candidate.site == site or candidate.effect.name in own.confused_with or candidate.effect.site == "actuator"


def as_good(final: Judged, trial: Trial, data: Data) -> bool:
    """Whether an effect is ambiguous: a rival in its place predicts the validation data as well."""
    if not trial.clear:
        return False
    change = gain(final.validation, trial.judged.validation, segments(data.validation)).relative
    return change > -CLEARLY


def probe_beside(final: Judged, without: Judged, data: InverseDynamicsProblem, entry: Accepted, probe: Probe) -> Probe:
    """Probe of a nested rival beside the accepted effect whose law it contains.

    - ``final``, ``without``: the model with all accepted effects, and without this one
    - ``data``: training records
    - ``probe``: of the rival, on the model without the effect

    It is to be refitted from the size that one step beside the effect says; ``probe`` itself if it was not held, is not
    confused with the effect at its site, cannot be computed beside it, or has no clear size there (95 %).
    """
    candidate = probe.candidate
    if probe.free or not probe.held or not candidate.neutral or not alike(candidate, entry.trial.probe.candidate):
        return probe
    names = tuple(alias.parameter for alias in probe.held)
    model = final.model.with_effect(candidate.effect.name, at=candidate.site, **candidate.starts[0])
    try:
        residual, fresh = data.evaluate(model, model.theta, [model.index(name) for name in names])
    except DivergedError:
        return probe  # beside the effect it cannot be balanced, as a rotor's inertia behind a joint with a memory
    values, std, left = linear_step(data, np.column_stack([final.fit.jacobian, fresh]), residual)
    count = len(names)
    sizes, spread = values[-count:], std[-count:]
    if not np.all(np.isfinite(spread)) or not np.all(np.abs(sizes) > NORMAL_95 * spread):
        return probe
    start, fixed = probe.model.parameters, set(_held_at_start(probe))
    shapes = tuple(name for name in probe.invisible if name not in fixed)
    power = float(without.fit.residual @ without.fit.residual)
    return replace(
        probe,
        free=(*names, *shapes),
        held=(),
        invisible=(),
        values={
            **{name: start[name].value for name in shapes},
            **{name: start[name].value + float(size) for name, size in zip(names, sizes, strict=True)},
        },
        std={**dict.fromkeys(shapes, np.inf), **dict(zip(names, map(float, spread), strict=True))},
        drop=1.0 - float(left @ left) / power if power > 0.0 else 0.0,
    )


def contains(rival: Judged, parameters: tuple[str, ...], final: Judged, own: tuple[str, ...]) -> bool:
    """Whether a rival is a richer law in which the accepted effect is nested.

    Then the effect is the rival with one number at zero. The distance of that number from zero on the training records
    counts as evidence, so validation records, which are fewer, only have to improve. Of laws that are different, and of
    friction whose fit makes up for reversals that filters smooth, neither holds.

    - ``rival``: the model with the rival in the place of the effect
    - ``parameters``: the rival's own
    - ``final``: the model with the effect
    - ``own``: the effect's own parameters
    """
    if len(parameters) <= len(own):
        return False
    columns = rival.fit.jacobian[:, [rival.fit.names.index(name) for name in parameters]]
    plain = (final.fit.jacobian[:, final.fit.names.index(name)] for name in own)
    within = Span.of(columns)
    return all(within.share(column) > COPY_SHARE for column in plain)


def _held_at_start(probe: Probe) -> list[str]:
    candidate = probe.candidate
    effect = probe.model.effect(*candidate.key)
    return [effect.parameter_names[short] for short in candidate.fixed]
