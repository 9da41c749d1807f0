"""Form of a model file: which keys there are and what kind of value each takes.

Only form is checked here. What needs more than one key to judge (references, units, ranges, inertia) comes after.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from vpm.model.channels import ChannelEntry

#: A finite number; text and booleans are refused.
Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
#: A number that may be infinite: bounds, and the uncertainty of what is not known beforehand. NaN is refused later.
WideNumber = Annotated[float, Field(strict=True)]
Text = Annotated[str, Field(strict=True, min_length=1)]
Vector = Annotated[tuple[Number, ...], Field(min_length=3, max_length=3)]


class Entry(BaseModel):
    """A table of a model file; unknown keys are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=True)


class Quantity(Entry):
    """Value of a parameter as it stands in the file; a missing unit means SI."""

    value: Number
    unit: Text | None = None
    uncertainty: WideNumber | None = None
    minimum: WideNumber | None = Field(default=None, alias="min")
    maximum: WideNumber | None = Field(default=None, alias="max")


def _as_table(value: object) -> object:
    """Turn a bare number into a table with nothing but the value."""
    if isinstance(value, Mapping | Quantity):
        return value
    if isinstance(value, int | float) and not isinstance(value, bool):
        return {"value": value}
    raise ValueError('has to be a number or a table like { value = 1.0, unit = "kg" }')


ParameterValue = Annotated[Quantity, BeforeValidator(_as_table)]
_ZERO = Quantity(value=0.0)


class Body(Entry):
    """Rigid body: mass, centre of mass in the body frame, inertia about the centre of mass (xx yy zz xy xz yz)."""

    mass: ParameterValue
    center_of_mass: Annotated[tuple[ParameterValue, ...], Field(min_length=3, max_length=3)] = (_ZERO,) * 3
    inertia: Annotated[tuple[ParameterValue, ...], Field(min_length=6, max_length=6)] = (_ZERO,) * 6


class Joint(Entry):
    """Joint between two bodies; its frame is the frame of the child."""

    type: Literal["prismatic", "revolute"]
    parent: Text
    child: Text
    axis: Vector
    translation: Vector = (0.0, 0.0, 0.0)
    rotation: Vector = (0.0, 0.0, 0.0)


class Actuator(Entry):
    """Drive of a joint: effort = gain times command."""

    joint: Text
    gain: ParameterValue
    command_unit: Text = "1"


class Sensor(Entry):
    """Reading of one channel."""

    measures: Text


class Cascade(Entry):
    """Position and velocity loop: u = kv (kp (r - y) - dy)."""

    type: Literal["cascade"]
    actuator: Text
    measures: Text
    position_gain: ParameterValue
    velocity_gain: ParameterValue
    limit: ParameterValue | None = None


class Pid(Entry):
    """u = kp e + ki int e + kd de/dt."""

    type: Literal["pid"]
    actuator: Text
    measures: Text
    proportional: ParameterValue
    integral: ParameterValue = _ZERO
    derivative: ParameterValue = _ZERO
    limit: ParameterValue | None = None


Controller = Annotated[Cascade | Pid, Field(discriminator="type")]


class EffectEntry(BaseModel):
    """An effect of the catalogue at a site; the other keys are its parameters."""

    model_config = ConfigDict(extra="allow", frozen=True)
    __pydantic_extra__: dict[str, ParameterValue] = Field(init=False)

    type: Text
    at: Text

    @property
    def values(self) -> dict[str, Quantity]:
        """Parameters by short name, as far as they are given."""
        return dict(self.__pydantic_extra__)


class Document(Entry):
    """A whole model file."""

    name: Text
    gravity: Vector
    bodies: dict[str, Body] = Field(min_length=1)
    joints: dict[str, Joint] = Field(min_length=1)
    actuators: dict[str, Actuator] = Field(default_factory=dict)
    sensors: dict[str, Sensor] = Field(default_factory=dict)
    controllers: dict[str, Controller] = Field(default_factory=dict)
    effects: tuple[EffectEntry, ...] = ()
    channels: dict[str, ChannelEntry] | None = None


#: Tables of named components, in the order in which a file is written.
SECTIONS: Mapping[str, tuple[type[BaseModel], ...]] = {
    "bodies": (Body,),
    "joints": (Joint,),
    "actuators": (Actuator,),
    "sensors": (Sensor,),
    "controllers": (Cascade, Pid),
    "channels": (ChannelEntry,),
}


def keys_of(*entries: type[BaseModel]) -> tuple[str, ...]:
    """Keys that a table takes, as they are written in a file."""
    return tuple(field.alias or name for entry in entries for name, field in entry.model_fields.items())
