"""The levels of a model, from rigid with ideal actuators to its own."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from vpm.errors import VpmError
from vpm.model import Model
from vpm.model.beams.level import size_of

#: What the lowest level is called, and the one with what the actuators do besides following their commands.
RIGID, ACTUATORS = "rigid", "rigid with its actuators"
#: Families of levels that flexible links climb through, where they have fewer coordinates than the model's own.
LINKS = (
    ("lumped(1)", "lumped(2)", "lumped(4)"),
    ("modal(1)", "modal(2)", "modal(3)"),
    ("bezier(2)", "bezier(3)", "bezier(4)"),
    ("elements(2)", "elements(4)", "elements(8)"),
)

#: Levels of one kind, each with its name, the coarsest first.
Family = list[tuple[str, Model]]


def families(model: Model) -> list[Family]:
    """Levels that the machine can have, by kind, the simplest first, its own last.

    Effects at actuators (a lag, a delay, a dead zone) are left out of the lowest one; flexible links are rigid in it.
    Levels of links whose model would not be a valid one are skipped.

    Parameters
    ----------
    model : Model
    """
    content = model.to_dict()
    beams: Mapping[str, Any] = content.get("beams", {})
    stiff = model.at(dict.fromkeys(beams, "rigid")) if beams else model
    ideal = stiff
    for effect in stiff.effects:
        if effect.at in model.actuators:
            ideal = ideal.without_effect(*effect.key)
    found = [[(RIGID, ideal)]]
    if len(ideal.effects) < len(stiff.effects):
        found.append([(ACTUATORS, stiff)])
    if not any(size_of(beam["level"], beam) for beam in beams.values()):
        return found
    for family in LINKS:
        made = [(level, each) for level in family if (each := _made(model, beams, level)) is not None]
        found += [made] if made else []
    return [*found, [(_own(beams), model)]]


def _made(model: Model, beams: Mapping[str, Any], level: str) -> Model | None:
    """Model with its links at a level, each at most as fine as its own; None where nothing changes or it is invalid."""
    finer = {name: level for name, beam in beams.items() if 0 < size_of(level, beam) < size_of(beam["level"], beam)}
    if not finer:
        return None
    try:
        made = model.at(finer)
        _ = made.core
    except VpmError:
        return None
    return made


def _own(beams: Mapping[str, Any]) -> str:
    return ", ".join(dict.fromkeys(str(beam["level"]) for beam in beams.values()))
