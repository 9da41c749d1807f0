"""What could be missing from a structure, and which of it is worth a fit."""

from __future__ import annotations

import contextlib
import math
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vpm.catalogue.kinds import Side
from vpm.discrepancy.candidates import Candidate, Key, candidates
from vpm.discrepancy.side_by_side import Failure, SideBySide
from vpm.errors import VpmError
from vpm.identify import InverseDynamicsProblem
from vpm.identify.reuse import SPLITTING
from vpm.model import Model
from vpm.ranking.colour import Colour, plain
from vpm.ranking.observed import STEPS, Observer
from vpm.ranking.settings import Settings
from vpm.ranking.sizes import Sizes
from vpm.ranking.starts import started
from vpm.ranking.structure import Fitted, Fitter, Structure, bounded_step

Array = NDArray[np.float64]

#: Ways to look at what an observer leaves: as it is, and whitened.
VIEWS = 2
SIDES: tuple[Side, Side] = ("motor", "link")


@dataclass(frozen=True, eq=False)
class Proposal:
    """An effect at start values, as an observer sees it.

    Attributes
    ----------
    structure : Structure
    observer : Observer
    colour : Colour
    gain : float
        What one step of a fit promises, nats.
    neutral : bool
        The effect does nothing where it begins.
    reference : Fitted
        What there is without it, under the same bandwidth.
    """

    structure: Structure
    observer: Observer
    colour: Colour
    gain: float
    neutral: bool
    reference: Fitted

    @property
    def key(self) -> Key:
        """Effect and site."""
        return self.structure.effects[-1]


def extended(
    structure: Structure, candidate: Candidate, start: Mapping[str, float], side: Side, sizes: Sizes
) -> Structure:
    """A structure with one more effect, on one side of what winds up or plays.

    What splits a joint takes the friction and the like that was there to that side.

    Raises
    ------
    VpmError
        The effect cannot sit there with these values.
    """
    splits = candidate.effect.name in SPLITTING
    if splits and side == "link":
        structure = structure.behind(candidate.site)
    model = structure.model.with_effect(
        candidate.effect.name, candidate.site, side="motor" if splits else side, **start
    )
    theta = model.theta.copy()
    for name, value in zip(structure.model.parameter_names, structure.theta, strict=True):
        theta[model.index(name)] = value
    effect = model.effect(*candidate.key, "motor" if splits else side)
    priors = dict(structure.priors)
    for short, name in effect.parameter_names.items():
        parameter = candidate.effect.parameter(short)
        if name in structure.model.parameters or short in candidate.fixed:
            continue
        if not parameter.shape or parameter.learnt or short in start:
            priors[name] = sizes.prior(candidate, parameter, model.parameters[name].value)
    shown = (*structure.shown, *(effect.parameter_names[short] for short in start if short in candidate.bounds))
    return Structure(model, theta, priors, (*structure.effects, candidate.key), shown)


def sides_of(candidate: Candidate, model: Model) -> tuple[Side, ...]:
    """Sides of a joint on which an effect may sit, or what it splits there may stay."""
    site = candidate.site
    if candidate.effect.name in SPLITTING:
        return SIDES if any(effect.at == site and effect.type.has_sides for effect in model.effects) else SIDES[:1]
    return SIDES if candidate.effect.has_sides and model.joint_behind(site) else SIDES[:1]


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
    references = observers(found, fitter)
    items = [
        (one, candidate, start, side)
        for one in references
        for candidate in listed
        if candidate.neutral or one is not found or len(references) <= len(fitter.settings.bands)
        for start in candidate.starts
        for side in sides_of(candidate, model)
    ]
    screened = each(
        "screening",
        lambda item: _seen(*item, fitter, sizes),
        items,
        lambda item: f"{item[1].label}, {item[0].observer.label}",
    )
    chosen: list[Proposal] = []
    for one in references:
        pairs = [pair for pair in screened if not isinstance(pair, Failure) and pair[0].reference is one]
        for view in range(VIEWS):
            chosen += _seated([pair[view] for pair in pairs if pair[view].neutral], fitter.settings)
        chosen += _begun([max(pair, key=_gain) for pair in pairs if not pair[0].neutral], fitter.settings)
    return chosen


def observers(found: Fitted, fitter: Fitter) -> list[Fitted]:
    """What was found, under the observers that search and at its own bandwidth, unless that is one of theirs."""
    own = found.observer
    others = [band for band in fitter.settings.bands if not 0.5 < band / own.band < 2.0]
    references = [found]
    for band in others:
        with contextlib.suppress(VpmError):  # a slow observer may lose what hangs behind a contact
            references.append(fitter.fitted(found.structure, Observer(band, own.steps)))
    return references


def _seen(
    reference: Fitted, candidate: Candidate, start: Mapping[str, float], side: Side, fitter: Fitter, sizes: Sizes
) -> list[Proposal]:
    """One effect at start values under one observer, in each of the ways to look at what is left.

    Raises
    ------
    VpmError, ArithmeticError
        It cannot be there, or runs away from the records.
    """
    parts = fitter.observed.parts
    structure = extended(reference.structure, candidate, start, side, sizes)
    observer = reference.observer
    if len(structure.model.joints) > len(reference.structure.model.joints):
        observer = replace(observer, steps=max(observer.steps, STEPS))
    residual, jacobian = fitter.followed(structure, observer)
    views = []
    for colour in (plain(reference.residual, parts), reference.colour):
        before = colour.whitened(reference.residual, parts)
        roots = colour.roots(before)
        before = before * roots
        errors = colour.whitened(residual, parts) * roots
        slopes = colour.whitened(jacobian, parts) * structure.slopes * roots[:, None]
        move = bounded_step(structure, errors, slopes, fitter.settings.reach)
        after = min(float(np.sum((errors + slopes @ move) ** 2)), float(errors @ errors))
        gain = 0.5 * len(before) * math.log(float(before @ before) / max(after, 1e-300))
        views.append(Proposal(structure, observer, colour, gain, candidate.neutral, reference))
    return views


def _seated(seen: list[Proposal], settings: Settings) -> list[Proposal]:
    """The best start of each of the best effects, of which a step of a fit says well what they are good for."""
    taken: dict[Key, Proposal] = {}
    for proposal in sorted(seen, key=_gain, reverse=True):
        if proposal.gain < settings.least or len(taken) == settings.seats:
            break
        taken.setdefault(proposal.key, proposal)
    return list(taken.values())


def _begun(seen: list[Proposal], settings: Settings) -> list[Proposal]:
    """The best starts of each effect that is there at its start already: a step says little of where it ends."""
    taken: dict[Key, list[Proposal]] = defaultdict(list)
    for proposal in sorted(seen, key=_gain, reverse=True):
        if len(taken[proposal.key]) < settings.starts:
            taken[proposal.key].append(proposal)
    return [proposal for several in taken.values() for proposal in several]


def _gain(proposal: Proposal) -> float:
    return proposal.gain
