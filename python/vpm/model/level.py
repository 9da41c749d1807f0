"""Levels of detail of a flexible link: how each is written, which range it has, and its coordinates.

Written ``"rigid"`` or with a number, ``"strain(3)"``. What each means and costs is in docs/beams.md.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

from vpm.errors import near_match

Component = Literal["bending_x", "bending_y", "torsion", "shear_x", "shear_y", "extension"]
COMPONENTS: tuple[Component, ...] = get_args(Component)

LevelName = Literal["rigid", "lumped", "modal", "bezier", "hermite", "strain", "elements"]

_WRITTEN = re.compile(r"\s*(?P<name>[A-Za-z_]+)\s*(?:\(\s*(?P<number>[+-]?\d+)\s*\)\s*)?")


@dataclass(frozen=True)
class _Form:
    """What the number of a level counts, and its range."""

    counts: str
    least: int
    most: int
    shear: bool = False


#: The upper ends are far beyond what pays off, and before what is too badly conditioned to be solved.
FORMS: Mapping[str, _Form] = {
    "lumped": _Form("rigid segments", 1, 100, shear=True),
    "modal": _Form("modes per component", 1, 10),
    "bezier": _Form("the degree of the curve", 2, 12),
    "hermite": _Form("cubic elements", 1, 50),
    "strain": _Form("polynomials per component", 1, 12, shear=True),
    "elements": _Form("elements", 1, 50, shear=True),
}
LEVEL_NAMES: tuple[str, ...] = ("rigid", *FORMS)


@dataclass(frozen=True)
class Level:
    """Level of detail of a beam.

    Attributes
    ----------
    name : {"rigid", "lumped", "modal", "bezier", "hermite", "strain", "elements"}
    number : int
        Of segments, modes, elements or polynomials, or the degree of the curve; 0 for a rigid beam.
    """

    name: str
    number: int = 0

    def __str__(self) -> str:
        return self.name if self.name == "rigid" else f"{self.name}({self.number})"

    def count(self, component: str) -> int:
        """Coordinates of a component.

        A Bezier curve and the cubic elements start from a clamp: the curve has one control point less for the
        deflection and two less for deflection and slope.

        Parameters
        ----------
        component : str
            For example ``"bending_x"``.
        """
        bends = component.startswith("bending")
        match self.name:
            case "rigid":
                return 0
            case "bezier":
                return self.number - 1 if bends else self.number
            case "hermite":
                return 2 * self.number
            case "elements":
                return self.number + 1
        return self.number

    def problem(self, deforms: Sequence[str]) -> str | None:
        """Why a beam with these deformations cannot have this level, as the rest of a sentence; None if it can."""
        shears = [component for component in deforms if component.startswith("shear")]
        if self.name in FORMS and not FORMS[self.name].shear and shears:
            return (
                f'is "{self}", whose deflections know no shear, but the beam deforms in {" and ".join(shears)};'
                ' take "strain(n)", "elements(n)" or "lumped(n)", or leave the shear out'
            )
        return None


def parse_level(text: str) -> Level:
    """Level from its text.

    Parameters
    ----------
    text : str
        ``"rigid"``, or a name with a number: ``"bezier(3)"``.

    Raises
    ------
    ValueError
        There is no such level, or its number is missing or out of range; the rest of a sentence, with the repair.
    """
    found = _WRITTEN.fullmatch(text)
    name = found["name"] if found else text
    if found is None or name not in LEVEL_NAMES:
        known = ["rigid", *(f"{level}(n)" for level in FORMS)]
        near = near_match(name, LEVEL_NAMES)
        repair = near if near.startswith("did you") else f"write one of {', '.join(known)}"
        raise ValueError(f'is "{text}", which is no level of detail; {repair}')
    number = None if found["number"] is None else int(found["number"])
    if name == "rigid":
        if number is not None:
            raise ValueError(f'is "{text}", but a rigid beam takes no number; write "rigid"')
        return Level("rigid")
    form = FORMS[name]
    if number is None:
        raise ValueError(f'is "{text}", which needs a number: {form.counts}; write for example "{name}(3)"')
    if not form.least <= number <= form.most:
        rest = f'is "{text}", but {form.counts} can be {form.least} to {form.most}; take a number in this range'
        raise ValueError(rest)
    return Level(name, number)
