"""From a checked document to the description that the core reads: names become indices, parameters one flat vector."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vpm.catalogue import EFFECTS, effects_for_site
from vpm.model.beam import End, Gauge, Layers, Line, Marker, Material, Rest, Section, section_parameter, sections_of
from vpm.model.checked import Checked
from vpm.model.connection_compile import (
    bushing_json,
    cell_json,
    connection_channel,
    contact_json,
    frame_json,
    loop_json,
    mount_json,
)
from vpm.model.controller import ComputedTorque, Controller
from vpm.model.drive_compile import drive_json, optional_json, supply_json
from vpm.model.effect_compile import EFFECT_SITES, effect_json, shaft_json
from vpm.model.effects import effects_of
from vpm.model.omissions import omissions
from vpm.model.parameters import INERTIA_AXES
from vpm.model.pose import Pose, pose
from vpm.model.structure import (
    HYDRAULIC_CHANNELS,
    LINE_UNITS,
    SHAFT_UNITS,
    SUPPLY_CHANNELS,
    Axis,
    Frame,
    Structure,
)

#: Parameters of a reduced solid in the place of young, poisson and density; the core has no use for the second one.
_FACTORS = ("stiffness_factor", "stiffness_factor", "mass_factor")


def described(structure: str, theta: NDArray[np.float64]) -> str:
    """Description of a model for the core, as JSON text, from that of its structure and the values of its parameters.

    Minus zeros are zeros there: two models are equal when their descriptions are.
    """
    return f'{{"parameters": {json.dumps((theta + 0.0).tolist(), allow_nan=False)}, {structure.removeprefix("{")}'


def structure_text(checked: Checked) -> str:
    """Description of a model for the core without the values of its parameters, as JSON text.

    Parameters
    ----------
    checked : Checked

    Returns
    -------
    str
        Everything that is a parameter is an index into ``parameters``; all numbers are SI.
    """
    index = {name: i for i, name in enumerate(checked.parameters)}
    structure, document = checked.structure, checked.document
    effects = effects_of(document)
    content = {
        "gravity": list(document.gravity),
        "parameter_names": list(index),
        "bodies": [_body(axis, index) for axis in structure.axes],
        "welds": [_weld(name, structure.frames[name], index) for name in structure.welds],
        "beams": [_beam(name, structure, index) for name in structure.beams],
        "gauges": [_gauge(name, gauge, structure) for name, gauge in document.gauges.items()],
        "markers": [_marker(name, marker, structure) for name, marker in document.markers.items()],
        "lines": [_line(name, line, structure, index) for name, line in document.lines.items()],
        "effects": [
            part for e in effects if EFFECTS[e.name].site in EFFECT_SITES for part in effect_json(e, structure, index)
        ],
        "supplies": [supply_json(name, supply, index) for name, supply in document.supplies.items()],
        "actuators": [_actuator(name, structure, index) for name in document.actuators],
        "sensors": [_sensor(name, structure, index) for name in document.sensors],
        "controllers": [_controller(name, c, structure, index) for name, c in document.controllers.items()],
        "contacts": [contact_json(name, entry, structure, index) for name, entry in document.contacts.items()],
        "bushings": [bushing_json(name, entry, structure, index) for name, entry in document.bushings.items()],
        "load_cells": [cell_json(name, entry, structure) for name, entry in document.load_cells.items()],
    }
    if document.transmissions:  # older programs know no such key
        content["transmissions"] = [_transmission(name, structure, index) for name in document.transmissions]
    if document.loops:
        content["loops"] = [loop_json(name, entry, structure) for name, entry in document.loops.items()]
    if structure.balls:
        content["balls"] = [{"name": name, "angles": list(map(list, of))} for name, of in structure.balls.items()]
    if not document.velocity_terms:
        content["drop_velocity_terms"] = True
    if omitted := omissions(structure):
        content["omissions"] = omitted
    return json.dumps(_unsigned(content), allow_nan=False)


def _unsigned(value: object) -> object:
    """Content without minus zeros, which mean the same as zeros: two models are equal when their descriptions are."""
    match value:
        case float():
            return value + 0.0
        case list():
            return [_unsigned(item) for item in value]
        case dict():
            return {key: _unsigned(item) for key, item in value.items()}
    return value


def _pose(placed: Pose) -> dict[str, Any]:
    return {"translation": list(placed.translation), "rotation": list(placed.rotation)}


def _body(axis: Axis, index: Mapping[str, int]) -> dict[str, Any]:
    coordinate = axis.coordinate
    kind = {"helical": {"pitch": coordinate.pitch}} if coordinate.kind == "helical" else coordinate.kind
    return {
        "name": axis.carrier,
        "on": mount_json(axis.frame.mount),
        "joint": {"name": axis.name, "kind": kind, "axis": list(coordinate.direction), **_pose(axis.frame.pose)},
        "inertia": None if axis.body is None else _inertia(axis.body, index),
        "rotor_inertia": index.get(f"{axis.name}.rotor_inertia"),
    }


def _weld(name: str, frame: Frame, index: Mapping[str, int]) -> dict[str, Any]:
    return {"name": name, **frame_json(frame), "inertia": _inertia(name, index)}


def _inertia(body: str, index: Mapping[str, int]) -> dict[str, Any]:
    return {
        "mass": index[f"{body}.mass"],
        "center_of_mass": [index[f"{body}.center_of_mass.{axis}"] for axis in "xyz"],
        "moments": [index[f"{body}.inertia.{axes}"] for axes in INERTIA_AXES],
    }


def _beam(name: str, structure: Structure, index: Mapping[str, int]) -> dict[str, Any]:
    beam = structure.document.beams[name]
    level = beam.detail
    modes = len(level.coordinates(beam.deforms))
    own = _FACTORS if beam.solid is not None else () if beam.material is None else tuple(Material.units)
    return {
        "name": name,
        **frame_json(structure.frames[name]),
        "length": beam.reach,
        "level": level.name if level.name == "rigid" else {level.name: level.number},
        "deforms": list(beam.deforms),
        **(
            {"material": {key: index[f"{name}.{o}"] for key, o in zip(Material.units, own, strict=True)}} if own else {}
        ),
        "sections": [_section(name, way, section, index) for way, section in sections_of(beam)],
        **({} if not beam.curvature else {"rest": [_rest(rest) for rest in beam.curvature]}),
        "damping": {
            "stiffness": index.get(f"{name}.damping.stiffness"),
            "mass": index.get(f"{name}.damping.mass"),
            # A coarse level has fewer modes than ratios may be given for.
            "ratios": [index[f"{name}.damping.ratios.{i}"] for i in range(min(modes, len(beam.damping.ratios)))],
        },
        **({} if beam.solid is None else {"reduced": beam.solid.content()}),
    }


def _section(beam: str, way: tuple[str | int, ...], section: Section, index: Mapping[str, int]) -> dict[str, Any]:
    places = {inside: index[section_parameter(beam, way, inside)] for inside in section.numbers}
    sizes = {str(inside[0]): at for inside, at in places.items() if len(inside) == 1}
    shape: dict[str, Any] = {"shape": section.shape, **sizes}
    if isinstance(section, Layers):
        shape["layers"] = [
            {
                "thickness": places["layers", i, "thickness"],
                "material": {key: places["layers", i, key] for key in Material.units},
            }
            for i in range(len(section.layers))
        ]
    own = {str(inside[1]): at for inside, at in places.items() if inside[0] == "material"}
    return {"at": section.at or 0.0, "shape": shape, **({"material": own} if own else {})}


def _rest(rest: Rest) -> dict[str, Any]:
    return {"at": rest.at or 0.0, "curvature": [rest.bending_x, rest.bending_y, rest.torsion]}


def _gauge(name: str, gauge: Gauge, structure: Structure) -> dict[str, Any]:
    length = structure.document.beams[gauge.beam].reach
    beam = structure.beams.index(gauge.beam)
    return {"name": name, "beam": beam, "at": min(gauge.at, length), "x": gauge.x, "y": gauge.y}


def _marker(name: str, marker: Marker, structure: Structure) -> dict[str, Any]:
    placed = pose(marker.translation, marker.rotation)
    return {"name": name, **frame_json(structure.mounted(marker.parent, marker.at, placed))}


def _line(name: str, line: Line, structure: Structure, index: Mapping[str, int]) -> dict[str, Any]:
    parts = {
        key: None
        if part is None
        else {short: index[f"{name}.{key}.{short}"] for short in ("mass", "center", "inertia")}
        for key, part in (("barrel", line.barrel), ("rod", line.rod))
    }
    return {"name": name, "from": _end(line.start, structure), "to": _end(line.end, structure), **parts}


def _transmission(name: str, structure: Structure, index: Mapping[str, int]) -> dict[str, Any]:
    ratios = shaft_json(name, structure, index)["ratios"]
    return {"name": name, "ratios": ratios, "inertia": index.get(f"{name}.inertia")}


def _end(end: End, structure: Structure) -> dict[str, Any]:
    frame = structure.mounted(end.parent, end.at, Pose(end.point))
    return {"on": mount_json(frame.mount), "point": list(frame.pose.translation)}


def _actuator(name: str, structure: Structure, index: Mapping[str, int]) -> dict[str, Any]:
    actuator = structure.document.actuators[name]
    friction = optional_json(f"{name}.friction", ("driving", "driven", "transition_velocity"), index)
    # What spoils a command is a key of its drive, called like the group of its one parameter.
    numbers = {effect.group: effect.parameters for effect in effects_for_site("actuator")}
    faults = {key: index.get(f"{name}.{own[0].suffix}") for key, own in numbers.items() if len(own) == 1}
    return {
        "name": name,
        "on": {"joint": structure.joints.index(actuator.joint)}
        if actuator.joint is not None
        else {"line": structure.wires.index(actuator.line or actuator.transmission or "")},
        "drive": drive_json(name, actuator, structure, index),
        **faults,
        **({} if friction is None else {"friction": friction}),
    }


def _sensor(name: str, structure: Structure, index: Mapping[str, int]) -> dict[str, Any]:
    return {
        "name": name,
        "channel": _channel(structure.document.sensors[name].measures, structure),
        "gain": index.get(f"{name}.gain.value"),
        "offset": index.get(f"{name}.offset.value"),
        "delay": index.get(f"{name}.delay.time"),
    }


def _controller(name: str, controller: Controller, structure: Structure, index: Mapping[str, int]) -> dict[str, Any]:
    actuators = [list(structure.document.actuators).index(actuator) for actuator, _ in controller.pairs]
    channels = [_channel(channel, structure) for _, channel in controller.pairs]
    common = {
        "type": controller.type,
        "name": name,
        "sample_time": controller.sample_time,
        "delay": controller.delay or None,
    }
    if isinstance(controller, ComputedTorque):

        def of_joints(key: str) -> list[int]:
            return [index[f"{name}.{key}.{joint}"] for joint in controller.joints]

        numbers = {key: of_joints(key) for key in ("proportional", "derivative")}
        limit = None if controller.limit is None else of_joints("limit")
        return {**common, "actuators": actuators, "measures": channels, **numbers, "limit": limit}
    return {
        **common,
        "actuator": actuators[0],
        "measures": channels[0],
        **{key: index[f"{name}.{key}"] for key in controller.GAINS},
        "limit": index.get(f"{name}.limit"),
    }


def _channel(channel: str, structure: Structure) -> dict[str, Any]:
    owner, _, kind = channel.partition(".")
    connection = connection_channel(owner, kind, structure)
    if connection is not None:
        return connection
    owners: dict[str, tuple[str, ...]] = {
        "joint": structure.joints,
        "actuator": tuple(structure.document.actuators),
        "line": structure.wires,
        "gauge": tuple(structure.document.gauges),
        "marker": tuple(structure.document.markers),
    }
    drives = {"hydraulic": (structure.driven_by("hydraulic"), HYDRAULIC_CHANNELS)}
    drives |= {"supply": (tuple(structure.document.supplies), SUPPLY_CHANNELS)}
    for what, (names, quantities) in drives.items():
        if owner in names and kind in quantities:
            return {"kind": what, what: names.index(owner), "quantity": kind}
    if owner in structure.balls:
        return {"kind": "ball", "ball": list(structure.balls).index(owner), "quantity": kind}
    if kind == "current":
        return {"kind": kind, "dc_motor": structure.driven_by("dc_motor").index(owner)}
    what, names = next((what, names) for what, names in owners.items() if owner in names)
    if owner in structure.document.transmissions:
        kind = tuple(LINE_UNITS)[tuple(SHAFT_UNITS).index(kind)]
    return {"kind": kind, what: names.index(owner)}
