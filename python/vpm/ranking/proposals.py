"""Proposals for a ranking: effects that could be missing from a structure and are worth a fit."""

from __future__ import annotations

import contextlib
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from vpm.catalogue import EFFECTS
from vpm.catalogue.kinds import Side
from vpm.discrepancy.parallel_candidates import Failure, ParallelCandidates
from vpm.discrepancy.screening.candidates import Candidate, Key, candidates
from vpm.discrepancy.unknown_zeros import zeros_of
from vpm.identify import InverseDynamicsProblem
from vpm.model.splitting import spring_in_series
from vpm.numbers import Array
from vpm.ranking.fit import ASTRAY, Fitter, Followed, View
from vpm.ranking.look import Look
from vpm.ranking.model_structure import Structure
from vpm.ranking.settings import Settings
from vpm.ranking.short_waves import with_short_waves
from vpm.ranking.start_values import started
from vpm.ranking.structure_extensions import Extensions, sides_of

#: Derivatives that a pass works out at a time.
AT_ONCE = 16


@dataclass(frozen=True, eq=False)
class Proposal:
    """Proposal of an effect at start values, as screened under a tracker."""

    structure: Structure
    gain: float  #: What one step of a fit is predicted to gain, nats.
    neutral: bool  #: The effect does nothing where it begins.

    @property
    def key(self) -> Key:
        """Effect and site of a proposal."""
        return self.structure.effects[-1]

    @property
    def splits(self) -> bool:
        """Whether a proposal splits a joint."""
        return EFFECTS[self.key[0]].splits

    def seen_in(self, look: Look) -> tuple[View, Array | None]:
        """View and first residual for the fit of a proposal.

        An effect that does nothing leaves all as it was, and so are the derivatives by all others.
        """
        return (look.view, look.fitted.residual) if self.neutral else (View(look.noise), None)


def proposals(
    look: Look,
    fitter: Fitter,
    data: InverseDynamicsProblem,
    extensions: Extensions,
    each: ParallelCandidates,
    effects: Sequence[str],
    bands: Sequence[InverseDynamicsProblem] = (),
) -> list[Proposal]:
    """Best few proposals of effects beside a structure that are worth a fit under its tracker."""
    found = look.fitted.structure.repaired
    residual = data.evaluate(found, found.theta)[0]
    listed = with_short_waves(candidates(found, data, residual, effects), found, bands)
    listed = [started(one, found, extensions.sizes) for one in listed]
    extended = _extended(look.fitted.structure, listed, extensions)
    groups = _side_by_side([one for one in extended if one.candidate.neutral], look)
    hopeful = _hopeful([one for one in extended if not one.candidate.neutral], look, fitter, extensions, each)
    groups += [_Pass([one], [one]) for one in hopeful]
    screened = each(
        "screening",
        lambda one: _screened(look, one, fitter, extensions),
        groups,
        lambda one: f"{one.present[0].candidate.label}, {look.fitted.tracker.label}",
    )
    told = [one for several in screened if not isinstance(several, Failure) for one in several]
    return _seated(sorted(told, key=lambda one: -one.gain), look.promising, fitter.settings)


@dataclass(frozen=True, eq=False)
class _Extended:
    """Possible proposal: a structure with one more effect, and its start values."""

    structure: Structure
    candidate: Candidate
    start: Mapping[str, float]
    side: Side

    def fresh(self, look: Look) -> list[str]:
        """Unknown parameters that a proposal adds."""
        return [name for name in self.structure.priors if name not in look.coarse.names]

    def felt(self, look: Look) -> list[str]:
        """Added parameters of a proposal with influence at its start: shapes of zero size have none."""
        effect, model = self.candidate.effect, self.structure.model
        own = model.effect(*self.candidate.key, self.structure.side(self.candidate.key)).parameter_names
        shapes = {name for short, name in own.items() if effect.parameter(short).shape}
        return [name for name in self.fresh(look) if not (self.candidate.neutral and name in shapes)]


@dataclass(frozen=True, eq=False)
class _Pass:
    """Pass of the screening for proposals: the effects that are present, and those screened."""

    present: Sequence[_Extended]
    asked: Sequence[_Extended]


def _extended(structure: Structure, listed: Sequence[Candidate], extensions: Extensions) -> list[_Extended]:
    """Possible proposals: structures with one more effect each, if these can be built."""
    found = []
    for candidate in listed:
        if spring_in_series(candidate.effect, candidate.site, structure.added) is not None:
            continue  # it is tried in the place of that spring
        for start, side in product(candidate.starts, sides_of(candidate, structure.model)):
            with contextlib.suppress(*ASTRAY):
                one = extensions.extended(structure, candidate, start, side)
                found.append(_Extended(one, candidate, start, side))
    return found


