"""Supplies and drives for the core: every parameter becomes its index."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from vpm.model.drives import Actuator, DcMotor, Ideal, Maxwell, SpringDamper
from vpm.model.hydraulic import Hydraulic, Supply
from vpm.model.sampled import MaxwellNarx, Narx
from vpm.model.sampled_compile import maxwell_json, narx_json
from vpm.model.structure import Structure
from vpm.model.table import Table

Index = Mapping[str, int]


def supply_json(name: str, supply: Supply, index: Index) -> dict[str, Any]:
    """Description of a supply."""
    sagging = {key: index.get(f"{name}.{key}") for key in ("resistance", "capacitance")}
    air = {key: index.get(f"{name}.oil.air.{key}") for key in ("fraction", "exponent", "reference_pressure")}
    return {
        "name": name,
        "pressure": index[f"{name}.pressure"],
        "tank_pressure": index[f"{name}.tank_pressure"],
        "oil": {
            "bulk_modulus": index[f"{name}.oil.bulk_modulus"],
            "vapour_pressure": index[f"{name}.oil.vapour_pressure"],
            "air": None if supply.oil.air is None else air,
            "more_air": optional_json(f"{name}.entrained_air", tuple(air), index),
        },
        "source": {"sagging": sagging} if supply.source == "sagging" else supply.source,
        "drop": optional_json(f"{name}.drop", ("resistance", "time_constant"), index),
    }


def optional_json(way: str, keys: tuple[str, ...], index: Index) -> dict[str, int] | None:
    """What an effect adds, if it is there."""
    return {key: index[f"{way}.{key}"] for key in keys} if f"{way}.{keys[0]}" in index else None


def drive_json(name: str, actuator: Actuator, structure: Structure, index: Index) -> dict[str, Any]:
    """Law of an actuator."""

    def numbers(*keys: str, way: str = name) -> dict[str, int | None]:
        return {key: index.get(f"{way}.{key}") for key in keys}

    match actuator:
        case Ideal():
            law: dict[str, Any] = numbers("gain", "limit")
        case DcMotor():
            law = numbers("resistance", "time_constant", "torque_constant", "back_emf", "gear_ratio", "efficiency")
            law |= numbers("transition_velocity", "rotor_inertia")
            if law["back_emf"] is None:  # in SI both constants of a motor are one number
                law["back_emf"] = law["torque_constant"]
        case SpringDamper():
            law = numbers("stiffness", "free_length", "damping")
        case Maxwell():
            law = numbers("stiffness", "free_length", "fast_stiffness", "relaxation_time")
        case Hydraulic():
            law = {
                "supply": tuple(structure.document.supplies).index(actuator.supply),
                "retracted_length": index[f"{name}.retracted_length"],
                "valve": {**_valve(f"{name}.valve", index), "delay": index.get(f"{name}.valve_dynamics.time")},
                "cylinder": _cylinder(name, actuator, index),
            }
            if actuator.cylinder.pressures != "chambers":
                law["pressures"] = actuator.cylinder.pressures
            if actuator.valve.clearance is not None:
                law["valve"]["clearance"] = index[f"{name}.valve.clearance"]
        case Table():
            law = {key: list(getattr(actuator, key)) for key in ("commands", "velocities")}
            law["efforts"] = [effort for row in actuator.efforts for effort in row]
        case Narx():
            law = narx_json(name, actuator, structure)
        case MaxwellNarx():
            law = maxwell_json(actuator)
    return {"type": actuator.type, **law}


def _valve(way: str, index: Index) -> dict[str, Any]:
    return {
        **{key: index[f"{way}.{key}"] for key in ("gain", "stroke", "overlap")},
        **{key: index.get(f"{way}.{key}") for key in ("frequency", "damping")},
        "orifice": {"gain": index[f"{way}.flow_gain"], "transition_pressure": index[f"{way}.transition_pressure"]},
    }


def _cylinder(name: str, actuator: Hydraulic, index: Index) -> dict[str, Any]:
    way = f"{name}.cylinder"
    sizes = ("bore", "rod") if actuator.cylinder.bore is not None else ("area", "area_ratio")
    keys = ("stroke", "line_a", "line_b", "internal_leakage", "external_leakage")
    return {
        "size": {key: index[f"{way}.{key}"] for key in sizes},
        **{key: index[f"{way}.{key}"] for key in keys},
        "worn_leakage": index.get(f"{name}.internal_leakage.coefficient"),
        "stop": {key: index[f"{way}.stop_{key}"] for key in ("stiffness", "damping")},
        "seal": _seal(f"{name}.friction", index),
    }


def _seal(way: str, index: Index) -> dict[str, Any]:
    shapes = {
        "viscous": ("viscous",),
        "coulomb": ("coulomb", "transition_velocity"),
        "stribeck": ("stribeck", "stribeck_velocity", "transition_velocity"),
    }
    return {
        law: {key: index[f"{way}.{key}"] for key in keys} if f"{way}.{law}" in index else None
        for law, keys in shapes.items()
    }
