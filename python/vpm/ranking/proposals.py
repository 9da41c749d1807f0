"""What could be missing from a structure, and which of it is worth a fit."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vpm.catalogue.kinds import Side
from vpm.discrepancy.candidates import Candidate, Key, candidates
from vpm.discrepancy.side_by_side import Failure, SideBySide
from vpm.identify import InverseDynamicsProblem
from vpm.identify.reuse import SPLITTING
from vpm.initial import invertible
from vpm.model import Model
from vpm.ranking.fit import Fitter, View
from vpm.ranking.look import Look
from vpm.ranking.settings import Settings
from vpm.ranking.sizes import Sizes
from vpm.ranking.starts import started
from vpm.ranking.structure import Structure, sides_taken

Array = NDArray[np.float64]

SIDES: tuple[Side, Side] = ("motor", "link")


@dataclass(frozen=True, eq=False)
class Proposal:
    """An effect at start values, as an observer sees it.

    Attributes
    ----------
    structure : Structure
    gain : float
        What one step of a fit is predicted to gain, nats.
    neutral : bool
        The effect does nothing where it begins.
    look : Look
        What there is without it, under the same observer.
    """

    structure: Structure
    gain: float
    neutral: bool
    look: Look

    @property
    def view(self) -> View:
        """How it is looked at; where an effect does nothing, derivatives by all others are those without it."""
        return self.look.view if self.neutral else View(self.look.view.noise)

    @property
    def residual(self) -> Array | None:
        """What is left where the fit begins, if that is known: an effect that does nothing leaves it as it was."""
        return self.look.fitted.residual if self.neutral else None

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
    looks: Sequence[Look],
    fitter: Fitter,
    data: InverseDynamicsProblem,
    sizes: Sizes,
    each: SideBySide,
    effects: Sequence[str],
) -> list[Proposal]:
    """Those of these effects that are worth a fit beside what was found: the best few under each observer."""
    found = looks[0].fitted.structure.repaired
    bare = invertible(found, data.joints)
    residual = data.evaluate(bare, bare.theta)[0]
    listed = [started(one, found, sizes) for one in candidates(found, data, residual, effects, simulated=True)]
    items = [
        (look, candidate, start, side)
        for look in looks
        for candidate in listed
        for start in candidate.starts
        for side in sides_of(candidate, found)
    ]
    screened = each(
        "screening",
        lambda item: _screened(*item, fitter, sizes),
        items,
        lambda item: f"{item[1].label}, {item[0].fitted.observer.label}",
    )
    chosen: list[Proposal] = []
    for look in looks:
        mine = [one for one in screened if not isinstance(one, Failure) and one.look is look]
        mine.sort(key=lambda one: -one.gain)
        chosen += _seated([one for one in mine if one.neutral], fitter.settings)
        chosen += _begun([one for one in mine if not one.neutral], fitter.settings)
    return chosen


def _screened(
    look: Look, candidate: Candidate, start: Mapping[str, float], side: Side, fitter: Fitter, sizes: Sizes
) -> Proposal:
    """One effect at start values under one observer.

    Derivatives by what was unknown without it are taken as they were: a prediction of a gain can do with these.

    Raises
    ------
    VpmError, ArithmeticError
        It cannot be there, or runs away from the records.
    """
    structure = extended(look.fitted.structure, candidate, start, side, sizes)
    fresh = [name for name in structure.priors if name not in look.coarse.names]
    followed = fitter.followed(structure, look.fitted.observer.coarse, fresh)
    return Proposal(structure, look.predicted_gain(followed), candidate.neutral, look)


def _seated(screened: Sequence[Proposal], settings: Settings) -> list[Proposal]:
    """The best start of each of the best effects, of which a step of a fit says well what they are good for."""
    taken: dict[Key, Proposal] = {}
    for proposal in screened:
        if proposal.gain < settings.least or len(taken) == settings.seats:
            break
        taken.setdefault(proposal.key, proposal)
    return list(taken.values())


def _begun(screened: Sequence[Proposal], settings: Settings) -> list[Proposal]:
    """The best starts of each effect that is there at its start already: a step says little of where it ends."""
    taken: dict[Key, list[Proposal]] = defaultdict(list)
    for proposal in screened:
        if len(taken[proposal.key]) < settings.starts:
            taken[proposal.key].append(proposal)
    return [proposal for several in taken.values() for proposal in several]
