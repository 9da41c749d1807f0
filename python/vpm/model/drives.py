"""Form of the actuators of a model file: one table for each kind of drive, told apart by ``type``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import BaseModel, Discriminator, Tag

from vpm.model import hydraulic, sampled, table
from vpm.model.entry import Entry, ParameterValue, Quantity, Text
from vpm.model.hydraulic import Hydraulic
from vpm.model.sampled import MaxwellNarx, Narx
from vpm.model.table import Table

ONE = Quantity(value=1.0)


class Ideal(Entry):
    """Drive without a character of its own: effort = gain times command, cut at a limit if it has one."""

    type: Literal["ideal"] = "ideal"
    joint: Text | None = None
    line: Text | None = None
    transmission: Text | None = None
    gain: ParameterValue
    limit: ParameterValue | None = None
    command_unit: Text = "1"


class DcMotor(Entry):
    """Motor with a winding and a gear, on a joint or a transmission; the command is a voltage."""

    type: Literal["dc_motor"]
    joint: Text | None = None
    line: Text | None = None
    transmission: Text | None = None
    resistance: ParameterValue
    time_constant: ParameterValue
    torque_constant: ParameterValue
    back_emf: ParameterValue | None = None
    gear_ratio: ParameterValue = ONE
    efficiency: ParameterValue = ONE
    transition_velocity: ParameterValue = Quantity(value=0.01)
    rotor_inertia: ParameterValue | None = None
    command_unit: Text = "V"


class SpringDamper(Entry):
    """Spring and damper along a line, side by side; the command, a length, is added to the free length."""

    type: Literal["spring_damper"]
    joint: Text | None = None
    line: Text | None = None
    transmission: Text | None = None
    stiffness: ParameterValue
    free_length: ParameterValue
    damping: ParameterValue
    command_unit: Text = "m"


class Maxwell(Entry):
    """Spring beside a spring and a damper in a row, along a line; the command is added to the free length."""

    type: Literal["maxwell"]
    joint: Text | None = None
    line: Text | None = None
    transmission: Text | None = None
    stiffness: ParameterValue
    free_length: ParameterValue
    fast_stiffness: ParameterValue
    relaxation_time: ParameterValue
    command_unit: Text = "m"


def _type_of(entry: object) -> str:
    """Type of an actuator as it is written; ideal without one."""
    kind = entry.get("type", "ideal") if isinstance(entry, Mapping) else getattr(entry, "type", "ideal")
    return kind if isinstance(kind, str) else str(kind)


Actuator = Annotated[
    Annotated[Ideal, Tag("ideal")]
    | Annotated[DcMotor, Tag("dc_motor")]
    | Annotated[SpringDamper, Tag("spring_damper")]
    | Annotated[Maxwell, Tag("maxwell")]
    | Annotated[Hydraulic, Tag("hydraulic")]
    | Annotated[Table, Tag("table")]
    | Annotated[Narx, Tag("narx")]
    | Annotated[MaxwellNarx, Tag("maxwell_narx")],
    Discriminator(_type_of),
]


def acted_on(actuator: Actuator) -> str:
    """Joint, line or transmission of an actuator in words."""
    for what in ("joint", "line"):
        if (name := getattr(actuator, what)) is not None:
            return f'the {what} "{name}"'
    return f'the transmission "{actuator.transmission}"'


#: Actuators whose command is a length to add, so that none is the same as zero.
COMPLIANT = (SpringDamper, Maxwell)

ACTUATOR_TYPES: Mapping[str, type[Entry]] = {
    "ideal": Ideal,
    "dc_motor": DcMotor,
    "spring_damper": SpringDamper,
    "maxwell": Maxwell,
    "hydraulic": Hydraulic,
    "table": Table,
    "narx": Narx,
    "maxwell_narx": MaxwellNarx,
}

#: How a key is written, for messages about missing ones.
EXAMPLES: Mapping[str, str] = {
    **hydraulic.EXAMPLES,
    **sampled.EXAMPLES,
    **table.EXAMPLES,
    "actuators.gain": 'gain = { value = 1.0, unit = "N/V" }',
    "actuators.resistance": 'resistance = { value = 1.2, unit = "Ohm" }',
    "actuators.time_constant": 'time_constant = { value = 2, unit = "ms" }',
    "actuators.torque_constant": 'torque_constant = { value = 50, unit = "N mm/A" }',
    "actuators.stiffness": 'stiffness = { value = 80, unit = "N/mm" }',
    "actuators.free_length": 'free_length = { value = 300, unit = "mm" }',
    "actuators.damping": 'damping = { value = 3, unit = "N s/mm" }',
    "actuators.fast_stiffness": 'fast_stiffness = { value = 200, unit = "N/mm" }',
    "actuators.relaxation_time": 'relaxation_time = { value = 4, unit = "ms" }',
}


def tables_inside(section: str, tag: str | None) -> Mapping[str, type[BaseModel]]:
    """Tables inside of a component, by their key; ``tag`` is the type of an actuator."""
    if section == "actuators" and tag != "hydraulic":
        return {}
    return hydraulic.NESTED.get(section, {})
