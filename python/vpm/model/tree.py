"""What hangs on what: names, parents, places along beams, and ways that never reach the world."""

import re
from collections.abc import Iterator

from vpm.errors import near_match
from vpm.model.messages import Problem, place
from vpm.model.schema import SECTIONS, Document

WORLD = "world"
_RESERVED = {WORLD, "time"}
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")


def name_problems(document: Document) -> Iterator[Problem]:
    """Problems of names in the tree: unwritable, reserved, or shared by two components."""
    owner: dict[str, str] = {}
    for section, name, _ in document.components(*(section for section in SECTIONS if section != "channels")):
        where = place(section, name)
        if not _NAME.fullmatch(name):
            yield Problem(where, "has a name that is not letters, digits, - and _ after a letter; rename it")
        elif name in _RESERVED:
            yield Problem(where, f'has the name "{name}", which is reserved; rename it')
        elif name in owner:
            yield Problem(where, f"has the same name as {owner[name]}; all components share one namespace, rename one")
        owner.setdefault(name, where)
    for name, joint in document.joints.items():
        for coordinate in joint.coordinate_names(name):
            if coordinate != name and coordinate in owner:
                rest = f'has a coordinate "{coordinate}", which is also the name of {owner[coordinate]}; rename one'
                yield Problem(place("joints", name), rest)
            owner.setdefault(coordinate, place("joints", name))


def tree_problems(document: Document) -> Iterator[Problem]:
    """Problems of the tree: unknown parents, bodies with no joint or several, wrong places, loops."""
    for keys, parent, at in _attachments(document):
        yield from _attachment_problems(keys, parent, at, document)
    yield from _child_problems(document)
    yield from _loop_problems(document)


def _attachments(document: Document) -> Iterator[tuple[tuple[str, ...], str, float | None]]:
    """Attachments in the tree: their place in the file, their parent, and how far along that."""
    for section in ("joints", "beams", "markers", "imus"):
        for name, entry in getattr(document, section).items():
            yield (section, name), entry.parent, entry.at
    for name, line in document.lines.items():
        yield ("lines", name, "from"), line.start.parent, line.start.at
        yield ("lines", name, "to"), line.end.parent, line.end.at
    for name, contact in document.contacts.items():
        yield ("contacts", name), contact.parent, contact.at
    for section in ("bushings", "loops"):
        for name, entry in getattr(document, section).items():
            yield (section, name, "a"), entry.a.parent, entry.a.at
            yield (section, name, "b"), entry.b.parent, entry.b.at


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
        yield from document.beams[parent].outside_problems(keys, at, parent)


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
