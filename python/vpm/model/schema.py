"""Form of a model file: which keys there are and what kind of value each takes.

Only form is checked here. What needs more than one key to judge (references, units, ranges, inertia) comes after.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from vpm.catalogue import EFFECTS, Side
from vpm.catalogue.traits import Traits
from vpm.expression import read_expression
from vpm.model.beam import Beam, Gauge, Line, Marker
from vpm.model.contact import Bushing, Contact, LoadCell, Loop
from vpm.model.controller import TYPES, Controller
from vpm.model.drives import ACTUATOR_TYPES, Actuator
from vpm.model.entry import ORIGIN, ZERO, Entry, Number, ParameterValue, Quantity, Switch, Text, Vector
from vpm.model.hydraulic import Supply
from vpm.model.transmission import Transmission
from vpm.units import parse_unit


class Body(Entry):
    """Rigid body: mass, centre of mass in the body frame, inertia about the centre of mass (xx yy zz xy xz yz).

    Without its `velocity_terms` no products of rates load it.
    """

    mass: ParameterValue
    center_of_mass: Annotated[tuple[ParameterValue, ...], Field(min_length=3, max_length=3)] = (ZERO,) * 3
    inertia: Annotated[tuple[ParameterValue, ...], Field(min_length=6, max_length=6)] = (ZERO,) * 6
    velocity_terms: Switch = True


class DenavitHartenberg(Entry):
    """Place of a joint by four numbers (m, rad), in the standard or in the modified convention."""

    a: Number = 0.0
    alpha: Number = 0.0
    d: Number = 0.0
    theta: Number = 0.0
    convention: Literal["standard", "modified"] = "standard"


JointType = Literal["prismatic", "revolute", "helical", "cylindrical", "planar", "spherical", "free", "fixed"]


class Joint(Entry):
    """Joint between a body and its parent, a body or a beam; its frame is the frame of the child.

    Without `inertia_coupling` the mass matrix has no entries between what is inward of it and what is beyond.
    """

    type: JointType
    parent: Text
    child: Text
    at: Number | None = None
    axis: Vector | None = None
    pitch: Number | None = None
    rotor_inertia: ParameterValue | None = None
    translation: Vector = ORIGIN
    rotation: Vector = ORIGIN
    dh: DenavitHartenberg | None = None
    inertia_coupling: Switch = True


class Sensor(Entry):
    """Reading of one channel.

    Attributes
    ----------
    measures : str
    noise : Quantity, optional
        Standard deviation of what is independent from sample to sample.
    resolution : Quantity, optional
        Step between two readings that it can show.
    """

    measures: Text
    noise: ParameterValue | None = None
    resolution: ParameterValue | None = None


class EffectEntry(BaseModel):
    """An effect of the catalogue at a site; the other keys are its parameters.

    Attributes
    ----------
    type : str
    at : str
    side : {"motor", "link"}
        Where at a joint with a compliance or backlash.
    """

    model_config = ConfigDict(extra="allow", frozen=True)
    __pydantic_extra__: dict[str, ParameterValue] = Field(init=False)

    type: Text
    at: Text
    side: Side = "motor"

    @property
    def owner(self) -> str:
        """What the dotted names of its parameters begin with."""
        return self.at if self.side == "motor" else f"{self.at}.{self.side}"

    @property
    def traits(self) -> Traits:
        """What it does; nothing if the catalogue does not have it."""
        return EFFECTS.get(self.type, Traits())

    @property
    def values(self) -> dict[str, Quantity]:
        """Parameters by short name, as far as they are given."""
        return dict(self.__pydantic_extra__)


def _not_zero(value: float) -> float:
    if value == 0.0:
        raise ValueError("is 0, which would erase the column; give another factor")
    return value


def _readable(unit: str) -> str:
    parse_unit(unit)
    return unit


class ColumnPart(BaseModel):
    """Column that a value is built from; as a name alone it holds pure numbers.

    Attributes
    ----------
    column : str
    unit : str
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    column: Text
    unit: Annotated[Text, AfterValidator(_readable)] = "1"


def _part(given: object) -> object:
    return {"column": given} if isinstance(given, str) else given


def _expression(text: str) -> str:
    if text:
        read_expression(text)
    return text