def _hopeful(
    several: Sequence[_Extended], look: Look, fitter: Fitter, extensions: Extensions, each: ParallelCandidates
) -> list[_Extended]:
    """Best few starts of each proposal that does something at its start, by predicted gain.

    This asks for no derivatives, which cost many times what a pass does where a joint is split. Far below its resonance
    a spring gives way by its load over its stiffness: where a part of that does best, the spring is stiffer.
    """

    def promised(one: _Extended) -> list[tuple[float, _Extended]]:
        followed = _zeroed(fitter.followed(one.structure, look.coarse.tracker, ()), look, fitter)
        gain, share = look.gain_along(followed)
        found = [(gain, replace(one, structure=followed.structure))]
        effect = one.candidate.effect  # within a gap the load tells no way
        if effect.splits and not effect.has_play and "stiffness" in one.start and 0.0 < share < 1.0:
            start = {**one.start, "stiffness": one.start["stiffness"] / share}
            with contextlib.suppress(*ASTRAY):
                other = extensions.extended(look.fitted.structure, one.candidate, start, one.side)
                followed = _zeroed(fitter.followed(other, look.coarse.tracker, ()), look, fitter)
                found.append((look.gain_along(followed)[0], replace(one, structure=followed.structure, start=start)))
        return found

    gains = each("trying", promised, several, lambda one: f"{one.candidate.label}, {look.fitted.tracker.label}")
    hopes: dict[Key, list[tuple[float, _Extended]]] = defaultdict(list)
    for found in gains:
        for gain, one in [] if isinstance(found, Failure) else found:
            if gain >= look.promising:
                hopes[one.candidate.key].append((gain, one))
    ordered = [sorted(found, key=lambda pair: -pair[0]) for found in hopes.values()]
    return [one for found in ordered for _, one in found[: fitter.settings.starts]]


def _zeroed(followed: Followed, look: Look, fitter: Fitter) -> Followed:
    """Followed proposal with new zeros of its deflection readings where they leave no mean error.

    What the spring of a proposal holds at rest is no part of what shows it: nobody knows where its reading begins.
    """
    structure, residual = followed.structure, followed.residual.copy()
    theta, channels = structure.theta.copy(), fitter.tracked.records[0].channels
    for name, channel in zeros_of(structure.model).items():
        if name in structure.priors and name not in look.coarse.names and channel in channels:
            place = channels.index(channel)
            mean = float(np.mean(residual[:, place]))
            theta[structure.place(name)] += mean
            residual[:, place] -= mean
    return replace(followed, structure=replace(structure, theta=theta), residual=residual)


def _side_by_side(neutral: Sequence[_Extended], look: Look) -> list[_Pass]:
    """Groups of neutral proposals that share one pass, each effect once in a group.

    The same effects stay together at all their start values, for which one model does: its code is made once.
    """
    starts: dict[tuple[Key, Side], list[_Extended]] = defaultdict(list)
    for one in neutral:
        starts[one.candidate.key, one.side].append(one)
    groups: list[list[list[_Extended]]] = []
    taken: list[int] = []
    for own in sorted(starts.values(), key=len):
        count, key = len(own[0].felt(look)), own[0].candidate.key
        fits = [
            place
            for place, (group, so_many) in enumerate(zip(groups, taken, strict=True))
            if so_many + count <= AT_ONCE and all(key != other[0].candidate.key for other in group)
        ]
        if fits:
            groups[fits[0]].append(own)
            taken[fits[0]] += count
        else:
            groups.append([own])
            taken.append(count)
    return [
        _Pass([own[min(number, len(own) - 1)] for own in group], [own[number] for own in group if number < len(own)])
        for group in groups
        for number in range(max(map(len, group)))
    ]


def _screened(look: Look, one_pass: _Pass, fitter: Fitter, extensions: Extensions) -> list[Proposal]:
    """Screened proposals of one pass under a tracker.

    Derivatives by what was unknown without them are taken as they were: a prediction of a gain can do with these.
    """
    first, *others = one_pass.present
    together, asked = first.structure, one_pass.asked
    with contextlib.suppress(*ASTRAY):
        for one in others:
            together = extensions.extended(together, one.candidate, one.start, one.side)
        names = [name for one in asked for name in one.felt(look)]
        followed = fitter.followed(together, look.coarse.tracker, names)
        return [Proposal(one.structure, _gain(look, followed, one), one.candidate.neutral) for one in asked]
    if not others:
        return []  # it runs away from the records
    return [found for one in asked for found in _screened(look, _Pass([one], [one]), fitter, extensions)]


def _gain(look: Look, followed: Followed, one: _Extended) -> float:
    """Predicted gain of a proposal by one step of a fit, from the derivatives of its pass, nats."""
    names, felt = one.fresh(look), one.felt(look)
    jacobian = np.zeros((*followed.residual.shape, len(names)))
    for name in felt:
        jacobian[:, :, names.index(name)] = followed.jacobian[:, :, followed.names.index(name)]
    return look.predicted_gain(replace(followed, structure=one.structure, names=tuple(names), jacobian=jacobian))


def _seated(ordered: Sequence[Proposal], promising: float, settings: Settings) -> list[Proposal]:
    """Best few starts of each proposal with a gain; neutral ones as many as the settings allow.

    Starts that gain the same differ in what does nothing there, and lead to the same place.
    """
    seated: dict[Key, list[Proposal]] = defaultdict(list)
    for proposal in ordered:
        several = seated[proposal.key]
        new = not any(_is_same(proposal, other, settings) for other in several)
        if proposal.gain >= promising and new and len(several) < settings.starts:
            several.append(proposal)
    neutral = [several for several in seated.values() if several and several[0].neutral][: settings.seats]
    others = [several for several in seated.values() if several and not several[0].neutral]
    return [proposal for several in neutral + others for proposal in several]


def _is_same(one: Proposal, other: Proposal, settings: Settings) -> bool:
    """Whether two starts of a proposal gain the same on the same side."""
    if abs(one.gain - other.gain) > settings.tolerance:
        return False
    return one.structure.side(one.key) == other.structure.side(other.key)
