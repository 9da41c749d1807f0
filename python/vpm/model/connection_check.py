"""What contacts, bushings, load cells and loops name, and what may not be together."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from vpm.errors import UnitError, near_match
from vpm.model.connection_parameters import stiffness_unit
from vpm.model.contact import DIRECTIONS, Bushing, BushingEnd, Contact, Loop, entries, entry_name
from vpm.model.controller import ComputedTorque
from vpm.model.entry import Quantity
from vpm.model.messages import Problem, place
from vpm.model.parameters import Parameter
from vpm.model.pose import Pose
from vpm.model.schema import Document
from vpm.model.structure import Structure
from vpm.units import convert, require_dimension

#: How far below zero an eigenvalue of a scaled matrix may be: numbers in files are rounded.
_SLACK = 1e-9


def connection_problems(document: Document, structure: Structure) -> Iterator[Problem]:
    """Contacts that cannot touch, bushings that cannot deform, load cells at nothing, loops that close none."""
    for name, contact in document.contacts.items():
        yield from _contact_problems(name, contact, structure)
    for name, bushing in document.bushings.items():
        ends = [structure.mounted(end.parent, end.at, Pose()).mount for end in (bushing.a, bushing.b)]
        if ends[0] == ends[1]:
            rest = f"has both ends on {_said(bushing.a)}, so it never deforms; put one end on another body or beam"
            yield Problem(place("bushings", name), rest)
    for name, loop in document.loops.items():
        yield from _loop_problems(name, loop, document, structure)
    for name, cell in document.load_cells.items():
        yield from _cell_problems(name, cell.joint, document, structure)


def _loop_problems(name: str, loop: Loop, document: Document, structure: Structure) -> Iterator[Problem]:
    if (
        structure.mounted(loop.a.parent, loop.a.at, Pose()).mount
        == structure.mounted(loop.b.parent, loop.b.at, Pose()).mount
    ):
        rest = f"has both ends on {_said(loop.a)}, so it closes nothing; put one end on another body or beam"
        yield Problem(place("loops", name), rest)
    if loop.type == "revolute" and not any(loop.axis or ()):
        rest = "is missing or [0, 0, 0]; give the direction about which the ends turn, such as [0, 1, 0]"
        yield Problem(place("loops", name, "axis"), rest)
    if loop.type != "revolute" and loop.axis is not None:
        yield Problem(place("loops", name, "axis"), f'belongs to type = "revolute", but this is {loop.type}; remove it')
    for joint in loop.start:
        if joint not in structure.joints:
            repair = near_match(joint, structure.joints, what="it has")
            yield Problem(place("loops", name, "start", joint), f"is no joint of one coordinate; {repair}")
    for controller, law in document.controllers.items():
        if isinstance(law, ComputedTorque):
            rest = f"closes a loop, but controller {controller} inverts the open tree; use another type, such as pd"
            yield Problem(place("loops", name), rest)
    if not document.velocity_terms:
        yield Problem(place("loops", name), "cannot stay closed without velocity_terms; put them back, or remove it")


def _contact_problems(name: str, contact: Contact, structure: Structure) -> Iterator[Problem]:
    if structure.mounted(contact.parent, contact.at, Pose()).mount.kind == "world":
        rest = f'is "{contact.parent}", which does not move against the plane; name a body or a beam that moves'
        yield Problem(place("contacts", name, "parent"), rest)
    if not any(contact.plane.normal):
        rest = "is [0, 0, 0], which is no direction; give the direction in which the ground pushes, such as [0, 0, 1]"
        yield Problem(place("contacts", name, "plane", "normal"), rest)
    unit = contact.stiffness.unit
    if unit is None:
        return
    wanted = stiffness_unit(contact.exponent.value)
    try:
        require_dimension(unit, wanted)
    except UnitError:
        rest = (
            f'has the unit "{unit}", but with the exponent {contact.exponent.value:g} it is a force per length to that '
            f'power; write for example "N/mm^{contact.exponent.value:.6g}", or correct the exponent'
        )
        yield Problem(place("contacts", name, "stiffness"), rest)


def _said(end: BushingEnd) -> str:
    return f'"{end.parent}"' + ("" if end.at is None else f" at {end.at:g} m")


def _cell_problems(name: str, joint: str, document: Document, structure: Structure) -> Iterator[Problem]:
    where = place("load_cells", name, "joint")
    if joint in document.joints and document.joints[joint].type == "fixed":
        rest = f'is "{joint}", a fixed joint, which makes one piece of its bodies; take a bushing that is stiff, '
        yield Problem(where, f"{rest}or the load cell of the joint before it")
    elif joint not in (*document.joints, *structure.joints):
        repair = near_match(joint, document.joints, what="it has")
        yield Problem(where, f'is "{joint}", which is no joint of the model; {repair}')


def complete_contacts(document: Document) -> Document:
    """Contact stiffnesses as SI numbers: their unit holds an exponent that may be another parameter's next value."""
    return document.model_copy(update={"contacts": {name: _in_si(entry) for name, entry in document.contacts.items()}})


