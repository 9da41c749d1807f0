"""Probe of a candidate: the share of the training residual that its regressor explains in one linear step.

For each candidate one linearised step moves the free parameters and the new ones together. So a candidate gains nothing
that a better value of a known parameter would explain.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.special import chdtri

from vpm.discrepancy.screening.candidates import Candidate, acts_on, joint_at
from vpm.discrepancy.screening.compliance_and_stop_start import fine_starts
from vpm.discrepancy.settings import EVEN, OF_JOINT, RICHEST, ROUNDED, SHORT_LIST, SIZE_LEVEL
from vpm.errors import DivergedError
from vpm.identify import InverseDynamicsProblem, robust_covariance, segments
from vpm.identify.identifiability import Span, closest_column, column_lengths, is_alias
from vpm.identify.response_along_motion import answers_at_once, bends
from vpm.identify.tangent import has_tangent
from vpm.model import Model, Parameter
from vpm.numbers import Array


def linear_step(data: InverseDynamicsProblem, jacobian: Array, residual: Array) -> tuple[Array, Array, Array]:
    """Linear least-squares step, its standard deviations and the remaining residual (n,)."""
    if jacobian.shape[1] == 0:
        return np.zeros(0), np.zeros(0), residual
    lengths = column_lengths(jacobian)
    scaled = jacobian / lengths
    step = np.linalg.lstsq(scaled, -residual, rcond=1e-10)[0]
    left = residual + scaled @ step
    std = np.sqrt(np.diag(robust_covariance(scaled, left, segments(data)))) / lengths
    return step / lengths, std, left


def is_outside(parameter: Parameter, value: float, std: float) -> bool:
    """Whether an estimate of a linear step lies outside the physical range by more than one standard deviation."""
    return value + std < parameter.minimum or value - std > parameter.maximum


@dataclass(frozen=True)
class Alias:
    """Alias in a probe: a parameter held at its start because data show it only together with another one."""

    parameter: str
    partner: str


@dataclass(frozen=True)
class Probe:
    """Probe of a candidate: estimates and gain of one linearised step."""

    candidate: Candidate
    model: Model  #: The model with the effect at the start values of the best shape tried.
    free: tuple[str, ...]  #: Dotted names of the effect's parameters that the data can see.
    held: tuple[Alias, ...]  #: Those that they do not discriminate from others.
    invisible: tuple[str, ...]  #: Those without any influence at the start values.
    #: Linearised estimate by dotted name, unbounded.
    values: Mapping[str, float]
    std: Mapping[str, float]
    drop: float  #: Share of the training residual's mean square that would go, beside what known parameters explain.
    here: float = 0.0  #: The same of the effort at the joint where the effect acts, of several.

    @property
    def score(self) -> float:
        """Score of a probe: predicted gain per root of the fitted numbers, so that richer effects pay for them."""
        return self.drop / float(np.sqrt(max(1, len(self.free))))


@dataclass(frozen=True)
class Baseline:
    """Baseline of probes: the model to which candidates are added, with its training residual and regressor."""

    model: Model
    free: tuple[str, ...]
    residual: Array
    jacobian: Array

    @cached_property
    def span(self) -> Span:
        """Span of the columns of known parameters."""
        return Span.of(self.jacobian)

    @cached_property
    def unexplained(self) -> Array:
        """Part of the residual (n,) that known parameters would leave; bounds may keep a fit from that."""
        return self.span.rest(self.residual)


def prepare(base: Baseline, data: InverseDynamicsProblem, listed: Sequence[Candidate]) -> Baseline:
    """Prepare probes: simulate together all candidates that move links and do nothing at their start values.

    They all share one motion there, and its derivatives by many parameters take little longer than by one. Shapes of
    what has no size have no influence. The baseline comes back with its regressor at its own values.
    """
    if not bends(base.model) or not has_tangent(base.model, data):
        return base
    pool = [c for c in listed if c.neutral and c.effect.site not in {"joint", "actuator"}]
    residual, jacobian = _simulate_together(base, data, [(c, c.starts[0]) for c in pool], base.free)
    for more in range(1, max((len(c.starts) for c in pool), default=1)):
        _simulate_together(base, data, [(c, c.starts[more]) for c in pool if len(c.starts) > more], ())
    return replace(base, residual=residual, jacobian=jacobian)


def _simulate_together(
    base: Baseline,
    data: InverseDynamicsProblem,
    begun: Sequence[tuple[Candidate, Mapping[str, float]]],
    known: Sequence[str],
) -> tuple[Array, Array]:
    """Simulate candidates that do nothing at these starts for their probes; residual, and regressor of ``known``."""
    models = [base.model.with_effect(c.effect.name, at=c.site, **start) for c, start in begun]
    whole = base.model
    for c, start in begun:
        whole = whole.with_effect(c.effect.name, at=c.site, **start)
    own = [_added(model, c) for (c, _), model in zip(begun, models, strict=True)]
    sizes = [
        name
        for (c, _), model, added in zip(begun, models, own, strict=True)
        for name in added
        if not c.effect.parameter(_short(model, c, name)).shape
    ]
    residual, jacobian = data.evaluate(whole, whole.theta, [whole.index(name) for name in (*known, *sizes)])
    data.share(whole, [(base.model, ()), *zip(models, own, strict=True)])
    return residual, jacobian[:, : len(known)]


def _short(model: Model, candidate: Candidate, name: str) -> str:
    """Short name of a candidate's parameter in a probe."""
    effect = model.effect(*candidate.key)
    return next(short for short, dotted in effect.parameter_names.items() if dotted == name)


