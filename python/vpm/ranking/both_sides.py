"""Friction of a joint on both of its sides, once an effect has split it."""

from __future__ import annotations

from collections.abc import Collection

from vpm.catalogue import EFFECTS
from vpm.discrepancy.screening.candidates import Candidate
from vpm.ranking.model_structure import Structure
from vpm.ranking.structure_extensions import SIDES, Extensions


def on_both_sides(structure: Structure, extensions: Extensions, names: Collection[str], most: int) -> Structure:
    """Structure with the usual friction of joints that were split on their other side too, up to ``most`` effects.

    Only friction of the ``names`` that were asked for counts.

    A model of a whole joint says how much rubs there, and not before or behind what gives way. All of it came to one
    side with what split the joint.
    """
    model, split = structure.model, {site for name, site in structure.effects if EFFECTS[name].splits}
    taken = {(one.name, one.at, one.side) for one in model.effects}
    for effect in model.effects:
        usual = effect.type.usual == "friction" and effect.name in names
        if not usual or effect.at not in split or len(structure.effects) == most:
            continue
        (other,) = (side for side in SIDES if side != effect.side)
        if (effect.name, effect.at, other) in taken or (effect.name, effect.at) in structure.effects:
            continue
        # It turns round at the same speed there.
        shapes = tuple(one.name for one in effect.type.parameters if one.shape)
        values = {short: float(structure.theta[structure.place(effect.parameter_names[short])]) for short in shapes}
        start = {**{one.name: 0.0 for one in effect.type.parameters}, **values}
        structure = extensions.extended(
            structure, Candidate(effect.type, effect.at, (start,), fixed=shapes), start, other
        )
    return structure
