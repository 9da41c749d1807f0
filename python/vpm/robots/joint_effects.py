"""Joint effects that robot files give as a number: damping, friction, stiffness."""

from __future__ import annotations

from vpm.catalogue import EFFECTS
from vpm.catalogue.traits import Plain


def plain_effect(plain: Plain) -> tuple[str, str]:
    """Joint effect of the catalogue that a robot file gives as one number, and its parameter."""
    effect = next(one for one in EFFECTS.values() if one.plain == plain)
    return effect.name, effect.parameters[0].name