def _in_si(contact: Contact) -> Contact:
    given, wanted = contact.stiffness, stiffness_unit(contact.exponent.value)
    if given.unit is None:
        return contact

    def si(number: float | None) -> float | None:
        return None if number is None else convert(number, given.unit or wanted, wanted)

    quantity = Quantity(
        value=convert(given.value, given.unit, wanted),
        uncertainty=si(given.uncertainty),
        minimum=si(given.minimum),
        maximum=si(given.maximum),
    )
    return contact.model_copy(update={"stiffness": quantity})


def connection_value_problems(document: Document, parameters: Mapping[str, Parameter]) -> Iterator[Problem]:
    """Numbers that do not fit together: friction that does not fall, springs and dampers that give energy away."""
    for name, contact in document.contacts.items():
        if contact.friction is None:
            continue
        static, dynamic = (parameters[f"{name}.friction.{key}_velocity"].value for key in ("static", "dynamic"))
        if dynamic <= static:
            rest = (
                f"is {dynamic:g} m/s, but friction falls from its static value at {static:g} m/s to its dynamic one; "
                "give a dynamic_velocity above static_velocity"
            )
            yield Problem(place("contacts", name, "friction", "dynamic_velocity"), rest)
    for name, bushing in document.bushings.items():
        yield from _matrix_problems(name, bushing, parameters)


def _matrix_problems(name: str, bushing: Bushing, parameters: Mapping[str, Parameter]) -> Iterator[Problem]:
    for key, symmetric in (("stiffness", True), ("damping", False)):
        matrix = np.zeros((6, 6))
        for row, column, _, _ in entries(getattr(bushing, key)):
            matrix[row, column] = parameters[f"{name}.{key}.{entry_name(row, column)}"].value
        whole = np.triu(matrix) + np.triu(matrix, 1).T if symmetric else 0.5 * (matrix + matrix.T)
        diagonal = np.diag(whole)
        alone = np.flatnonzero((diagonal <= 0.0) & (np.abs(whole).sum(axis=1) > diagonal))
        if alone.size:
            direction = DIRECTIONS[int(alone[0])]
            rest = (
                f"couples {direction} with other directions, but has 0 there on its diagonal, so that it gives energy"
            )
            yield Problem(place("bushings", name, key), f"{rest} away; give {direction} a value of its own")
            continue
        scale = np.where(diagonal > 0.0, 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0)), 0.0)
        least = float(np.linalg.eigvalsh(whole * np.outer(scale, scale)).min())
        if least < -_SLACK:
            rest = (
                f"is not positive semidefinite: scaled to a diagonal of 1, its smallest eigenvalue is {least:.4g}, so "
            )
            yield Problem(
                place("bushings", name, key), f"{rest}that it gives energy away; make entries off the diagonal smaller"
            )