@dataclass(frozen=True)
class Place:
    """Indices of size and location parameter of an effect, and the column of their product."""

    size: int
    where: int
    column: Array


def free_location(
    data: InverseDynamicsProblem, model: Model, candidate: Candidate, added: Sequence[str], fresh: Array
) -> Place | None:
    """Location parameter of a candidate that has a size and a location, or None.

    - ``model``: with the candidate at its start, which has no size
    - ``added``: its parameters, by dotted name
    - ``fresh`` (n, len(added)): their columns there

    None too where the column of the size does not change by equal steps with the place.
    """
    if not candidate.neutral or len(candidate.starts) > 1 or len(added) != 2:
        return None
    effect = model.effect(*candidate.key)
    short = {dotted: name for name, dotted in effect.parameter_names.items()}
    own = [candidate.effect.parameter(short[name]) for name in added]
    anywhere = [i for i, p in enumerate(own) if p.is_place]
    if len(anywhere) != 1 or own[1 - anywhere[0]].shape:
        return None
    where, size = anywhere[0], 1 - anywhere[0]
    start, step = model.parameters[added[where]].value, own[where].typical
    columns = [fresh[:, size]]
    for steps in (1.0, 2.0):
        moved = model.with_parameters({added[where]: start + steps * step})
        columns.append(data.evaluate(moved, moved.theta, [moved.index(added[size])])[1][:, 0])
    first, second = columns[1] - columns[0], columns[2] - columns[1]
    if not np.any(first) or np.linalg.norm(second - first) > EVEN * np.linalg.norm(first):
        return None
    return Place(size, where, first / step)


def probe(base: Baseline, data: InverseDynamicsProblem, candidate: Candidate) -> Probe:
    """Probe a candidate from all its start values; the best step counts, possible estimates before impossible ones."""
    if (found := _searched(base, data, candidate)) is not None:
        return found
    # Of starts without any gain one that resembles known parameters tells why, not a place without influence.
    probes = sorted(
        (_probe_start(base, data, candidate, start) for start in candidate.starts), key=lambda p: -len(p.held)
    )
    best = max(probes, key=lambda p: p.drop)
    possible = [p for p in probes if not impossible_values(p)]
    if possible:
        runner_up = max(possible, key=lambda p: p.drop)
        if runner_up.drop >= 0.5 * best.drop:
            return runner_up
    return best


