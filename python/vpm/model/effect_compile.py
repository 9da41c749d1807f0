"""Effects of joints, bodies, beams and the world as the core reads them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from vpm.catalogue import EFFECTS
from vpm.model.effects import Effect
from vpm.model.splitting import bendings, deflections
from vpm.model.structure import Structure

#: Sites whose effects are entries of their own; those of actuators and sensors are keys of them.
EFFECT_SITES = frozenset({"joint", "body", "link", "beam", "world"})


def effect_json(effect: Effect, structure: Structure, index: Mapping[str, int]) -> list[dict[str, Any]]:
    """Entries of one effect; one that splits a joint has two, its law behind and the inertia before."""
    numbers = {short: index[dotted] for short, dotted in effect.parameter_names.items()}
    match effect.type.site:
        case "world":
            return [{"type": effect.name, "axes": [list(axis) for axis in structure.horizontal], **numbers}]
        case "beam":
            return [{"type": effect.name, "beam": structure.beams.index(effect.at), **numbers}]
        case "body":
            position = [numbers.pop(axis) for axis in "xyz"]
            return [{"type": effect.name, **_carrier(effect.at, structure), **numbers, "position": position}]
        case "link" if effect.at in structure.beams:
            numbers.pop("inertia")  # of what carries the beam
            return [{"type": effect.name, "beam": structure.beams.index(effect.at), **numbers}]
    return _on_joint(effect, structure, numbers, index)


def shaft_json(name: str, structure: Structure, index: Mapping[str, int]) -> dict[str, Any]:
    """Number of a transmission, and its ratios with the numbers of their joints."""
    places, document = structure.joints, structure.document
    ratios = [
        {"joint": places.index(joint), "ratio": index[f"{name}.ratios.{joint}"]}
        for joint in document.transmissions[name].ratios
    ]
    return {"transmission": list(document.transmissions).index(name), "ratios": ratios}


def _law(effect: Effect, seat: Mapping[str, Any], numbers: Mapping[str, int]) -> dict[str, Any]:
    """An effect that is nothing but a law on one coordinate."""
    formula = effect.type.formula
    if formula is None:
        return {"type": effect.name, **seat, **numbers}
    law = {"program": list(formula.program), "constants": list(formula.constants)}
    return {"type": "formula", **seat, **law, "parameters": list(numbers.values())}


def _on_joint(
    effect: Effect, structure: Structure, numbers: dict[str, int], index: Mapping[str, int]
) -> list[dict[str, Any]]:
    places = structure.joints
    if effect.at in structure.document.transmissions:
        return [_law(effect, shaft_json(effect.at, structure, index), numbers)]
    before, behind = effect.at, deflections(structure.document).get(effect.at)
    if effect.type.site == "link":
        before, behind = structure.turned[effect.at], bendings(structure.document)[effect.at]
    seat: dict[str, Any] = {"joint": places.index(before)}
    if effect.side == "link" and behind is not None:
        seat["behind"] = places.index(behind)
    if not effect.type.motion:
        return [_law(effect, seat, numbers)]
    rotor = next(name for name, one in EFFECTS.items() if one.rotor)
    inertia = {"type": rotor, "joint": places.index(before), "inertia": numbers.pop("inertia")}
    return [{"type": effect.name, "joint": places.index(behind or before), **numbers}, inertia]


def _carrier(site: str, structure: Structure) -> dict[str, int]:
    """Where a payload sits: at a body of the core, at one that is fixed to something, or at the tip of a beam."""
    if site in structure.beams:
        return {"beam": structure.beams.index(site)}
    if site in structure.welds:
        return {"weld": structure.welds.index(site)}
    return {"body": next(k for k, axis in enumerate(structure.axes) if axis.body == site)}
