"""From a checked document to the description that the core reads: names become indices, parameters one flat vector."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

from vpm.catalogue import EFFECTS
from vpm.model.check import Checked
from vpm.model.effects import Effect, effects_of
from vpm.model.parameters import INERTIA_AXES
from vpm.model.schema import Cascade, Controller, Joint
from vpm.model.structure import Structure


def description(checked: Checked) -> str:
    """Description of a model for the core, as JSON text.

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
        "parameters": [parameter.value for parameter in checked.parameters.values()],
        "parameter_names": list(index),
        "bodies": [_body(k, structure, index) for k in range(len(structure.bodies))],
        "effects": [_effect(e, structure, index) for e in effects if EFFECTS[e.name].site in {"joint", "body"}],
        "actuators": [_actuator(name, structure, index) for name in document.actuators],
        "sensors": [_sensor(name, structure, index) for name in document.sensors],
        "controllers": [_controller(name, c, structure, index) for name, c in document.controllers.items()],
    }
    return json.dumps(content, allow_nan=False)


def _body(k: int, structure: Structure, index: Mapping[str, int]) -> dict[str, Any]:
    name, joint = structure.bodies[k], structure.joints[k]
    return {
        "name": name,
        "on": "world" if structure.parents[k] is None else {"body": structure.parents[k]},
        "joint": _joint(joint, structure.document.joints[joint]),
        "inertia": {
            "mass": index[f"{name}.mass"],
            "center_of_mass": [index[f"{name}.center_of_mass.{axis}"] for axis in "xyz"],
            "moments": [index[f"{name}.inertia.{axes}"] for axes in INERTIA_AXES],
        },
    }


def _joint(name: str, joint: Joint) -> dict[str, Any]:
    length = math.hypot(*joint.axis)
    return {
        "name": name,
        "kind": joint.type,
        "axis": [component / length for component in joint.axis],
        "translation": list(joint.translation),
        "rotation": rotation_matrix(*joint.rotation),
    }


def rotation_matrix(roll: float, pitch: float, yaw: float) -> list[float]:
    """Rotation matrix R = Rz(yaw) Ry(pitch) Rx(roll), nine numbers row by row.

    Turns about the fixed axes x, y, z in this order (J. Craig, "Introduction to Robotics", 3rd edition, equation 2.64).

    Parameters
    ----------
    roll, pitch, yaw : float
        rad.
    """
    cr, sr, cp, sp, cy, sy = (f(angle) for angle in (roll, pitch, yaw) for f in (math.cos, math.sin))
    return [
        *(cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        *(sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        *(-sp, cp * sr, cp * cr),
    ]


def _effect(effect: Effect, structure: Structure, index: Mapping[str, int]) -> dict[str, Any]:
    numbers = {short: index[dotted] for short, dotted in effect.parameter_names.items()}
    if effect.type.site == "joint":
        return {"type": effect.name, "joint": structure.joints.index(effect.at), **numbers}
    position = [numbers.pop(axis) for axis in "xyz"]
    return {"type": effect.name, "body": structure.bodies.index(effect.at), **numbers, "position": position}


def _actuator(name: str, structure: Structure, index: Mapping[str, int]) -> dict[str, Any]:
    return {
        "name": name,
        "on": {"joint": structure.joints.index(structure.document.actuators[name].joint)},
        "gain": index[f"{name}.gain"],
        "delay": index.get(f"{name}.delay.time"),
        "dead_zone": index.get(f"{name}.dead_zone.width"),
        "saturation": index.get(f"{name}.saturation.limit"),
        "lag": index.get(f"{name}.lag.time_constant"),
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
    keys = (
        ("position_gain", "velocity_gain")
        if isinstance(controller, Cascade)
        else ("proportional", "integral", "derivative")
    )
    return {
        "type": controller.type,
        "name": name,
        "actuator": list(structure.document.actuators).index(controller.actuator),
        "measures": _channel(controller.measures, structure),
        **{key: index[f"{name}.{key}"] for key in keys},
        "limit": index.get(f"{name}.limit"),
    }


def _channel(channel: str, structure: Structure) -> dict[str, Any]:
    owner, _, kind = channel.partition(".")
    if owner in structure.joints:
        return {"kind": kind, "joint": structure.joints.index(owner)}
    return {"kind": kind, "actuator": list(structure.document.actuators).index(owner)}