def _searched(base: Baseline, data: InverseDynamicsProblem, candidate: Candidate) -> Probe | None:
    """Probe at the start that leaves least along the motion, where efforts follow at once; None if none helps."""
    effect, joints = candidate.effect, data.motions[0].joints
    searched = effect.winds_up or effect.has_play
    if not searched or candidate.site not in joints or not answers_at_once(base.model):
        return None
    way = np.concatenate([m.position[:, joints.index(candidate.site)] for m in data.motions])
    starts = fine_starts(effect, candidate.site, base.model, 0.5 * float(np.ptp(way)))

    def left(start: Mapping[str, float]) -> float:
        model = base.model.with_effect(candidate.effect.name, at=candidate.site, **start)
        try:
            rest = base.span.rest(data.evaluate(model, model.theta)[0])
        except DivergedError:
            return math.inf
        power = float(rest @ rest)
        return power if math.isfinite(power) else math.inf

    found = _probe_start(base, data, candidate, min(starts, key=left), still=True)
    return found if found.free and found.drop > 0.0 else None


def screening_effort(candidate: Candidate) -> float:
    """Time estimate of a `probe`, in starts that do nothing."""
    return len(candidate.starts) * (1.0 if candidate.neutral else 10.0)


def refit_effort(probe: Probe) -> float:
    """Time estimate of a refit after its probe: shapes take longer than linear parameters."""
    own = (*probe.free, *probe.invisible)
    return float(sum(probe.model.parameters[name].kind != "linear" for name in own))


def impossible_values(probe: Probe) -> list[str]:
    """Parameters whose estimate in a probe is outside the physical range by more than one standard deviation."""
    known = probe.model.parameters
    return [name for name in probe.free if is_outside(known[name], probe.values[name], probe.std[name])]


def size_is_clear(names: Sequence[str], values: Array, covariance: Array) -> bool:
    """Wald test of a probe that the parameters ``names`` are not all zero, at the level ``SIZE_LEVEL``."""
    if not names:
        return False
    if not np.all(np.isfinite(covariance)):
        return False
    statistic = float(values @ np.linalg.pinv(covariance, hermitian=True) @ values)
    return statistic > float(chdtri(len(names), SIZE_LEVEL))


def _probe_start(
    base: Baseline,
    data: InverseDynamicsProblem,
    candidate: Candidate,
    start: Mapping[str, float] | None = None,
    *,
    still: bool = False,
) -> Probe:
    """Probe from one start value; a ``still`` start moves the known parameters alone."""
    start = candidate.starts[0] if start is None else start
    model = base.model.with_effect(candidate.effect.name, at=candidate.site, **start)
    added = _added(model, candidate)
    if not candidate.neutral:
        added = tuple(name for name in added if _short(model, candidate, name) not in candidate.fixed)
    columns = [model.index(name) for name in added]
    # Known columns are taken as before it: few effects change them, and where links bend each costs a simulation.
    residual, fresh = data.evaluate(model, model.theta, columns)
    place = free_location(data, model, candidate, added, fresh)
    if place is not None:
        fresh[:, place.where] = place.column
    keep, held, invisible = sort_columns(
        added, fresh, base.span, (base.free, base.jacobian), residual, _sizes(model, candidate, base.free, added)
    )
    if place is not None and place.where in keep and place.size not in keep:
        keep.remove(place.where)
        invisible = (*invisible, added[place.where])
    free = tuple(added[i] for i in keep)
    start_values = model.theta[[columns[i] for i in keep]]
    values, std, left = linear_step(data, base.span.rest(fresh[:, keep]), base.span.rest(residual))
    if still:
        left = base.span.rest(residual)
    if (
        candidate.effect.motion
    ):  # far from linear in a stiffness or loss: the step tells a gain, the grid where to begin
        values = np.zeros_like(values)
    estimates = dict(zip(free, (values + start_values).tolist(), strict=True))
    deviations = dict(zip(free, std.tolist(), strict=True))
    drop, here = _lowered(base, data, candidate, left) if free else (0.0, 0.0)
    if place is not None and place.where in keep:
        size, where = added[place.size], added[place.where]
        if estimates[size] <= model.parameters[size].minimum:
            free, invisible = tuple(name for name in free if name != where), (*invisible, where)
        else:
            first = model.parameters[where].value
            estimates[where] = first + (estimates[where] - first) / estimates[size]
            deviations[where] /= abs(estimates[size])
    return Probe(candidate, model, free, held, invisible, estimates, deviations, drop, here)