class ChannelEntry(BaseModel):
    """Column of a log that holds one channel, or columns that it is built from.

    Attributes
    ----------
    column : str
        Name of the column; none where there is a `value`.
    value : str
        Expression over `columns`, worked out in SI; see `vpm.expression`.
    columns : dict of str to ColumnPart
        Column of each name in `value`.
    unit : str
        Unit of ``scale column + offset``; a `value` has to be of its kind.
    scale : float
        Factor on the numbers of the column.
    offset : float
        Added after the scaling, in `unit`.
    delay : float
        How late the samples are stamped (s).
    optional : bool
        A log without the column holds zeros here.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    column: str = ""
    value: Annotated[str, AfterValidator(_expression)] = ""
    columns: dict[str, Annotated[ColumnPart, BeforeValidator(_part)]] = Field(default_factory=dict)
    unit: Annotated[Text, AfterValidator(_readable)]
    scale: Annotated[Number, AfterValidator(_not_zero)] = 1.0
    offset: Number = 0.0
    delay: Number = 0.0
    optional: Switch = False

    @model_validator(mode="after")
    def _is_one(self) -> Self:
        """Check that it is a column, or a value over columns that it names all."""
        if bool(self.column) == bool(self.value):
            raise ValueError("needs either a column, or a value over columns; give one of them")
        named = set(read_expression(self.value).names) if self.value else set()
        for name in sorted(named.symmetric_difference(self.columns)):
            if name in self.columns:
                raise ValueError(f'has columns.{name}, which its value "{self.value}" does not name; leave it out')
            raise ValueError(f'has the value "{self.value}", but columns has no {name}; name its column')
        return self

    @property
    def parts(self) -> dict[str, ColumnPart]:
        """Columns by the names that the value has for them; a column alone has the name ``""``."""
        return self.columns or {"": ColumnPart(column=self.column, unit=self.unit)}

    @property
    def told(self) -> str:
        """What it is read from, in words."""
        return f'value "{self.value}"' if self.value else f'column "{self.column}"'


class Document(Entry):
    """A whole model file."""

    name: Text
    gravity: Vector
    velocity_terms: Switch = True
    bodies: dict[str, Body] = Field(default_factory=dict)
    joints: dict[str, Joint] = Field(default_factory=dict)
    beams: dict[str, Beam] = Field(default_factory=dict)
    lines: dict[str, Line] = Field(default_factory=dict)
    transmissions: dict[str, Transmission] = Field(default_factory=dict)
    gauges: dict[str, Gauge] = Field(default_factory=dict)
    markers: dict[str, Marker] = Field(default_factory=dict)
    supplies: dict[str, Supply] = Field(default_factory=dict)
    actuators: dict[str, Actuator] = Field(default_factory=dict)
    sensors: dict[str, Sensor] = Field(default_factory=dict)
    controllers: dict[str, Controller] = Field(default_factory=dict)
    contacts: dict[str, Contact] = Field(default_factory=dict)
    bushings: dict[str, Bushing] = Field(default_factory=dict)
    load_cells: dict[str, LoadCell] = Field(default_factory=dict)
    loops: dict[str, Loop] = Field(default_factory=dict)
    effects: tuple[EffectEntry, ...] = ()
    channels: dict[str, ChannelEntry] | None = None


#: Tables of named components, in the order in which a file is written.
SECTIONS: Mapping[str, tuple[type[BaseModel], ...]] = {
    "bodies": (Body,),
    "joints": (Joint,),
    "beams": (Beam,),
    "lines": (Line,),
    "transmissions": (Transmission,),
    "gauges": (Gauge,),
    "markers": (Marker,),
    "supplies": (Supply,),
    "actuators": tuple(ACTUATOR_TYPES.values()),
    "sensors": (Sensor,),
    "controllers": TYPES,
    "contacts": (Contact,),
    "bushings": (Bushing,),
    "load_cells": (LoadCell,),
    "loops": (Loop,),
    "channels": (ChannelEntry,),
}


def keys_of(*entries: type[BaseModel]) -> tuple[str, ...]:
    """Keys that a table takes, as they are written in a file."""
    return tuple(field.alias or name for entry in entries for name, field in entry.model_fields.items())
