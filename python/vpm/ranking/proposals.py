"""What could be missing from a structure, and which of it is worth a fit."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vpm.catalogue.kinds import Side
from vpm.discrepancy.candidates import Candidate, Key, candidates
from vpm.discrepancy.side_by_side import Failure, SideBySide
from vpm.identify import InverseDynamicsProblem
from vpm.initial import invertible
from vpm.ranking.extensions import Extensions, sides_of
from vpm.ranking.fit import Fitter, View
from vpm.ranking.look import Look
from vpm.ranking.settings import Settings
from vpm.ranking.starts import started
from vpm.ranking.structure import Structure

Array = NDArray[np.float64]


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
    """

    structure: Structure
    gain: float
    neutral: bool

    @property
    def key(self) -> Key:
        """Effect and site."""
        return self.structure.effects[-1]

    def seen_in(self, look: Look) -> tuple[View, Array | None]:
        """How it is looked at, and what is left where its fit begins, if that is known.

        An effect that does nothing leaves all as it was, and so are the derivatives by all others.
        """
        return (look.view, look.fitted.residual) if self.neutral else (View(look.view.noise), None)


def proposals(
    look: Look,
    fitter: Fitter,
    data: InverseDynamicsProblem,
    extensions: Extensions,
    each: SideBySide,
    effects: Sequence[str],
) -> list[Proposal]:
    """The best few of these effects beside what was found, that are worth a fit under its observer."""
    found = look.fitted.structure.repaired
    bare = invertible(found, data.joints)
    residual = data.evaluate(bare, bare.theta)[0]
    listed = [
        started(one, found, extensions.sizes) for one in candidates(found, data, residual, effects, simulated=True)
    ]
    items = [(one, start, side) for one in listed for start in one.starts for side in sides_of(one, found)]
    screened = each(
        "screening",
        lambda item: _screened(look, *item, fitter, extensions),
        items,
        lambda item: f"{item[0].label}, {look.fitted.observer.label}",
    )
    ordered = sorted((one for one in screened if not isinstance(one, Failure)), key=lambda one: -one.gain)
    return _seated(ordered, look.needed / fitter.settings.patience, fitter.settings)


def _screened(
    look: Look, candidate: Candidate, start: Mapping[str, float], side: Side, fitter: Fitter, extensions: Extensions
) -> Proposal:
    """One effect at start values under one observer.

    Derivatives by what was unknown without it are taken as they were: a prediction of a gain can do with these.

    Raises
    ------
    VpmError, ArithmeticError
        It cannot be there, or runs away from the records.
    """
    structure = extensions.extended(look.fitted.structure, candidate, start, side)
    fresh = [name for name in structure.priors if name not in look.coarse.names]
    followed = fitter.followed(structure, look.fitted.observer.coarse, fresh)
    return Proposal(structure, look.predicted_gain(followed), candidate.neutral)


def _seated(ordered: Sequence[Proposal], promising: float, settings: Settings) -> list[Proposal]:
    """The few best starts of each effect that promise a gain, for as many effects as there are seats.

    An effect that is there at its start already has one fit in any case: a step may say little of where it ends.
    """
    seated: dict[Key, list[Proposal]] = defaultdict(list)
    for proposal in ordered:
        several = seated[proposal.key]
        first = not several and not proposal.neutral
        if first or (proposal.gain >= promising and len(several) < settings.starts):
            several.append(proposal)
    neutral = [several for several in seated.values() if several and several[0].neutral][: settings.seats]
    others = [several for several in seated.values() if several and not several[0].neutral]
    return [proposal for several in neutral + others for proposal in several]
