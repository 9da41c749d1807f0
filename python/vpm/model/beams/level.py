"""Levels of detail of a flexible link: how each is written, which range it has, and its coordinates.

Written ``"rigid"`` or with a number, ``"strain(3)"``. What each means and costs is in docs/beams.md.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args

from vpm.errors import near_match

Component = Literal["bending_x", "bending_y", "torsion", "shear_x", "shear_y", "extension"]
COMPONENTS: tuple[Component, ...] = get_args(Component)
#: What a link deforms in unless its model says otherwise.
USUAL: tuple[Component, ...] = ("bending_x", "bending_y", "torsion")

_WRITTEN = re.compile(r"\s*(?P<name>[A-Za-z_]+)\s*(?:\(\s*(?P<number>[+-]?\d+)\s*\)\s*)?")


@dataclass(frozen=True)
class _Form:
    """What the number of a level counts, and its range."""

    counts: str
    least: int
    most: int


#: The ranges of the core: the upper ends are beyond what pays off, and before what rounding errors spoil.
FORMS: Mapping[str, _Form] = {
    "lumped": _Form("the number of rigid segments", 1, 200),
    "modal": _Form("the number of modes per component", 1, 8),
    "bezier": _Form("the degree of the curve", 2, 12),
    "deflection": _Form("the degree of the deflection", 2, 12),
    "hermite": _Form("the number of cubic elements", 1, 100),
    "strain": _Form("the number of polynomials per component", 1, 12),
    "elements": _Form("the number of elements", 1, 100),
    "reduced": _Form("the number of modes of a reduced solid", 1, 64),
}
#: Levels whose kinematics know a shape at rest; the others interpolate a deflection from a straight axis.
CURVED = ("rigid", "lumped", "bezier", "strain", "elements")
LEVEL_NAMES: tuple[str, ...] = ("rigid", *FORMS)


@dataclass(frozen=True)
class Level:
    """Level of detail of a beam."""

    name: str  #: One of `LEVEL_NAMES`.
    number: int = 0  #: Of segments, modes, elements or polynomials, or the degree of the curve; 0 for a rigid beam.

    def __str__(self) -> str:
        return self.name if self.name == "rigid" else f"{self.name}({self.number})"

    def count(self, component: str) -> int:
        """Number of coordinates of one component of a beam at a level of detail.

        Deflections start from a clamp: a Bezier curve has two control points less for bending, which is clamped in
        value and slope, and one less for the others; the elements of a deflection that does not bend are linear.

        ``component``: for example ``"bending_x"``.
        """
        bends = component.startswith("bending")
        match self.name:
            case "rigid":
                return 0
            case "bezier" | "deflection":
                return self.number - 1 if bends else self.number
            case "hermite":
                return 2 * self.number if bends else self.number
            case "elements":
                return self.number + 1
        return self.number

    def coordinates(self, deforms: Sequence[str]) -> tuple[str, ...]:
        """Coordinate names of a beam at a level, in the order of the core: ``bending_x.0``.

        One component after the other, except for springs between rigid segments: there one segment after the other.
        Modes of a reduced solid are of no component: ``mode.0``.

        ``deforms``: components, in the order of the file.
        """
        if self.name == "reduced":
            return tuple(f"mode.{i}" for i in range(self.number))
        if self.name == "lumped":
            return tuple(f"{component}.{i}" for i in range(self.number) for component in deforms)
        return tuple(f"{component}.{i}" for component in deforms for i in range(self.count(component)))


def parse_level(text: str) -> Level:
    """Level of detail of a beam from its text.

    ``text``: ``"rigid"``, or a name with a number: ``"bezier(3)"``.
    """
    found = _WRITTEN.fullmatch(text)
    name = found["name"] if found else text.partition("(")[0].strip()
    if name not in LEVEL_NAMES:
        known = ["rigid", *(f"{level}(n)" for level in FORMS)]
        near = near_match(name, LEVEL_NAMES)
        repair = near if near.startswith("did you") else f"write one of {', '.join(known)}"
        raise ValueError(f'is "{text}", which is no level of detail; {repair}')
    if found is None:
        raise ValueError(f'is "{text}", which is not a name with a whole number; write for example "{_example(name)}"')
    number = None if found["number"] is None else int(found["number"])
    if name == "rigid":
        if number is not None:
            raise ValueError(f'is "{text}", but a rigid beam takes no number; write "rigid"')
        return Level("rigid")
    form = FORMS[name]
    if number is None:
        raise ValueError(f'is "{text}", which needs a number: {form.counts}; write for example "{_example(name)}"')
    if not form.least <= number <= form.most:
        rest = f'is "{text}", but {form.counts} can be {form.least} to {form.most}; take a number in this range'
        raise ValueError(rest)
    return Level(name, number)


def _example(name: str) -> str:
    return "rigid" if name == "rigid" else f"{name}(3)"


def deforms_of(beam: Mapping[str, Any]) -> tuple[str, ...]:
    """Components in which a beam deforms at its level; none of a reduced solid, which has modes."""
    return () if "reduced" in beam else tuple(beam.get("deforms", USUAL))


def size_of(level: str, beam: Mapping[str, Any]) -> int:
    """Coordinates that a beam of a model file has at a level."""
    return len(parse_level(level).coordinates(deforms_of(beam)))
