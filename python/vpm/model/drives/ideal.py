"""Drive without a character of its own."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from vpm.model.component import Described, Index
from vpm.model.drives.drive import Drive, numbers
from vpm.model.entry import ParameterValue, Text
from vpm.model.parameters import ANY, TINY, Rule
from vpm.units import si_unit

if TYPE_CHECKING:
    from vpm.model.structure import Structure


_NEVER = "a limit of zero or less would mean that the drive never acts"


class Ideal(Drive):
    """Drive without a character of its own: effort = gain times command, cut at a limit if it has one."""

    EXAMPLES: ClassVar[Mapping[str, str]] = {"gain": 'gain = { value = 1.0, unit = "N/V" }'}

    type: Literal["ideal"] = "ideal"
    gain: Annotated[ParameterValue, Rule("", ANY, kind="linear")]
    limit: Annotated[ParameterValue | None, Rule("", TINY, _NEVER)] = None
    command_unit: Text = "1"

    def units(self, name: str, structure: Structure) -> Mapping[str, str]:
        """SI units of an ideal drive that depend on the model."""
        effort = structure.effort_unit(name)
        return {"gain": si_unit(f"{effort}/({self.command_unit})"), "limit": effort}

    def law(self, name: str, structure: Structure, index: Index) -> Described:  # noqa: ARG002
        """What the core reads of the law of an ideal drive."""
        return {**numbers(name, ("gain", "limit"), index)}
