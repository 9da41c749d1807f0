"""Springs with dampers along lines, whose command is a length that is added to the free one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from vpm.model.component import Described, Index
from vpm.model.drives.drive import LENGTH, Drive, numbers
from vpm.model.entry import ParameterValue, Text
from vpm.model.messages import Problem, place
from vpm.model.parameters import ABOVE_ZERO, FEEDING, NOT_NEGATIVE, Rule, rules_of

if TYPE_CHECKING:
    from vpm.model.structure import Structure

_BACKWARD = "a spring with negative stiffness would push away from its free length"


class Compliant(Drive):
    """What acts along a line by its length; without a command it is as with a command of zero."""

    EXAMPLES: ClassVar[Mapping[str, str]] = {
        "stiffness": 'stiffness = { value = 80, unit = "N/mm" }',
        "free_length": 'free_length = { value = 300, unit = "mm" }',
    }
    COMMAND: ClassVar[str] = "m"
    STRAIGHT: ClassVar[bool] = True

    stiffness: Annotated[ParameterValue, Rule("N/m", NOT_NEGATIVE, _BACKWARD)]
    free_length: Annotated[ParameterValue, Rule("m", NOT_NEGATIVE, LENGTH)]

    def carrier_problems(self, name: str, structure: Structure) -> Iterator[Problem]:
        """Problem of a spring on a joint or a transmission, along which nothing has a length."""
        if self.joint is not None:
            rest = f'is a {self.type} on the joint "{self.joint}", but its force acts along a line; '
            rest += "give line in place of joint, or take an effect (spring, viscous_friction) of the joint"
            yield Problem(place("actuators", name), rest)
        yield from super().carrier_problems(name, structure)

    def law(self, name: str, structure: Structure, index: Index) -> Described:  # noqa: ARG002
        """Law of a spring along a line, as the core reads it."""
        return {**numbers(name, tuple(rules_of(type(self))), index)}


class SpringDamper(Compliant):
    """Spring and damper along a line, side by side; the command, a length, is added to the free length."""

    EXAMPLES: ClassVar[Mapping[str, str]] = {
        **Compliant.EXAMPLES,
        "damping": 'damping = { value = 3, unit = "N s/mm" }',
    }

    type: Literal["spring_damper"]
    damping: Annotated[ParameterValue, Rule("N s/m", NOT_NEGATIVE, FEEDING)]
    command_unit: Text = "m"


class Maxwell(Compliant):
    """Spring beside a spring and a damper in a row, along a line; the command is added to the free length."""

    EXAMPLES: ClassVar[Mapping[str, str]] = {
        **Compliant.EXAMPLES,
        "fast_stiffness": 'fast_stiffness = { value = 200, unit = "N/mm" }',
        "relaxation_time": 'relaxation_time = { value = 4, unit = "ms" }',
    }

    type: Literal["maxwell"]
    fast_stiffness: Annotated[
        ParameterValue, Rule("N/m", NOT_NEGATIVE, "fast motion would meet less than the stiffness at rest")
    ]
    relaxation_time: Annotated[ParameterValue, Rule("s", ABOVE_ZERO, "a force that relaxes in no time is none")]
    command_unit: Text = "m"

    @property
    def states(self) -> Mapping[str, str]:
        """State of a Maxwell spring with its SI unit."""
        return {"stretch": "m"}
