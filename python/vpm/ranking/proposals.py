"""What could be missing from a structure, and which of it is worth a fit."""

from __future__ import annotations

import contextlib
import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vpm.catalogue import EFFECTS
from vpm.catalogue.kinds import Side
from vpm.discrepancy.candidates import Candidate, Key, candidates
from vpm.discrepancy.side_by_side import Failure, SideBySide
from vpm.identify import InverseDynamicsProblem
from vpm.identify.reuse import SPLITTING
from vpm.initial import invertible
from vpm.model import Model
from vpm.ranking.fit import ASTRAY, Fitted, Fitter, Followed, View, bounded_step, in_roots
from vpm.ranking.noise_model import NoiseModel, white_noise
from vpm.ranking.observed import Observer, fewest_steps
from vpm.ranking.settings import Settings
from vpm.ranking.sizes import Sizes
from vpm.ranking.starts import started
from vpm.ranking.structure import Structure, sides_taken

Array = NDArray[np.float64]

SIDES: tuple[Side, Side] = ("motor", "link")


class Reference:
    """What there is without another effect, and one way to look at what an observer leaves of it.

    Attributes
    ----------
    fitted : Fitted
    followed : Followed
    view : View
        Derivatives by what is unknown already are taken as known for structures with an effect more.
    cost : float
        See `Fitter.cost`.
    """

    def __init__(self, fitted: Fitted, followed: Followed, noise: NoiseModel, fitter: Fitter) -> None:
        self.fitted, self.followed, parts = fitted, followed, fitter.observed.parts
        self.view = View(noise, dict(zip(followed.names, noise.whitened(followed.jacobian, parts).T, strict=True)))
        self.cost = fitter.cost(followed.structure, followed.residual, noise)
        self._parts, self._reach = parts, fitter.settings.reach
        errors = noise.whitened(followed.residual, parts)
        self._roots = noise.roots(errors)
        self._left = float(np.sum((errors * self._roots) ** 2))

    def predicted_gain(self, other: Followed) -> float:
        """What another structure gains by a step of a fit, or as it stands, nats."""
        errors, slopes = in_roots(*self.view.errors(other, self._parts), self._roots)
        move = bounded_step(other.structure, errors, slopes, self._reach)
        left = min(float(np.sum((errors + slopes @ move) ** 2)), float(errors @ errors))
        return 0.5 * len(errors) * math.log(self._left / max(left, 1e-300))


@dataclass(frozen=True, eq=False)
class Proposal:
    """An effect at start values, as an observer sees it.

    Attributes
    ----------
    structure : Structure
    observer : Observer
    gain : float
        What one step of a fit is predicted to gain, nats.
    neutral : bool
        The effect does nothing where it begins.
    reference : Reference
        What there is without it, under the same bandwidth.
    """

    structure: Structure
    observer: Observer
    gain: float
    neutral: bool
    reference: Reference

    @property
    def view(self) -> View:
        """How it is looked at; where an effect does nothing, derivatives by all others are those without it."""
        return self.reference.view if self.neutral else View(self.reference.view.noise, {})

    @property
    def residual(self) -> Array | None:
        """What is left where the fit begins, if that is known: an effect that does nothing leaves it as it was."""
        return self.reference.followed.residual if self.neutral else None

    @property
    def key(self) -> Key:
        """Effect and site."""
        return self.structure.effects[-1]


def extended(
    structure: Structure, candidate: Candidate, start: Mapping[str, float], side: Side, sizes: Sizes
) -> Structure:
    """A structure with one more effect, on one side of a joint that is split.

    What splits a joint takes the friction and the like that was there to that side.

    Raises
    ------
    VpmError
        The effect cannot sit there with these values.
    """
    splits = candidate.effect.name in SPLITTING
    if splits and side == "link":
        structure = structure.beside(candidate.site, side)
    side = "motor" if splits else side
    model = structure.model.with_effect(candidate.effect.name, candidate.site, side=side, **start)
    effect, carried = model.effect(*candidate.key, side), structure.carried(model)
    priors = dict(carried.priors)
    for short, name in effect.parameter_names.items():
        parameter = candidate.effect.parameter(short)
        if name in structure.model.parameters or short in candidate.fixed:
            continue
        if not parameter.shape or parameter.learnt or short in start:
            priors[name] = sizes.prior(candidate, parameter, model.parameters[name].value)
    limited = (*carried.range_limited, *(effect.parameter_names[short] for short in start if short in candidate.bounds))
    return replace(carried, priors=priors, effects=(*structure.effects, candidate.key), range_limited=limited)


