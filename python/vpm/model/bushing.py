"""Elastic connections of two frames, with matrices of stiffness and damping."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, ClassVar

import numpy as np
from pydantic import AfterValidator, Discriminator, Field, Tag

from vpm.errors import UnitError
from vpm.model.component import Component, Described, Index
from vpm.model.entry import ORIGIN, ZERO, Entry, Number, ParameterValue, Quantity, Text, Vector
from vpm.model.messages import Problem, place
from vpm.model.parameters import ANY, FEEDING, NOT_NEGATIVE, Keys, Parameter, Slot
from vpm.model.pose import Frame, pose
from vpm.units import factor_to_si

if TYPE_CHECKING:
    from vpm.model.structure import Structure

#: The six directions of a bushing, in the order of all spatial vectors.
DIRECTIONS = ("rx", "ry", "rz", "x", "y", "z")
#: Entries on both sides of a diagonal may differ by this share: numbers in files are rounded.
_SYMMETRY = 1e-9
#: How far below zero an eigenvalue of a scaled matrix may be: numbers in files are rounded.
_SLACK = 1e-9
#: Channels of the wrench on A, in the axes of A.
WRENCH: Mapping[str, str] = {**dict.fromkeys(("mx", "my", "mz"), "N m"), **dict.fromkeys(("fx", "fy", "fz"), "N")}


class BushingEnd(Entry):
    """Frame that a bushing or a loop is fixed to: on a body, on a beam, or on the world."""

    parent: Text
    at: Number | None = None
    point: Vector = ORIGIN
    rotation: Vector = ORIGIN

    def frame(self, structure: Structure) -> Frame:
        """Frame to which an end of a bushing is fixed: its mount and the place on it."""
        return structure.mounted(self.parent, self.at, pose(self.point, self.rotation))

    @property
    def told(self) -> str:
        """Name of the component that an end of a bushing is on, in words."""
        return f'"{self.parent}"' + ("" if self.at is None else f" at {self.at:g} m")


def _kind(value: object) -> str:
    """Whether an entry of a bushing's matrix is a row of it or a number of its diagonal."""
    return "row" if isinstance(value, list | tuple) else "entry"


Row = tuple[ParameterValue, ...]
_Entry = Annotated[Annotated[ParameterValue, Tag("entry")] | Annotated[Row, Tag("row")], Discriminator(_kind)]
_Six = Field(min_length=6, max_length=6)


def _square(matrix: tuple[Quantity | Row, ...]) -> tuple[Quantity | Row, ...]:
    """Check that a matrix of a bushing is six numbers of its diagonal, or six rows of six."""
    lengths = [len(row) for row in matrix if isinstance(row, tuple)]
    if lengths not in ([], [6] * 6):
        raise ValueError("has to be six numbers (the diagonal), or six rows of six; correct the list")
    return matrix


def _symmetric(matrix: tuple[Quantity | Row, ...]) -> tuple[Quantity | Row, ...]:
    """Diagonal, or upper rows, of a bushing's symmetric matrix: of two equal entries one is kept."""
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


