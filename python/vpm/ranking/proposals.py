"""What could be missing from a structure, and which of it is worth a fit."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vpm.discrepancy.candidates import Candidate, Key, candidates
from vpm.discrepancy.side_by_side import Failure, SideBySide
from vpm.identify import InverseDynamicsProblem
from vpm.ranking.colour import Colour, plain
from vpm.ranking.settings import Settings
from vpm.ranking.sizes import Sizes
from vpm.ranking.starts import started
from vpm.ranking.structure import Fitted, Fitter, Structure, bounded_step

Array = NDArray[np.float64]

#: Ways to look at what an observer leaves: as it is, and whitened.
VIEWS = 2


@dataclass(frozen=True, eq=False)
class Proposal:
    """An effect at start values, as an observer sees it.

    Attributes
    ----------
    structure : Structure
    band : float
        Hz.
    colour : Colour
    gain : float
        What one step of a fit promises, nats.
    neutral : bool
        The effect does nothing where it begins.
    base : float
        Evidence without it under the same observer.
    """

    structure: Structure
    band: float
    colour: Colour
    gain: float
    neutral: bool
    base: float

    @property
    def key(self) -> Key:
        """Effect and site."""
        return self.structure.effects[-1]


def extended(structure: Structure, candidate: Candidate, start: Mapping[str, float], sizes: Sizes) -> Structure:
    """A structure with one more effect.

    Raises
    ------
    VpmError
        The effect cannot sit there with these values.
    """
    model = structure.model.with_effect(candidate.effect.name, candidate.site, **start)
    theta = model.theta.copy()
    for name, value in zip(structure.model.parameter_names, structure.theta, strict=True):
        theta[model.index(name)] = value
    effect = next(e for e in model.effects if (e.name, e.at) == candidate.key)
    priors = dict(structure.priors)
    for short, name in effect.parameter_names.items():
        parameter = candidate.effect.parameter(short)
        if name in structure.model.parameters or short in candidate.fixed:
            continue
        if not parameter.shape or parameter.learnt or short in start:
            priors[name] = sizes.prior(candidate, parameter, model.parameters[name].value)
    return Structure(model, theta, priors, (*structure.effects, candidate.key))


def proposals(
    found: Fitted, fitter: Fitter, data: InverseDynamicsProblem, sizes: Sizes, each: SideBySide
) -> list[Proposal]:
    """Effects of the catalogue that are worth a fit beside ``found``.

    They are the best few by each observer and each way to look at what it leaves: as it is, where an effect of slow
    motion is large, and whitened, where a weak one stands out.
    """
    model = found.structure.model.with_parameters(found.structure.values)
    seen = candidates(model, data, data.evaluate(model, model.theta)[0])
    listed = [started(candidate, model, sizes) for candidate in seen]
    references = [fitter.fitted(found.structure, band) for band in fitter.settings.bands]
    items = [(candidate, start) for candidate in listed for start in candidate.starts]
    screened = each(
        "screening",
        lambda item: [list(_seen(one, *item, fitter, sizes)) for one in references],
        items,
        lambda item: item[0].label,
    )
    ranked = [views for views in screened if not isinstance(views, Failure)]
    chosen: list[Proposal] = []
    for band in range(len(references)):
        for view in range(VIEWS):
            chosen += _seated([views[band][view] for views in ranked], fitter.settings)
    return chosen


def _seen(
    reference: Fitted, candidate: Candidate, start: Mapping[str, float], fitter: Fitter, sizes: Sizes
) -> Iterator[Proposal]:
    """One effect at start values under one observer, in each of the ways to look at what is left.

    Raises
    ------
    VpmError, ArithmeticError
        It cannot be there, or runs away from the records.
    """
    parts = fitter.observed.parts
    structure = extended(reference.structure, candidate, start, sizes)
    residual, jacobian = fitter.followed(structure, reference.band)
    for colour in (plain(reference.residual, parts), reference.colour):
        before = colour.whitened(reference.residual, parts)
        errors, slopes = colour.whitened(residual, parts), colour.whitened(jacobian, parts) * structure.slopes
        move = bounded_step(structure, errors, slopes, fitter.settings.reach)
        after = min(float(np.sum((errors + slopes @ move) ** 2)), float(errors @ errors))
        gain = 0.5 * len(before) * math.log(float(before @ before) / max(after, 1e-300))
        yield Proposal(structure, reference.band, colour, gain, candidate.neutral, reference.evidence)


def _seated(seen: list[Proposal], settings: Settings) -> list[Proposal]:
    """The best starts of the best effects."""
    taken: dict[Key, list[Proposal]] = defaultdict(list)
    for proposal in sorted(seen, key=lambda one: -one.gain):
        if proposal.gain < settings.tolerance:
            break
        if proposal.key not in taken and len(taken) == settings.seats:
            continue
        if len(taken[proposal.key]) < (1 if proposal.neutral else settings.starts):
            taken[proposal.key].append(proposal)
    return [proposal for several in taken.values() for proposal in several]