def sides_of(candidate: Candidate, model: Model) -> tuple[Side, ...]:
    """Sides of a joint on which an effect may sit, or what it splits there may stay."""
    site = candidate.site
    if candidate.effect.name in SPLITTING:
        return SIDES if sides_taken(model, site) else SIDES[:1]
    return SIDES if candidate.effect.has_sides and model.joint_behind(site) else SIDES[:1]


def proposals(
    found: Fitted,
    fitter: Fitter,
    data: InverseDynamicsProblem,
    sizes: Sizes,
    each: SideBySide,
    only: Key | None = None,
) -> list[Proposal]:
    """Effects of the catalogue, or ``only`` one of them, that are worth a fit beside ``found``.

    They are the best few by each observer and each way to look at what it leaves.
    """
    model = found.structure.repaired
    bare = invertible(model, data.joints)
    residual = data.evaluate(bare, bare.theta)[0]
    plausible = candidates(model, data, residual, tuple(EFFECTS), simulated=True)
    listed = [started(candidate, model, sizes) for candidate in plausible if only in (None, candidate.key)]
    looks = [_references(one, fitter) for one in observers(found, fitter)]
    items = [
        (several, candidate, start, side)
        for place, several in enumerate(looks)
        for candidate in listed
        if candidate.neutral or place > 0 or len(looks) <= len(fitter.settings.bands)
        for start in candidate.starts
        for side in sides_of(candidate, model)
    ]
    screened = each(
        "screening",
        lambda item: _screened(*item, fitter, sizes),
        items,
        lambda item: f"{item[1].label}, {item[0][0].followed.observer.label}",
    )
    chosen: list[Proposal] = []
    for several in looks:
        mine = [one for one in screened if not isinstance(one, Failure) and one[0].reference is several[0]]
        for alike in zip(*mine, strict=True):
            chosen += _seated([proposal for proposal in alike if proposal.neutral], fitter.settings)
        chosen += _begun([max(one, key=_gain) for one in mine if not one[0].neutral], fitter.settings)
    return chosen


def observers(found: Fitted, fitter: Fitter) -> list[Fitted]:
    """What was found, under its own observer first, and under those that search, unless one of them is like its own."""
    references = [found]
    for band in fitter.settings.bands:
        if not 0.5 < band / found.observer.band < 2.0:
            with contextlib.suppress(*ASTRAY):  # a slow observer may lose what hangs behind a contact
                references.append(fitter.fitted(found.structure, replace(found.observer, band=band)))
    return references


def _references(found: Fitted, fitter: Fitter) -> list[Reference]:
    """Ways to look at it: as it is, where an effect of slow motion is large, and whitened, where a weak one is."""
    followed = fitter.followed(found.structure, found.observer)
    noises = white_noise(followed.residual, fitter.observed.parts), found.noise
    return [Reference(found, followed, noise, fitter) for noise in noises]


def _screened(
    references: Sequence[Reference],
    candidate: Candidate,
    start: Mapping[str, float],
    side: Side,
    fitter: Fitter,
    sizes: Sizes,
) -> list[Proposal]:
    """One effect at start values under one observer, in each of the ways to look at what is left.

    Derivatives by what was unknown without it are taken as they were: a prediction of a gain can do with these.

    Raises
    ------
    VpmError, ArithmeticError
        It cannot be there, or runs away from the records.
    """
    without = references[0].followed
    structure = extended(without.structure, candidate, start, side, sizes)
    observer = replace(without.observer, steps=max(without.observer.steps, fewest_steps(structure.model)))
    fresh = [name for name in structure.priors if name not in without.names]
    residual = without.residual if candidate.neutral else None
    followed = fitter.followed(structure, observer, fresh, residual=residual)
    return [Proposal(structure, observer, one.predicted_gain(followed), candidate.neutral, one) for one in references]


def _seated(screened: list[Proposal], settings: Settings) -> list[Proposal]:
    """The best start of each of the best effects, of which a step of a fit says well what they are good for."""
    taken: dict[Key, Proposal] = {}
    for proposal in sorted(screened, key=_gain, reverse=True):
        if proposal.gain < settings.least or len(taken) == settings.seats:
            break
        taken.setdefault(proposal.key, proposal)
    return list(taken.values())


def _begun(screened: list[Proposal], settings: Settings) -> list[Proposal]:
    """The best starts of each effect that is there at its start already: a step says little of where it ends."""
    taken: dict[Key, list[Proposal]] = defaultdict(list)
    for proposal in sorted(screened, key=_gain, reverse=True):
        if len(taken[proposal.key]) < settings.starts:
            taken[proposal.key].append(proposal)
    return [proposal for several in taken.values() for proposal in several]


def _gain(proposal: Proposal) -> float:
    return proposal.gain
