"""Extensions of a structure by one effect."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from weakref import WeakKeyDictionary

from vpm.catalogue.kinds import Side
from vpm.discrepancy.screening.candidates import Candidate, Key
from vpm.discrepancy.unknown_zeros import with_unknown_zeros
from vpm.model import Model
from vpm.model.splitting import spring_in_series
from vpm.ranking.model_structure import Structure, sides_taken
from vpm.ranking.parameter_priors import Sizes, stated

#: How sharply a law bends: a detail that need not be seen.
DETAILS = frozenset({"transition_velocity", "width"})
SIDES: tuple[Side, Side] = ("motor", "link")
#: An effect, its side, and which of its numbers are given.
_Kind = tuple[Key, Side, frozenset[str]]


class Extensions:
    """Extensions of structures by one effect; their models are built once for all start values.

    Parameters
    ----------
    sizes : Sizes
        For what is known of the parameters of effects.
    """

    def __init__(self, sizes: Sizes) -> None:
        self.sizes = sizes
        self._made: WeakKeyDictionary[Model, dict[_Kind, Model]] = WeakKeyDictionary()

    def extended(self, structure: Structure, candidate: Candidate, start: Mapping[str, float], side: Side) -> Structure:
        """Extension of a structure by one effect, on one side of a joint that is split.

        What splits a joint takes the friction and the like that was there to that side. A logged deflection behind it
        has an unknown zero.

        Raises
        ------
        VpmError
            The effect cannot sit there with these values.
        """
        made = self._made.setdefault(structure.model, {})
        kind = (candidate.key, side, frozenset(start))
        splits = splits_more(candidate, structure.model)
        if splits and side == "link":
            structure = structure.beside(candidate.site, side)
        own: Side = "motor" if splits else side
        if kind not in made:
            model = structure.model.with_effect(candidate.effect.name, candidate.site, side=own, **start)
            made[kind], _ = with_unknown_zeros(model, self.sizes.records) if splits else (model, [])
        effect, carried = made[kind].effect(*candidate.key, own), structure.carried(made[kind])
        zeros = stated(made[kind]) if splits else {}
        priors = {**carried.priors, **{name: zeros[name] for name in zeros if name not in structure.model.parameters}}
        for short, name in effect.parameter_names.items():
            if name in structure.model.parameters:
                continue
            parameter, place = candidate.effect.parameter(short), carried.model.index(name)
            carried.theta[place] = start.get(short, carried.theta[place])
            shown = short not in candidate.fixed or short in candidate.bounds
            free = shown and (not parameter.shape or parameter.learnt or short in start)
            if free:
                priors[name] = self.sizes.prior(candidate, parameter, float(carried.theta[place]))
        shapes = set(start) & set(candidate.bounds) - DETAILS
        limited = (name for short, name in effect.parameter_names.items() if short in shapes)
        return replace(
            carried,
            priors=priors,
            effects=(*structure.effects, candidate.key),
            range_limited=(*carried.range_limited, *limited),
        )


def splits_more(candidate: Candidate, model: Model) -> bool:
    """Whether an extension splits a joint: a play in series with a spring leaves it as it is."""
    return candidate.effect.splits and spring_in_series(candidate.effect, candidate.site, model.effects) is None


def sides_of(candidate: Candidate, model: Model) -> tuple[Side, ...]:
    """Sides of a joint for an extension: where the effect sits, or where other effects stay after a split."""
    site = candidate.site
    if splits_more(candidate, model):
        return SIDES if sides_taken(model, site) else SIDES[:1]
    return SIDES if candidate.effect.has_sides and model.joint_behind(site) else SIDES[:1]
