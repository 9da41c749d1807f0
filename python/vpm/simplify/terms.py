"""Terms of the equations of motion that a model can do without: of a part of it, or of the whole machine.

Products of rates (Coriolis, centrifugal, gyroscopic terms) belong to bodies and flexible links. Entries of the mass
matrix couple the two sides of a joint. Terms of second order are those in the deflection of a flexible link.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from vpm.model import Model
from vpm.model.beams.level import size_of

#: What all of it is called in the place of single parts.
MACHINE = "the machine"
#: Levels that have terms of second order apart from the others: hinges between rigid segments have not.
CURVED = ("modal", "bezier", "deflection", "hermite", "strain", "elements")


def removable(model: Model) -> Iterator[tuple[str, str]]:
    """Terms that a model has, each with its place: single parts first, then the machine.

    Parameters
    ----------
    model : Model
    """
    content = model.to_dict()
    if content.get("velocity_terms", True):
        parts = [name for name, part in _moving(content).items() if part.get("velocity_terms", True)]
        yield from (("velocity", name) for name in parts if len(parts) > 1)
        yield "velocity", MACHINE
    joints = [name for name in coupling_joints(content) if content["joints"][name].get("inertia_coupling", True)]
    yield from (("coupling", name) for name in joints if len(joints) > 1)
    if joints:
        yield "coupling", MACHINE
    for name, beam in content.get("beams", {}).items():
        if beam["level"].startswith(CURVED) and beam.get("second_order", True):
            yield "second-order", name


def without_terms(model: Model, name: str, at: str) -> Model:
    """Model without some of its terms.

    Parameters
    ----------
    model : Model
    name : {"velocity", "coupling", "second-order"}
    at : str
        Parts with commas between them, or `MACHINE`.
    """
    content = model.to_dict()
    parts = at.split(", ")
    match name:
        case "velocity" if at == MACHINE:
            content["velocity_terms"] = False
        case "velocity":
            for part in parts:
                content["bodies" if part in content.get("bodies", {}) else "beams"][part]["velocity_terms"] = False
        case "coupling":
            for part in coupling_joints(content) if at == MACHINE else parts:
                content["joints"][part]["inertia_coupling"] = False
        case _:
            content["beams"][at]["second_order"] = False
    return type(model)(content)


def terms_site(name: str, at: str) -> str:
    """Where changes exclude each other: sets of parts do, flexible links do not.

    Parameters
    ----------
    name, at : str
        See `without_terms`.
    """
    return at if name == "second-order" else MACHINE


def coupling_joints(content: Mapping[str, Any]) -> tuple[str, ...]:
    """Joints that move with coordinates inward of them: across those the mass matrix has entries.

    Parameters
    ----------
    content : mapping
        Of a model file.
    """
    carriers = {joint["child"]: (name, joint) for name, joint in content.get("joints", {}).items()}
    beams = content.get("beams", {})

    def moves(part: str) -> bool:
        """Whether anything inward of the part, itself included, has coordinates."""
        if part in beams:
            return size_of(beams[part]["level"], beams[part]) > 0 or moves(beams[part]["parent"])
        if part not in carriers:
            return False
        _, joint = carriers[part]
        return joint["type"] != "fixed" or moves(joint["parent"])

    return tuple(name for name, joint in carriers.values() if joint["type"] != "fixed" and moves(joint["parent"]))


def _moving(content: Mapping[str, Any]) -> dict[str, Any]:
    """Bodies that a joint carries, and flexible links that bend: what has Coriolis and centrifugal terms of its own."""
    carried = [joint["child"] for joint in content.get("joints", {}).values() if joint["type"] != "fixed"]
    bodies = {name: content["bodies"][name] for name in carried}
    beams = content.get("beams", {}).items()
    return bodies | {name: beam for name, beam in beams if size_of(beam["level"], beam) > 0}
