"""Form of the tables of contacts, bushings, load cells and closed loops."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, Discriminator, Field, Tag

from vpm.errors import UnitError
from vpm.model.entry import ORIGIN, ZERO, Entry, Number, ParameterValue, Quantity, Text, Vector
from vpm.units import factor_to_si

#: The six directions of a bushing, in the order of all spatial vectors.
DIRECTIONS = ("rx", "ry", "rz", "x", "y", "z")
#: Names that the schema puts into a place to say what stands there.
TAGS = ("entry", "row")
#: Entries on both sides of a diagonal may differ by this share: numbers in files are rounded.
_SYMMETRY = 1e-9


class Plane(Entry):
    """Plane at rest in the world: a point of it and its normal, of any length, towards the free side."""

    point: Vector = ORIGIN
    normal: Vector


class ContactFriction(Entry):
    """Friction per normal force: static up to one sliding velocity, dynamic from another one on."""

    static: ParameterValue
    static_velocity: ParameterValue
    dynamic: ParameterValue
    dynamic_velocity: ParameterValue


class Contact(Entry):
    """Contact of a point of the machine with a plane: F = k d^n + c step(d / damping_depth) d'."""

    parent: Text
    at: Number | None = None
    point: Vector = ORIGIN
    plane: Plane
    stiffness: ParameterValue
    exponent: ParameterValue = Quantity(value=1.0)
    damping: ParameterValue = ZERO
    damping_depth: ParameterValue = Quantity(value=1e-4)
    friction: ContactFriction | None = None


class BushingEnd(Entry):
    """Frame that a bushing is fixed to: on a body, on a beam, or on the world."""

    parent: Text
    at: Number | None = None
    point: Vector = ORIGIN
    rotation: Vector = ORIGIN


def _kind(value: object) -> str:
    """Whether an entry of a matrix is a row of it or a number of its diagonal."""
    return "row" if isinstance(value, list | tuple) else "entry"


Row = tuple[ParameterValue, ...]
_Entry = Annotated[Annotated[ParameterValue, Tag("entry")] | Annotated[Row, Tag("row")], Discriminator(_kind)]
_Six = Field(min_length=6, max_length=6)


def _square(matrix: tuple[Quantity | Row, ...]) -> tuple[Quantity | Row, ...]:
    """The diagonal, or all rows."""
    lengths = [len(row) for row in matrix if isinstance(row, tuple)]
    if lengths not in ([], [6] * 6):
        raise ValueError("has to be six numbers (the diagonal), or six rows of six; correct the list")
    return matrix


def _symmetric(matrix: tuple[Quantity | Row, ...]) -> tuple[Quantity | Row, ...]:
    """The diagonal, or the rows from the diagonal on: of two entries that have to be equal, one is kept."""
    rows = [row for row in matrix if isinstance(row, tuple)]
    if [len(row) for row in rows] == [6, 5, 4, 3, 2, 1]:
        return matrix
    _square(matrix)
    for i, row in enumerate(rows):
        for j in range(i + 1, 6):
            above, below = row[j], rows[j][i]
            if not _same(above, below):
                there, here = f"row {DIRECTIONS[i]}, column {DIRECTIONS[j]}", f"row {DIRECTIONS[j]}"
                raise ValueError(
                    f"has {_shown(above)} in {there}, but {_shown(below)} in {here}, column {DIRECTIONS[i]}; "
                    "a spring has a symmetric stiffness, so make them equal"
                )
    return tuple(row[i:] for i, row in enumerate(rows)) if rows else matrix


def _same(left: Quantity, right: Quantity) -> bool:
    try:
        values = [entry.value * factor_to_si(entry.unit or "1") for entry in (left, right)]
    except UnitError:  # said later, with the place
        values = [left.value, right.value]
    return abs(values[0] - values[1]) <= _SYMMETRY * max(map(abs, values))


def _shown(entry: Quantity) -> str:
    return f"{entry.value:g}" + (f" {entry.unit}" if entry.unit else "")


Symmetric = Annotated[tuple[_Entry, ...], _Six, AfterValidator(_symmetric)]
Square = Annotated[tuple[_Entry, ...], _Six, AfterValidator(_square)]


class Bushing(Entry):
    """Elastic connection of frame A with frame B: wrench on A = -K d - C dd/dt + preload, entries rx ry rz x y z."""

    a: BushingEnd
    b: BushingEnd
    stiffness: Symmetric
    damping: Square = (ZERO,) * 6
    preload: Annotated[tuple[ParameterValue, ...], _Six] | None = None


class LoadCell(Entry):
    """Reading of the reaction wrench at a joint."""

    joint: Text


class Loop(Entry):
    """Joint between frames A and B that closes a loop; `axis` is in the axes of both.

    `start` holds positions of joints (m, rad) from which the loops are closed: it chooses among assemblies.
    """

    type: Literal["revolute", "spherical", "rigid"]
    a: BushingEnd
    b: BushingEnd
    axis: Vector | None = None
    start: dict[str, Number] = Field(default_factory=dict)


#: Tables inside of contacts, bushings and loops, by their key.
NESTED: Mapping[str, type[BaseModel]] = {
    "plane": Plane,
    "friction": ContactFriction,
    "a": BushingEnd,
    "b": BushingEnd,
}

#: How a key is written, for messages about missing ones.
EXAMPLES: Mapping[str, str] = {
    "plane": "plane = { point = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] }",
    "normal": "normal = [0.0, 0.0, 1.0]",
    "contacts.stiffness": 'stiffness = { value = 2855, unit = "N/mm^1.1" }',
    "contacts.static": "static = 0.7",
    "contacts.static_velocity": 'static_velocity = { value = 0.1, unit = "m/s" }',
    "contacts.dynamic": "dynamic = 0.55",
    "contacts.dynamic_velocity": 'dynamic_velocity = { value = 1, unit = "m/s" }',
    "bushings.a": 'a = { parent = "lower", point = [0.0, 0.0, 0.0] }',
    "bushings.b": 'b = { parent = "upper", point = [0.0, 0.0, -0.35] }',
    "loops.type": 'type = "revolute"',
    "loops.a": 'a = { parent = "crank", point = [0.1, 0.0, 0.0] }',
    "loops.b": 'b = { parent = "rod", point = [0.3, 0.0, 0.0] }',
    "bushings.stiffness": "stiffness = [1e4, 0.0, 1e4, 1e7, 1e7, 1e7]",
}


def entries(matrix: tuple[Quantity | Row, ...]) -> list[tuple[int, int, tuple[int, ...], Quantity]]:
    """Entries of a matrix that are written down: row, column, way to it in the list, and what stands there."""
    found: list[tuple[int, int, tuple[int, ...], Quantity]] = []
    for i, part in enumerate(matrix):
        if isinstance(part, tuple):
            first = 6 - len(part)
            found += [(i, first + k, (i, k), entry) for k, entry in enumerate(part)]
        else:
            found.append((i, i, (i,), part))
    return found


def entry_name(row: int, column: int) -> str:
    """Dotted name of an entry: ``x`` on the diagonal, ``x.y`` beside it."""
    return DIRECTIONS[row] if row == column else f"{DIRECTIONS[row]}.{DIRECTIONS[column]}"
