"""Simpler hydraulic drives: valves that follow at once, one load pressure or none (docs/hydraulics.md)."""

from vpm.model import Model

#: Changes of a servo-cylinder, the one that changes least first.
STATIC, LOAD = "a static spool", "one load pressure"
QUASI_STATIC = "quasi-static pressures"
BOTH, NO_STATE = f"{STATIC} and {LOAD}", f"{STATIC} and {QUASI_STATIC}"
SIMPLER = (STATIC, LOAD, QUASI_STATIC, BOTH, NO_STATE)
#: Clearance of a valve that has none, in parts of its stroke, where a fit begins; as uncertain as it is large.
CLEARANCE = 0.02


def hydraulic_drives(model: Model) -> tuple[str, ...]:
    """Actuators that are servo-cylinders."""
    return tuple(name for name in model.actuators if model.actuator_type(name) == "hydraulic")


def possible_changes(model: Model, drive: str) -> tuple[str, ...]:
    """Simplifications that a hydraulic servo-cylinder does not have yet."""
    entry = model.to_dict()["actuators"][drive]
    static = entry["valve"].get("spool") == "static"
    have = entry["cylinder"].get("pressures", "chambers")
    fewer = {"chambers": (LOAD, QUASI_STATIC), "load": (QUASI_STATIC,), "quasi_static": ()}[have]
    if static:
        return fewer
    return (STATIC, *fewer, *(f"{STATIC} and {change}" for change in fewer))


def simpler(model: Model, drive: str, change: str) -> Model:
    """Model with a simpler hydraulic servo-cylinder that has fewer states.

    ``change``: one of `SIMPLER`.
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
