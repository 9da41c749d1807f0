"""Terms of the equations of motion that a model leaves out part by part: by name in the file, by number in the core."""

from collections.abc import Iterator, Mapping

from vpm.model.messages import Problem, place
from vpm.model.schema import Document
from vpm.model.structure import Structure


def omissions(structure: Structure) -> Mapping[str, list[int]]:
    """Omissions of a model, by the numbers of bodies, joints and beams of the core."""
    document = structure.document
    # A joint of several coordinates is several joints with massless carriers, which go with the body at their end.
    children = {name: joint.child for name, joint in document.joints.items()}
    still = {name for name, body in document.bodies.items() if not body.velocity_terms}
    loose = [name for name, joint in document.joints.items() if not joint.inertia_coupling]
    first = {axis.joint: number for number, axis in reversed(list(enumerate(structure.axes)))}
    found = {
        "velocity_of_bodies": [
            k for k, axis in enumerate(structure.axes) if (axis.body or children.get(axis.joint)) in still
        ],
        "velocity_of_beams": _beams(structure, "velocity_terms"),
        "coupling": sorted(first[name] for name in loose if name in first),
        "second_order": _beams(structure, "second_order"),
    }
    return {key: numbers for key, numbers in found.items() if numbers}


def omission_problems(document: Document, structure: Structure) -> Iterator[Problem]:
    """Problems of omissions: terms that a part does not have by itself."""
    carriers = {joint.child: joint.parent for joint in document.joints.values() if joint.type == "fixed"}
    for name in structure.welds:
        if not document.bodies[name].velocity_terms:
            rest = (
                f'is false, but {name} is fixed to "{carriers.get(name, "world")}" and has no velocity terms apart '
                "from those; remove it, or write it there"
            )
            yield Problem(place("bodies", name, "velocity_terms"), rest)
    for name, joint in document.joints.items():
        if joint.type == "fixed" and not joint.inertia_coupling:
            rest = "is false, but a fixed joint has no acceleration of its own that could couple; remove it"
            yield Problem(place("joints", name, "inertia_coupling"), rest)


def _beams(structure: Structure, switch: str) -> list[int]:
    return [k for k, name in enumerate(structure.beams) if not getattr(structure.document.beams[name], switch)]
