"""The catalogue of physical effects: one table that says everything about each of them.

An effect is an ordinary component of a model, with a type, a site and parameters. The model file accepts what stands
here, the diagnosis tries what stands here, and the report speaks in the words that stand here. The laws themselves are
in the core, one file per effect.

Units are templates, because the same law sits on different machines: ``{C}`` is the unit of the joint coordinate (m or
rad), ``{E}`` the unit of its effort (N or N m), ``{U}`` the unit of the actuator's command and ``{S}`` that of what the
sensor reads.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from vpm.catalogue.elsewhere import ACTUATOR_EFFECTS, BODY_EFFECTS, SENSOR_EFFECTS
from vpm.catalogue.empirical import EMPIRICAL_EFFECTS
from vpm.catalogue.joint import JOINT_EFFECTS
from vpm.catalogue.kinds import POSITIVE, SITE_KINDS, EffectParameter, EffectType, JointKind, Scale, SiteKind
from vpm.errors import ModelError, near_match

__all__ = [
    "EFFECTS",
    "POSITIVE",
    "SITE_KINDS",
    "EffectParameter",
    "EffectType",
    "JointKind",
    "Scale",
    "SiteKind",
    "effect_type",
    "effects_for_site",
]

#: Every effect by name, in the order in which a page should list them.
EFFECTS: Mapping[str, EffectType] = MappingProxyType(
    {
        effect.name: effect
        for effect in (*JOINT_EFFECTS, *BODY_EFFECTS, *ACTUATOR_EFFECTS, *SENSOR_EFFECTS, *EMPIRICAL_EFFECTS)
    }
)


def effect_type(name: str) -> EffectType:
    """Entry of the catalogue.

    Parameters
    ----------
    name : str
        For example ``"coulomb_friction"``.

    Raises
    ------
    ModelError
        The name is not in the catalogue; the message names near ones.
    """
    try:
        return EFFECTS[name]
    except KeyError:
        repair = near_match(name, EFFECTS, what="the catalogue has")
        raise ModelError(f'there is no effect "{name}"; {repair}', where=name) from None


def effects_for_site(kind: str) -> tuple[EffectType, ...]:
    """Effects that can sit at a kind of component, in the order of the catalogue.

    Parameters
    ----------
    kind : {"joint", "body", "actuator", "sensor"}

    Raises
    ------
    ModelError
        There is no such kind of site.
    """
    if kind not in SITE_KINDS:
        raise ModelError(f'effects do not sit at a "{kind}"; {near_match(kind, SITE_KINDS)}', where=kind)
    return tuple(effect for effect in EFFECTS.values() if effect.site == kind)
