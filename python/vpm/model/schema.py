"""A whole model file: its sections, each with the kind of component that it holds.

Only form is checked by it. What needs more than one key to judge (references, units, ranges, inertia) comes after.
"""

from collections.abc import Iterator, Mapping
from types import NoneType, UnionType
from typing import Annotated, Literal, Union, get_args, get_origin

from pydantic import BaseModel, Field, Tag

from vpm.model.beams.beam import Beam
from vpm.model.beams.gauge import Gauge
from vpm.model.body import Body
from vpm.model.bushing import Bushing
from vpm.model.channels import ChannelEntry
from vpm.model.component import Component
from vpm.model.contact import Contact
from vpm.model.controller import Controller
from vpm.model.drives.actuator import Actuator
from vpm.model.drives.supply import Supply
from vpm.model.effects import EffectEntry
from vpm.model.entry import Entry, Quantity, Switch, Text, Vector
from vpm.model.imu import Imu
from vpm.model.joint import Joint
from vpm.model.line import Line
from vpm.model.load_cell import LoadCell
from vpm.model.loops.loop import Loop
from vpm.model.marker import Marker
from vpm.model.sensor import Sensor
from vpm.model.transmission import Transmission

#: Keys that lead to a place.
Place = tuple[str | int, ...]
#: Kinds of the tables that may stand at a place.
Tables = tuple[type[BaseModel], ...]


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
    imus: dict[str, Imu] = Field(default_factory=dict)
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

    def components(self, *sections: str) -> Iterator[tuple[str, str, Component]]:
        """Components of some sections of the schema, in their order, each with its section and its name."""
        for section in sections:
            named: dict[str, Component] = getattr(self, section)
            yield from ((section, name, component) for name, component in named.items())


def keys_of(*entries: type[BaseModel]) -> tuple[str, ...]:
    """Keys of the schema that a table takes, as they are written in a file."""
    return tuple(field.alias or name for entry in entries for name, field in entry.model_fields.items())


def located(location: Place, document: type[BaseModel] = Document) -> tuple[Place, Tables]:
    """Place in a file that the schema of a document tells, and the tables that its last key may stand in.

    A location of the schema also has the member of a union that was read, such as the type of an actuator.
    """
    members, keys = list(_members(document)), list[str | int]()
    around = members
    for key in location:
        chosen = [member for member in members if key in member[1]] if len(members) > 1 else []
        if chosen:
            members = chosen
            continue
        keys.append(key)
        around, members = members, [inner for kind, _ in members for inner in _inside(kind, key)]
    return tuple(keys), tuple(kind for kind, _ in around if isinstance(kind, type) and issubclass(kind, BaseModel))


def _members(kind: object, tags: tuple[object, ...] = ()) -> Iterator[tuple[object, tuple[object, ...]]]:
    """Members of a union, or the one type that is none, each with the names that the schema has for it."""
    inside = get_args(kind)
    if get_origin(kind) is Annotated:
        yield from _members(inside[0], tuple(mark.tag for mark in inside[1:] if isinstance(mark, Tag)) or tags)
    elif get_origin(kind) in {Union, UnionType}:
        for member in inside:
            yield from _members(member)
    elif isinstance(kind, type) and issubclass(kind, BaseModel):
        chosen = [field.annotation for field in kind.model_fields.values() if get_origin(field.annotation) is Literal]
        yield kind, (*tags, *(name for literal in chosen for name in get_args(literal)))
    elif kind is not NoneType:
        yield kind, tags


def _inside(kind: object, key: str | int) -> Iterator[tuple[object, tuple[object, ...]]]:
    """Types of the schema inside a key: of a table, a list, or a table of names."""
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        fields = [field for name, field in kind.model_fields.items() if key == (field.alias or name)]
        for field in fields:
            yield from _members(field.annotation)
        if not fields and kind.model_config.get("extra") == "allow":  # of an effect: its parameters
            yield from _members(Quantity)
    elif get_origin(kind) in {dict, tuple}:
        yield from _members(next(inner for inner in reversed(get_args(kind)) if inner is not Ellipsis))


def _kinds_of(section: str) -> Tables:
    """Kinds of the named components of a section of the schema."""
    named = (kind for kind, _ in _inside(Document, section) if get_origin(kind) is dict)
    return tuple(kind for names in named for kind, _ in _inside(names, "") if isinstance(kind, type))


#: Kinds of named components by section, in the order in which a file is written.
SECTIONS: Mapping[str, Tables] = {section: kinds for section in Document.model_fields if (kinds := _kinds_of(section))}
