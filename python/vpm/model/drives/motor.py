"""Motor with a winding and a gear."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from vpm.model.component import Described, Index
from vpm.model.drives.drive import Drive, numbers
from vpm.model.entry import ONE, ParameterValue, Quantity, Text
from vpm.model.messages import Problem, place
from vpm.model.parameters import ABOVE_ZERO, ANY, INERTIA, NOT_NEGATIVE, SHARE, TINY, Keys, Rule, Slot, rules_of

if TYPE_CHECKING:
    from vpm.model.structure import Structure


_TURN = Quantity(value=0.01)


class DcMotor(Drive):
    """Motor with a winding and a gear, on a joint or a transmission; the command is a voltage."""

    EXAMPLES: ClassVar[Mapping[str, str]] = {
        "resistance": 'resistance = { value = 1.2, unit = "Ohm" }',
        "time_constant": 'time_constant = { value = 2, unit = "ms" }',
        "torque_constant": 'torque_constant = { value = 50, unit = "N mm/A" }',
    }
    CHANNELS: ClassVar[Mapping[str, str]] = {"current": "A"}
    COMMAND: ClassVar[str] = "V"

    type: Literal["dc_motor"]
    resistance: Annotated[
        ParameterValue, Rule("Ohm", TINY, "without resistance a voltage would drive a current without bound")
    ]
    time_constant: Annotated[
        ParameterValue, Rule("s", ABOVE_ZERO, "a current that runs ahead of its voltage does not exist")
    ]
    torque_constant: Annotated[
        ParameterValue, Rule("N m/A", TINY, "a motor that turns the other way has a negative gear_ratio")
    ]
    back_emf: Annotated[
        ParameterValue | None, Rule("V s/rad", NOT_NEGATIVE, "a negative back-EMF would speed the motor up without end")
    ] = None
    gear_ratio: Annotated[ParameterValue, Rule("", ANY)] = ONE
    efficiency: Annotated[
        ParameterValue, Rule("1", SHARE, "a gear gives no more than it takes, and one that gives nothing is none")
    ] = ONE
    transition_velocity: Annotated[ParameterValue, Rule("", ABOVE_ZERO, "the loss turns over a velocity")] = _TURN
    rotor_inertia: Annotated[ParameterValue | None, Rule("kg m^2", NOT_NEGATIVE, INERTIA)] = None
    command_unit: Text = "V"

    def carrier_problems(self, name: str, structure: Structure) -> Iterator[Problem]:  # noqa: ARG002
        """Problem of a motor on a line that it cannot turn."""
        if self.line is not None:
            rest = f'is a dc_motor on the line "{self.line}", but a motor turns a joint or a transmission; '
            yield Problem(place("actuators", name), f"{rest}give joint or transmission in place of line")

    def units(self, name: str, structure: Structure) -> Mapping[str, str]:
        """SI units of a motor that depend on the model."""
        if structure.driven_kind(name) == "prismatic":
            return {"gear_ratio": "rad/m", "transition_velocity": "m/s"}
        return {"gear_ratio": "1", "transition_velocity": "rad/s"}

    def slots(self, keys: Keys, structure: Structure) -> Iterator[Slot]:
        """Parameters of a direct-current motor; those whose unit depends on the model come last."""
        yield from sorted(
            super().slots(keys, structure), key=lambda slot: not rules_of(DcMotor)[str(slot.keys[-1])].unit
        )

    @property
    def states(self) -> Mapping[str, str]:
        """States of a direct-current motor with their SI units."""
        return {"current": "A"}

    def law(self, name: str, structure: Structure, index: Index) -> Described:  # noqa: ARG002
        """What the core reads of the law of a direct-current motor; in SI both constants of a motor are one number."""
        keys = ("resistance", "time_constant", "torque_constant", "back_emf", "gear_ratio", "efficiency")
        law = numbers(name, (*keys, "transition_velocity", "rotor_inertia"), index)
        return {**law, "back_emf": law["torque_constant"] if law["back_emf"] is None else law["back_emf"]}