def _lowered(base: Baseline, data: InverseDynamicsProblem, candidate: Candidate, left: Array) -> tuple[float, float]:
    """Shares of a probe's residual that would go: of all, and of the effort at the joint where its effect acts."""
    before, whole = base.unexplained, float(base.residual @ base.residual)
    drop = (float(before @ before) - float(left @ left)) / whole if whole > 0.0 else 0.0
    here = acts_on(base.model, data, candidate.site)
    own = float(here * before @ before)
    return drop, 1.0 - float(here * left @ left) / own if own > 0.0 and not np.all(here) else 0.0


def _sizes(model: Model, candidate: Candidate, known: Sequence[str], added: Sequence[str]) -> tuple[Array, Array]:
    """Orders of magnitude of known and new parameters in a probe."""
    values = np.array([abs(model.parameters[name].value) or 1.0 for name in known])
    own = [candidate.effect.parameter(_short(model, candidate, name)) for name in added]
    return values, np.array([parameter.typical for parameter in own])


def _added(model: Model, candidate: Candidate) -> tuple[str, ...]:
    for effect in model.effects:
        if effect.key == candidate.key:
            return tuple(effect.parameter_names.values())
    return ()


def sort_columns(
    added: Sequence[str],
    fresh: Array,
    span: Span,
    known: tuple[Sequence[str], Array],
    residual: Array,
    sizes: tuple[Array, Array],
) -> tuple[list[int], tuple[Alias, ...], tuple[str, ...]]:
    """Sort the new columns of a probe: identifiable, confused with others, and without influence.

    The first come by their places, the others by name. ``known`` are names and columns of what has the ``span``.
    ``sizes`` are those of known and fresh parameters, without which SI units would decide what is small.
    """
    names, columns = known
    lengths = np.linalg.norm(fresh, axis=0) * sizes[1]
    largest = float(np.max([*(np.linalg.norm(columns, axis=0) * sizes[0]), *lengths], initial=0.0))
    visible = [i for i in range(len(added)) if lengths[i] > ROUNDED * largest]
    invisible = tuple(added[i] for i in range(len(added)) if i not in visible)
    keep, held = list(visible), []
    for i in visible:
        others = [j for j in keep if j != i]
        if is_alias(fresh[:, i], span.beside(fresh[:, others]), residual):
            closest = closest_column(fresh[:, i], np.column_stack([columns, fresh[:, others]]))
            held.append(Alias(added[i], [*names, *(added[j] for j in others)][closest]))
            keep.remove(i)
    return keep, tuple(held), invisible


def most_promising(promising: Sequence[Probe]) -> list[Probe]:
    """Short list of probes to refit, by falling score.

    Efforts of each joint are balanced by themselves, so that what one joint lacks says nothing of another one.
    """
    richest = {p.candidate.key for p in sorted(promising, key=lambda p: -p.drop)[:RICHEST]}
    seats: Counter[str] = Counter()
    chosen = []
    for rank, one in enumerate(promising):
        joint = joint_at(one.model, one.candidate.site)
        if rank < SHORT_LIST or one.candidate.key in richest or (joint and seats[joint] < OF_JOINT):
            chosen.append(one)
            seats[joint] += 1
    return chosen
