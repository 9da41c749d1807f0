"""The catalogue of physical effects: one file says everything about each of them, in `vpm.catalogue.effects`.

An effect is an ordinary component of a model, with a type, a site and parameters. The model file accepts what stands
here, the diagnosis tries what has a law, and the report speaks in the words that stand here. The laws are
in the core, one file per effect.

Units are templates, because the same law sits on different machines: ``{C}`` is the unit of the joint coordinate (m or
rad), ``{E}`` the unit of its effort (N or N m), ``{U}`` the unit of the actuator's command and ``{S}`` that of what the
sensor reads.
"""

from collections.abc import Collection, Mapping

from vpm.catalogue.entries import OWN, Catalogue
from vpm.catalogue.kinds import POSITIVE, SITE_KINDS, EffectParameter, EffectType, JointKind, Scale, Side, SiteKind
from vpm.catalogue.own import entry_of
from vpm.catalogue.signature import ANYWHERE, Signature
from vpm.errors import ModelError, near_match

__all__ = [
    "EFFECTS",
    "POSITIVE",
    "SITE_KINDS",
    "EffectParameter",
    "EffectType",
    "JointKind",
    "Scale",
    "Side",
    "SiteKind",
    "adopt",
    "effect_type",
    "effects_for_site",
    "register",
    "registered",
    "repair_of",
    "signature_of",
    "unregister",
    "without_law",
]

_CATALOGUE = Catalogue()
#: Every effect by name, in the order in which a page should list them; `register` and other packages add to it.
EFFECTS: Mapping[str, EffectType] = _CATALOGUE


def effect_type(name: str) -> EffectType:
    """Entry of the catalogue for the name of an effect.

    ``name``: for example ``"coulomb_friction"``.
    """
    try:
        return EFFECTS[name]
    except KeyError:
        raise ModelError(f'there is no effect "{name}"; {repair_of(name)}', where=name) from None


def repair_of(name: str) -> str:
    """What to do about an effect that is not in the catalogue: why that of another package is not, or near names."""
    near = near_match(name, EFFECTS, what="the catalogue has")
    return _CATALOGUE.troubles.get(name, near)


def signature_of(name: str) -> Signature:
    """Where an effect shows; anywhere for one that the catalogue does not have any more."""
    return EFFECTS[name].signature if name in EFFECTS else ANYWHERE


def without_law() -> EffectType:
    """The entry by which a diagnosis describes what it cannot name."""
    return next(effect for effect in EFFECTS.values() if not effect.has_law)


def effects_for_site(kind: str) -> tuple[EffectType, ...]:
    """Effects that can sit at a kind of component, in the order of the catalogue.

    Parameters
    ----------
    kind : {"joint", "body", "link", "beam", "actuator", "cylinder", "supply", "sensor", "world"}
    """
    if kind not in SITE_KINDS:
        raise ModelError(f'effects do not sit at a "{kind}"; {near_match(kind, SITE_KINDS)}', where=kind)
    # Other packages have effects of joints only: elsewhere nobody has to ask them.
    there = EFFECTS if kind == "joint" else _CATALOGUE.entries
    return tuple(effect for effect in there.values() if effect.site == kind)


def register(
    name: str,
    *,
    law: str,
    sizes: Mapping[str, str],
    shapes: Mapping[str, tuple[str, float]] | None = None,
    sentence: str,
    impossible: str = "",
    not_negative: Collection[str] = (),
    confused_with: Mapping[str, str] | None = None,
) -> EffectType:
    """Add an effect of joints to the catalogue: from here on models, diagnoses and reports know it.

    An entry lives as long as the process; a program that reads model files with it registers it first. An entry of a
    user may be registered again, one of vpm stays as it is.

    Parameters
    ----------
    name : str
        Small letters, digits and _.
    law : str
        Effort on the joint as a Python expression of ``q`` and ``v``, coordinate and velocity of the joint (SI), ``pi``
        and the parameters, with ``+ - * /``, whole powers, abs, sqrt, exp, tanh, sin and cos. The core runs it.
    sizes : mapping of str to str
        Parameters with which the law vanishes, and their units: templates with ``{C}`` for the unit of the coordinate
        and ``{E}`` for that of the effort.
    shapes : mapping of str to (str, float), optional
        All others: unit, and value (SI) to begin with; a fit may move it.
    sentence : str
        For reports; knows ``{at}`` and the parameters, as text with unit.
    impossible : str, optional
        What a value outside of the range would mean.
    not_negative : collection of str
        Parameters that physics keeps at or above zero; of shapes, above.
    confused_with : mapping of str to str, optional
        Effects that records may not tell from this one, and what tells them apart.

    Raises
    ------
    ModelError
        The law cannot be compiled, does not vanish with its sizes, or a name, unit or sentence cannot be used.

    Examples
    --------
    >>> effect = register(
    ...     "quintic_spring",
    ...     law="-hardening*q**5",
    ...     sizes={"hardening": "{E}/{C}^5"},
    ...     sentence="{at} is pulled back with the fifth power of its way, {hardening}.",
    ... )
    >>> effect.title
    'quintic spring'
    >>> unregister("quintic_spring")
    """
    if name in OWN:
        raise ModelError(f'the catalogue has an effect "{name}" already; choose another name', where=name)
    for other in confused_with or {}:
        effect_type(other)
    effect = entry_of(
        name,
        law=law,
        sizes=sizes,
        shapes=shapes,
        sentence=sentence,
        impossible=impossible,
        not_negative=not_negative,
        confused_with=confused_with,
    )
    _CATALOGUE.entries[name] = effect
    return effect


def unregister(name: str) -> None:
    """Take an effect that `register` added out of the catalogue again.

    Raises
    ------
    ModelError
        There is none of this name, or it is one of vpm.
    """
    effect_type(name)
    if name in OWN:
        raise ModelError(f'"{name}" belongs to vpm and stays in the catalogue', where=name)
    del _CATALOGUE.entries[name]


def registered() -> tuple[EffectType, ...]:
    """Effects of users that `vpm.catalogue.register` added."""
    return tuple(effect for effect in _CATALOGUE.entries.values() if effect.formula)


def adopt(effects: Collection[EffectType]) -> None:
    """Add what another process has registered, as `register` checked it there."""
    _CATALOGUE.entries.update((effect.name, effect) for effect in effects)
