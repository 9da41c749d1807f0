"""What hangs on what: names, parents, places along beams, loops, and the axes of joints."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

from vpm.errors import near_match
from vpm.model.expand import coordinate_names
from vpm.model.messages import Problem, place
from vpm.model.schema import SECTIONS, Document, Joint

WORLD = "world"
_RESERVED = {WORLD, "time"}
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")

#: A joint axis may be this far from unit length; it is then normalised.
AXIS_TOLERANCE = 1e-3
#: A place along a beam may be this share of its length beyond the tip: numbers in files are rounded.
TIP_TOLERANCE = 1e-9


def name_problems(document: Document) -> Iterator[Problem]:
    """Names that cannot be written in a dotted name, that are reserved, or that two components share."""
    owner: dict[str, str] = {}
    for section in SECTIONS:
        if section == "channels":
            continue
        for name in getattr(document, section):
            where = place(section, name)
            if not _NAME.fullmatch(name):
                yield Problem(where, "has a name that is not letters, digits, - and _ after a letter; rename it")
            elif name in _RESERVED:
                yield Problem(where, f'has the name "{name}", which is reserved; rename it')
            elif name in owner:
                yield Problem(
                    where, f"has the same name as {owner[name]}; all components share one namespace, rename one"
                )
            owner.setdefault(name, where)
    for name, joint in document.joints.items():
        for coordinate in coordinate_names(name, joint):
            if coordinate != name and coordinate in owner:
                rest = f'has a coordinate "{coordinate}", which is also the name of {owner[coordinate]}; rename one'
                yield Problem(place("joints", name), rest)
            owner.setdefault(coordinate, place("joints", name))


def tree_problems(document: Document) -> Iterator[Problem]:
    """Unknown parents, bodies with no joint or several, places outside of a beam, loops."""
    for keys, parent, at in _attachments(document):
        yield from _attachment_problems(keys, parent, at, document)
    yield from _child_problems(document)
    yield from _loop_problems(document)


def _attachments(document: Document) -> Iterator[tuple[tuple[str, ...], str, float | None]]:
    """Everything that sits somewhere: its place in the file, its parent, and how far along that."""
    for name, joint in document.joints.items():
        yield ("joints", name), joint.parent, joint.at
    for name, beam in document.beams.items():
        yield ("beams", name), beam.parent, beam.at
    for name, marker in document.markers.items():
        yield ("markers", name), marker.parent, marker.at
    for name, line in document.lines.items():
        yield ("lines", name, "from"), line.start.parent, line.start.at
        yield ("lines", name, "to"), line.end.parent, line.end.at
    for name, contact in document.contacts.items():
        yield ("contacts", name), contact.parent, contact.at
    for name, bushing in document.bushings.items():
        yield ("bushings", name, "a"), bushing.a.parent, bushing.a.at
        yield ("bushings", name, "b"), bushing.b.parent, bushing.b.at
    for name, loop in document.loops.items():
        yield ("loops", name, "a"), loop.a.parent, loop.a.at
        yield ("loops", name, "b"), loop.b.parent, loop.b.at


def _attachment_problems(keys: tuple[str, ...], parent: str, at: float | None, document: Document) -> Iterator[Problem]:
    if parent not in (WORLD, *document.bodies, *document.beams):
        repair = near_match(parent, [WORLD, *document.bodies, *document.beams], what="it has")
        yield Problem(
            place(*keys, "parent"),
            f'is "{parent}", which is no body{" or beam" if document.beams else ""} of the model; {repair}',
        )
    elif at is not None and parent not in document.beams:
        rest = f'is {at:g} m, but "{parent}" is no beam to go along; remove it, or name a beam as parent'
        yield Problem(place(*keys, "at"), rest)
    elif at is not None:
        yield from outside_problems(keys, at, parent, document)


def outside_problems(keys: tuple[str, ...], at: float, beam: str, document: Document) -> Iterator[Problem]:
    """A place before the root or beyond the tip of a beam."""
    length, solid = document.beams[beam].reach, document.beams[beam].solid
    if solid is not None:
        if at not in range(len(solid.interfaces) + 1):
            known = ", ".join(f"{number} ({name})" for number, name in enumerate(("root", *solid.interfaces)))
            rest = f'is {at:g}, but on "{beam}", a reduced solid, it is the number of an interface: {known}; take one'
            yield Problem(place(*keys, "at"), rest)
    elif not 0.0 <= at <= length * (1.0 + TIP_TOLERANCE):
        yield Problem(
            place(*keys, "at"), f'is {at:g} m, but beam "{beam}" goes from 0 to {length:g} m; correct the place'
        )


def _child_problems(document: Document) -> Iterator[Problem]:
    owner: dict[str, str] = {}
    for name, joint in document.joints.items():
        where = place("joints", name, "child")
        if joint.child in document.beams:
            rest = f'is "{joint.child}", a beam, but a joint carries a body; give beams.{joint.child} a body as parent'
            yield Problem(where, rest)
        elif joint.child not in document.bodies:
            repair = near_match(joint.child, document.bodies, what="it has")
            yield Problem(where, f'is "{joint.child}", which is no body of the model; {repair}')
        elif joint.child in owner:
            rest = f'is "{joint.child}", which joint "{owner[joint.child]}" already carries; a body has one joint'
            yield Problem(where, rest)
        owner.setdefault(joint.child, name)
    for body in document.bodies:
        if body not in owner:
            yield Problem(place("bodies", body), f'hangs on no joint; add a joint with child = "{body}", or remove it')


def _loop_problems(document: Document) -> Iterator[Problem]:
    parent = {joint.child: joint.parent for joint in document.joints.values()}
    parent |= {name: beam.parent for name, beam in document.beams.items()}
    settled: set[str] = set()
    for name in (*document.bodies, *document.beams):
        way = [name]
        while way[-1] in parent and way[-1] not in settled and parent[way[-1]] not in way:
            way.append(parent[way[-1]])
        if way[-1] in parent and way[-1] not in settled:  # the last one's parent is already on the way
            loop = [*way[way.index(parent[way[-1]]) :], parent[way[-1]]]
            rest = f'is in a loop that never reaches the world: {" -> ".join(loop)}; give one of them parent = "world"'
            yield Problem(place("bodies" if loop[0] in document.bodies else "beams", loop[0]), rest)
        settled.update(way)


def joint_problems(document: Document) -> Iterator[Problem]:
    """Axes and pitches that are missing, wrong, or of no use; two ways at once to say where a joint is."""
    for name, joint in document.joints.items():
        yield from _place_problems(name, joint)
        yield from _axis_problems(name, joint)
        yield from _pitch_problems(name, joint)
        yield from _rotor_problems(name, joint)


def _place_problems(name: str, joint: Joint) -> Iterator[Problem]:
    for key in ("axis", "translation", "rotation"):
        if joint.dh is not None and key in joint.model_fields_set and getattr(joint, key) not in (None, (0.0,) * 3):
            rest = f"says with dh where the joint is, and with {key} as well; remove one (with dh, the axis is z)"
            yield Problem(place("joints", name), rest)


def _axis_problems(name: str, joint: Joint) -> Iterator[Problem]:
    where = place("joints", name, "axis")
    if joint.type in {"fixed", "spherical", "free"}:
        if joint.axis is not None:
            yield Problem(where, f"is given, but a {joint.type} joint has no axis; remove it")
        return
    if joint.axis is None:
        if joint.dh is None:
            yield Problem(where, "is missing; add it, for example axis = [1.0, 0.0, 0.0]")
        return
    length = math.hypot(*joint.axis)
    if abs(length - 1.0) > AXIS_TOLERANCE:
        shown = ", ".join(f"{component:g}" for component in joint.axis)
        repair = "divide it by its length" if length > 0.0 else "give it a direction"
        yield Problem(where, f"is [{shown}] with length {length:.6g}, but has to have length 1; {repair}")


def _pitch_problems(name: str, joint: Joint) -> Iterator[Problem]:
    where = place("joints", name, "pitch")
    if joint.type != "helical":
        if joint.pitch is not None:
            yield Problem(where, f'is given, but a {joint.type} joint has none; remove it, or take type = "helical"')
    elif joint.pitch is None:
        yield Problem(where, "is missing; add the travel in m per rad, for example pitch = 0.0008 for 5 mm per turn")
    elif joint.pitch == 0.0:
        yield Problem(where, 'is 0, but a helical joint travels as it turns; give m per rad, or take type = "revolute"')


def _rotor_problems(name: str, joint: Joint) -> Iterator[Problem]:
    if joint.rotor_inertia is not None and joint.type not in {"prismatic", "revolute", "helical"}:
        rest = f"is given, but a {joint.type} joint has no single coordinate that a rotor could turn with; remove it"
        yield Problem(place("joints", name, "rotor_inertia"), rest)
