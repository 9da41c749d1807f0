"""Channels of a model: who has which, in the order of the core, their units, and how the core is asked for one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, NamedTuple

from vpm.errors import ModelError, near_match
from vpm.model.component import Described
from vpm.model.joint import BALL, COORDINATE_UNIT, EFFORT_UNIT
from vpm.units import si_unit

if TYPE_CHECKING:
    from vpm.model.structure import Structure

#: What a simulation gives of every actuator, and what a log may hold of it besides.
_DRIVEN, _LOGGED = {"command": "", "force": ""}, {"reference": "", "disturbance": ""}
_MOVING = dict.fromkeys(("position", "velocity", "acceleration", "effort"), "")


class Owners(NamedTuple):
    """Components with the same channels."""

    what: str  #: What the core calls one of them.
    names: tuple[str, ...]
    units: Mapping[str, str]  #: SI units of their channels; "" where it is another one for each.
    key: str = ""  #: What the core calls the channel: nothing where it is the kind of the reading.


def owners(structure: Structure) -> Iterator[Owners]:
    """Components that have output channels, in the order of the core."""
    document = structure.document

    def those(what: str, section: str, key: str = "") -> Iterator[Owners]:
        entries = getattr(document, section)
        if entries:
            yield Owners(what, tuple(entries), next(iter(entries.values())).CHANNELS, key)

    yield Owners("joint", structure.joints, _MOVING)
    yield Owners("actuator", tuple(document.actuators), _DRIVEN)
    yield from those("line", "lines")
    yield from those("line", "transmissions")
    yield from those("gauge", "gauges")
    yield from those("marker", "markers")
    for kind, key in (("hydraulic", "quantity"), ("dc_motor", "")):
        if driven := structure.driven_by(kind):
            yield Owners(kind, driven, document.actuators[driven[0]].CHANNELS, key)
    yield from those("supply", "supplies", "quantity")
    yield from those("contact", "contacts", "quantity")
    yield from those("bushing", "bushings", "component")
    yield from those("load_cell", "load_cells", "component")
    yield Owners("ball", tuple(structure.balls), BALL, "quantity")
    yield from those("loop", "loops", "component")
    yield from those("imu", "imus", "quantity")


def outputs_of(structure: Structure) -> tuple[str, ...]:
    """Output channels that a simulation of a model gives, in the order of the core."""
    return tuple(f"{name}.{channel}" for group in owners(structure) for name in group.names for channel in group.units)


def channels_of(structure: Structure) -> tuple[str, ...]:
    """Channels that a log may hold: all outputs, and more of actuators."""
    groups = (g._replace(units=_DRIVEN | _LOGGED) if g.units is _DRIVEN else g for g in owners(structure))
    return tuple(f"{name}.{channel}" for group in groups for name in group.names for channel in group.units)


def unit_of(channel: str, structure: Structure) -> str:
    """SI unit of an output channel, or a ModelError that names near ones."""
    owner, _, name = channel.partition(".")
    if channel in structure.deflections:
        return COORDINATE_UNIT[structure.joint_kind(structure.deflections[channel])]
    if channel not in structure.known_channels:
        repair = near_match(channel, structure.channels, what="its channels are")
        raise ModelError(f'the model has no channel "{channel}"; {repair}', where=channel)
    if owner in structure.joints:
        coordinate = COORDINATE_UNIT[structure.joint_kind(owner)]
        units = {"position": coordinate, "velocity": f"{coordinate}/s", "acceleration": f"{coordinate}/s^2"}
        return units.get(name, EFFORT_UNIT[structure.joint_kind(owner)])
    found = next((group.units[name] for group in owners(structure) if owner in group.names and name in group.units), "")
    return found or _actuator_unit(owner, name, structure)


def _actuator_unit(actuator: str, channel: str, structure: Structure) -> str:
    document = structure.document
    if channel == "force":
        return structure.effort_unit(actuator)
    if channel == "reference":
        # Of what the controller holds: a position of some joint or shaft, a length of some line.
        pairs = [pair for controller in document.controllers.values() for pair in controller.pairs]
        held = [measured for commanded, measured in pairs if commanded == actuator]
        kind = structure.driven_kind(actuator)
        own = "m" if kind is None else COORDINATE_UNIT[kind]
        return structure.unit(held[0]) if held else own
    return si_unit(document.actuators[actuator].command_unit)


def described_channel(channel: str, structure: Structure) -> Described:
    """Output channel as the core reads it."""
    owner, _, kind = channel.partition(".")
    group = next(group for group in owners(structure) if owner in group.names and kind in group.units)
    if owner in structure.wires:  # the core calls the channels of a shaft as those of a line
        lines = ("length", "rate", "tension")
        return {"kind": lines[tuple(group.units).index(kind)], "line": structure.wires.index(owner)}
    number = {group.what: group.names.index(owner)}
    return {"kind": group.what, **number, group.key: kind} if group.key else {"kind": kind, **number}
