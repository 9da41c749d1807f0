"""Simpler hydraulic drives: valves that follow at once, one load pressure or none, an element in their place.

The laws of the reduced drives are in docs/hydraulics.md, those of the Maxwell element in docs/maxwell_narx.md.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from vpm.errors import ModelError
from vpm.model import Model

#: Changes of a servo-cylinder, the one that changes least first.
STATIC, LOAD = "a static spool", "one load pressure"
QUASI_STATIC = "quasi-static pressures"
BOTH, NO_STATE = f"{STATIC} and {LOAD}", f"{STATIC} and {QUASI_STATIC}"
SIMPLER = (STATIC, LOAD, QUASI_STATIC, BOTH, NO_STATE)
#: Clearance of a valve that has none, in parts of its stroke, where a fit begins; as uncertain as it is large.
CLEARANCE = 0.02


def hydraulic_drives(model: Model) -> tuple[str, ...]:
    """Actuators that are servo-cylinders.

    Parameters
    ----------
    model : Model
    """
    return tuple(name for name in model.actuators if model.actuator_type(name) == "hydraulic")


def possible_changes(model: Model, drive: str) -> tuple[str, ...]:
    """Changes that a servo-cylinder does not have yet.

    Parameters
    ----------
    model : Model
    drive : str
    """
    entry = model.to_dict()["actuators"][drive]
    static = entry["valve"].get("spool") == "static"
    have = entry["cylinder"].get("pressures", "chambers")
    fewer = {"chambers": (LOAD, QUASI_STATIC), "load": (QUASI_STATIC,), "quasi_static": ()}[have]
    if static:
        return fewer
    return (STATIC, *fewer, *(f"{STATIC} and {change}" for change in fewer))


def simpler(model: Model, drive: str, change: str) -> Model:
    """Model with a servo-cylinder that has fewer states.

    Parameters
    ----------
    model : Model
    drive : str
    change : str
        One of `SIMPLER`.

    Raises
    ------
    ModelError
        An effect needs what is left out.
    """
    content = model.to_dict()
    entry = content["actuators"][drive]
    if change in (STATIC, BOTH, NO_STATE):
        kept = {key: value for key, value in entry["valve"].items() if key not in ("frequency", "damping")}
        entry["valve"] = {**kept, "spool": "static"}
    if change in (LOAD, BOTH):
        entry["cylinder"] = {**entry["cylinder"], "pressures": "load"}
    if change in (QUASI_STATIC, NO_STATE):
        entry["cylinder"] = {**entry["cylinder"], "pressures": "quasi_static"}
        if "clearance" not in entry["valve"]:
            size = CLEARANCE * model.parameters[f"{drive}.valve.stroke"].value
            entry["valve"] = {**entry["valve"], "clearance": {"value": size, "uncertainty": size}}
    return type(model)(content)


def replaced(model: Model, drive: str, entry: str) -> Model:
    """Model with another drive in the place of a servo-cylinder and of its controller; the command is the reference.

    Parameters
    ----------
    model : Model
    drive : str
    entry : str
        The other drive as JSON, without the joint or line that it acts on.

    Raises
    ------
    ModelError
        A controller commands other drives as well, or something else in the model refers to what is gone.
    """
    content = model.to_dict()
    own = content["actuators"][drive]
    place = {key: own[key] for key in ("joint", "line") if key in own}
    content["actuators"][drive] = {**place, **json.loads(entry)}
    controllers = content.get("controllers", {})
    alone = {name for name, controller in controllers.items() if controller.get("actuator") == drive}
    if drive in model.controlled_actuators and not alone:
        raise ModelError(
            f"the controller of {drive} commands other drives as well, so that no element can stand for both; "
            "give each drive a controller of its own"
        )
    content["controllers"] = {name: entry for name, entry in controllers.items() if name not in alone}
    used = {entry.get("supply") for entry in content["actuators"].values()}
    content["supplies"] = {name: entry for name, entry in content.get("supplies", {}).items() if name in used}
    gone = {drive, *(set(model.supplies) - set(content["supplies"]))}
    content["effects"] = [effect for effect in content.get("effects", ()) if effect["at"] not in gone]
    content["sensors"] = _kept_sensors(content.get("sensors", {}), gone)
    return type(model)({key: value for key, value in content.items() if value or key not in _OPTIONAL})


#: Tables that a model without such parts does not have.
_OPTIONAL = ("controllers", "supplies", "effects", "sensors")


def _kept_sensors(sensors: Mapping[str, Any], gone: set[str]) -> dict[str, Any]:
    """Sensors of what is still there: force and command are, spool and pressures are not."""
    still = ("command", "force")
    parts = {name: str(sensor["measures"]).rpartition(".") for name, sensor in sensors.items()}
    return {name: sensors[name] for name, (owner, _, what) in parts.items() if owner not in gone or what in still}