class Bushing(Component):
    """Elastic connection of frame A with frame B: wrench on A = -K d - C dd/dt + preload, entries rx ry rz x y z."""

    EXAMPLES: ClassVar[Mapping[str, str]] = {
        "a": 'a = { parent = "lower", point = [0.0, 0.0, 0.0] }',
        "b": 'b = { parent = "upper", point = [0.0, 0.0, -0.35] }',
        "stiffness": "stiffness = [1e4, 0.0, 1e4, 1e7, 1e7, 1e7]",
    }
    CHANNELS: ClassVar[Mapping[str, str]] = WRENCH

    a: BushingEnd
    b: BushingEnd
    stiffness: Symmetric
    damping: Square = (ZERO,) * 6
    preload: Annotated[tuple[ParameterValue, ...], _Six] | None = None

    def problems(self, name: str, structure: Structure) -> Iterator[Problem]:
        """Problem of a bushing whose ends are on the same part."""
        if self.a.frame(structure).mount == self.b.frame(structure).mount:
            rest = f"has both ends on {self.a.told}, so it never deforms; put one end on another body or beam"
            yield Problem(place("bushings", name), rest)

    def slots(self, keys: Keys, structure: Structure) -> Iterator[Slot]:  # noqa: ARG002
        """Parameters of a bushing: every entry that is written down."""
        name, fleeing = keys[1], "a bushing with negative stiffness would push away from its rest"
        for key, time, impossible in (("stiffness", "", fleeing), ("damping", " s", FEEDING)):
            for row, column, way, quantity in entries(getattr(self, key)):
                bounds, unit = NOT_NEGATIVE if row == column else ANY, _entry_unit(row, column, time)
                named = f"{name}.{key}.{entry_name(row, column)}"
                yield Slot((*keys, key, *way), quantity, unit, bounds, impossible, "linear", named)
        for i, quantity in enumerate(self.preload or ()):
            unit, named = "N m" if i < 3 else "N", f"{name}.preload.{DIRECTIONS[i]}"
            yield Slot((*keys, "preload", i), quantity, unit, ANY, "", "linear", named)

    def value_problems(self, name: str, parameters: Mapping[str, Parameter]) -> Iterator[Problem]:
        """Problems of a bushing's springs and dampers that give energy away."""
        for key, symmetric in (("stiffness", True), ("damping", False)):
            matrix = np.zeros((6, 6))
            for row, column, _, _ in entries(getattr(self, key)):
                matrix[row, column] = parameters[f"{name}.{key}.{entry_name(row, column)}"].value
            whole = np.triu(matrix) + np.triu(matrix, 1).T if symmetric else 0.5 * (matrix + matrix.T)
            diagonal = np.diag(whole)
            alone = np.flatnonzero((diagonal <= 0.0) & (np.abs(whole).sum(axis=1) > diagonal))
            if alone.size:
                direction = DIRECTIONS[int(alone[0])]
                rest = f"couples {direction} with other directions, but has 0 there on its diagonal, so that it gives "
                rest += f"energy away; give {direction} a value of its own"
                yield Problem(place("bushings", name, key), rest)
                continue
            scale = np.where(diagonal > 0.0, 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0)), 0.0)
            least = float(np.linalg.eigvalsh(whole * np.outer(scale, scale)).min())
            if least < -_SLACK:
                rest = (
                    f"is not positive semidefinite: scaled to a diagonal of 1, its smallest eigenvalue is {least:.4g}, "
                )
                rest += "so that it gives energy away; make entries off the diagonal smaller"
                yield Problem(place("bushings", name, key), rest)

    def described(self, name: str, structure: Structure, index: Index) -> Described:
        """What the core reads of a bushing; entries that nobody wrote down are zero."""

        def matrix(key: str, *, symmetric: bool) -> list[list[int | None]]:
            def place(i: int, j: int) -> int | None:
                row, column = (min(i, j), max(i, j)) if symmetric else (i, j)
                return index.get(f"{name}.{key}.{entry_name(row, column)}")

            return [[place(i, j) for j in range(6)] for i in range(6)]

        return {
            "name": name,
            "a": self.a.frame(structure).described(),
            "b": self.b.frame(structure).described(),
            "stiffness": matrix("stiffness", symmetric=True),
            "damping": matrix("damping", symmetric=False),
            "preload": [index.get(f"{name}.preload.{direction}") for direction in DIRECTIONS],
        }


def entries(matrix: tuple[Quantity | Row, ...]) -> list[tuple[int, int, tuple[int, ...], Quantity]]:
    """Entries of a bushing's matrix that are written down: row, column, way to it in the list, value."""
    found: list[tuple[int, int, tuple[int, ...], Quantity]] = []
    for i, part in enumerate(matrix):
        if isinstance(part, tuple):
            first = 6 - len(part)
            found += [(i, first + k, (i, k), entry) for k, entry in enumerate(part)]
        else:
            found.append((i, i, (i,), part))
    return found


def entry_name(row: int, column: int) -> str:
    """Dotted name of an entry in a bushing's matrix: ``x`` on the diagonal, ``x.y`` beside it."""
    return DIRECTIONS[row] if row == column else f"{DIRECTIONS[row]}.{DIRECTIONS[column]}"


def _entry_unit(row: int, column: int, time: str) -> str:
    """Unit of an entry in a bushing's matrix: moment or force per angle or way, or per rate."""
    moment, angle = ("N m" if row < 3 else "N"), column < 3
    return f"{moment}{time}/{'rad' if angle else 'm'}"
