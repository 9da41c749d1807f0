"""Effects that other descriptions of robots have as a number of a joint: damping, friction, stiffness."""

from __future__ import annotations

from vpm.catalogue import EFFECTS
from vpm.catalogue.traits import Plain


def plain_effect(plain: Plain) -> tuple[str, str]:
    """Name of the effect of the catalogue that is one of them, and of the parameter that is its number."""
    effect = next(one for one in EFFECTS.values() if one.plain == plain)
    return effect.name, effect.parameters[0].name
