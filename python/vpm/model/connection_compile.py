"""Contacts, bushings, load cells and closed loops in the words of the core."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from vpm.model.contact import DIRECTIONS, Bushing, BushingEnd, Contact, LoadCell, Loop, entry_name
from vpm.model.expand import plane, unit
from vpm.model.pose import Pose, pose
from vpm.model.structure import CONTACT_UNITS, WRENCH_UNITS, Frame, Mount, Structure


def mount_json(mount: Mount) -> str | dict[str, Any]:
    """What something is fixed to."""
    match mount.kind:
        case "world":
            return "world"
        case "body":
            return {"body": mount.index}
        case "section":
            return {"section": {"beam": mount.index, "at": mount.at}}


def frame_json(frame: Frame) -> dict[str, Any]:
    """A frame that is fixed to something."""
    placed = frame.pose
    return {
        "on": mount_json(frame.mount),
        "translation": list(placed.translation),
        "rotation": list(placed.rotation),
    }


def contact_json(name: str, contact: Contact, structure: Structure, index: Mapping[str, int]) -> dict[str, Any]:
    """A contact."""
    frame = structure.mounted(contact.parent, contact.at, Pose(contact.point))
    friction = {
        "static_coefficient": "static",
        "static_velocity": "static_velocity",
        "dynamic_coefficient": "dynamic",
        "dynamic_velocity": "dynamic_velocity",
    }
    return {
        "name": name,
        "on": mount_json(frame.mount),
        "point": list(frame.pose.translation),
        "plane": {"point": list(contact.plane.point), "normal": list(contact.plane.normal)},
        "normal": {key: index[f"{name}.{key}"] for key in ("stiffness", "exponent", "damping", "damping_depth")},
        "friction": None
        if contact.friction is None
        else {key: index[f"{name}.friction.{short}"] for key, short in friction.items()},
    }


def bushing_json(name: str, bushing: Bushing, structure: Structure, index: Mapping[str, int]) -> dict[str, Any]:
    """A bushing; entries that nobody wrote down are zero."""

    def end(entry: BushingEnd) -> dict[str, Any]:
        return frame_json(structure.mounted(entry.parent, entry.at, pose(entry.point, entry.rotation)))

    def matrix(key: str, *, symmetric: bool) -> list[list[int | None]]:
        def place(i: int, j: int) -> int | None:
            row, column = (min(i, j), max(i, j)) if symmetric else (i, j)
            return index.get(f"{name}.{key}.{entry_name(row, column)}")

        return [[place(i, j) for j in range(6)] for i in range(6)]

    return {
        "name": name,
        "a": end(bushing.a),
        "b": end(bushing.b),
        "stiffness": matrix("stiffness", symmetric=True),
        "damping": matrix("damping", symmetric=False),
        "preload": [index.get(f"{name}.preload.{direction}") for direction in DIRECTIONS],
    }


def loop_json(name: str, loop: Loop, structure: Structure) -> dict[str, Any]:
    """A closed loop; the core turns a revolute one about the z axes of its frames."""
    axis = unit(loop.axis or (0.0, 0.0, 1.0))
    columns = (*plane(axis), axis)
    axes = [column[row] for row in range(3) for column in columns]

    def end(entry: BushingEnd) -> dict[str, Any]:
        return frame_json(structure.mounted(entry.parent, entry.at, pose(entry.point, entry.rotation)))

    return {"name": name, "joint": loop.type, "a": end(loop.a), "b": end(loop.b), "axes": axes}


def cell_json(name: str, cell: LoadCell, structure: Structure) -> dict[str, Any]:
    """A load cell; at a joint of several coordinates the last one carries the child."""
    if cell.joint in structure.joints:
        return {"name": name, "joint": structure.joints.index(cell.joint)}
    own = [k for k, axis in enumerate(structure.axes) if axis.joint == cell.joint]
    return {"name": name, "joint": own[-1]}


def connection_channel(owner: str, kind: str, structure: Structure) -> dict[str, Any] | None:
    """Channel of a contact, a bushing, a load cell or a loop; None for those of others."""
    document = structure.document
    if owner in document.contacts and kind in CONTACT_UNITS:
        return {"kind": "contact", "contact": list(document.contacts).index(owner), "quantity": kind}
    for what, names in (("bushing", document.bushings), ("load_cell", document.load_cells), ("loop", document.loops)):
        if owner in names and kind in WRENCH_UNITS:
            return {"kind": what, what: list(names).index(owner), "component": kind}
    return None
