"""The parameters of supplies and actuators: names, SI units, physical ranges, and what a value outside would mean."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Literal, NamedTuple

from vpm.catalogue import POSITIVE, JointKind
from vpm.model.drives import Actuator, DcMotor, Ideal, Maxwell, SpringDamper
from vpm.model.entry import Entry, Quantity
from vpm.model.hydraulic import Hydraulic, Supply
from vpm.model.sampled import MaxwellNarx, Narx
from vpm.model.table import Table
from vpm.units import si_unit

Range = tuple[float, float]

ANY: Range = (-math.inf, math.inf)
NOT_NEGATIVE: Range = (0.0, math.inf)
#: Above zero, for gains, leakages and volumes too, which are far below 1 in SI.
ABOVE_ZERO: Range = (1e-30, math.inf)
#: Above zero, for times and velocities, in which a law has to stay finite.
MEASURABLE: Range = (POSITIVE, math.inf)
SHARE: Range = (1e-30, 1.0)
#: Air at one bar, compressed slowly, has the bulk modulus 1e5 Pa; no oil is softer.
BULK_MODULUS: Range = (1e5, math.inf)

_ABSOLUTE = "pressures are absolute: an open tank has 101325 Pa"
_FEEDING = "negative damping would feed energy into the motion"
_PUSHING = "negative friction would push along the motion and feed energy into it"
_UPHILL = "negative leakage would mean oil that flows against the pressure"
_BACKWARD = "a spring with negative stiffness would push away from its free length"
_LENGTH = "a length cannot be negative"
_SIZE = "a size of zero or less is no size"


class Row(NamedTuple):
    """One parameter of a component: keys below the component, which joined by dots end its dotted name."""

    keys: tuple[str, ...]
    quantity: Quantity
    unit: str
    bounds: Range
    impossible: str
    kind: Literal["linear", "shape"] = "shape"


_Rule = tuple[str, Range, str]
_Rules = Mapping[str, _Rule]

_SUPPLY: _Rules = {
    "pressure": ("Pa", ABOVE_ZERO, _ABSOLUTE),
    "tank_pressure": ("Pa", ABOVE_ZERO, _ABSOLUTE),
    "resistance": ("Pa s/m^3", ABOVE_ZERO, "a supply without resistance does not sag; take source = constant"),
    "capacitance": ("m^3/Pa", ABOVE_ZERO, "a pressure needs a volume that stores it"),
}
_OIL: _Rules = {
    "bulk_modulus": ("Pa", BULK_MODULUS, "less would be oil softer than air at one bar"),
    "vapour_pressure": ("Pa", ABOVE_ZERO, "pressures are absolute, and no liquid boils at zero"),
}
_AIR: _Rules = {
    "fraction": ("1", (0.0, 1.0), "a negative share of air is none, and above 1 there would be more air than oil"),
    "exponent": ("1", (1.0, math.inf), "1 is air that keeps its temperature, 1.4 air that keeps its heat"),
    "reference_pressure": ("Pa", ABOVE_ZERO, _ABSOLUTE),
}
_DC_MOTOR: _Rules = {
    "resistance": ("Ohm", ABOVE_ZERO, "without resistance a voltage would drive a current without bound"),
    "time_constant": ("s", MEASURABLE, "a current that runs ahead of its voltage does not exist"),
    "torque_constant": ("N m/A", ABOVE_ZERO, "a motor that turns the other way has a negative gear_ratio"),
    "back_emf": ("V s/rad", NOT_NEGATIVE, "a negative back-EMF would speed the motor up without end"),
    "efficiency": ("1", SHARE, "a gear gives no more than it takes, and one that gives nothing is none"),
    "rotor_inertia": ("kg m^2", NOT_NEGATIVE, "an inertia cannot be negative"),
}
_SPRING_DAMPER: _Rules = {
    "stiffness": ("N/m", NOT_NEGATIVE, _BACKWARD),
    "free_length": ("m", NOT_NEGATIVE, _LENGTH),
    "damping": ("N s/m", NOT_NEGATIVE, _FEEDING),
}
_MAXWELL: _Rules = {
    "stiffness": ("N/m", NOT_NEGATIVE, _BACKWARD),
    "free_length": ("m", NOT_NEGATIVE, _LENGTH),
    "fast_stiffness": ("N/m", NOT_NEGATIVE, "fast motion would meet less than the stiffness at rest"),
    "relaxation_time": ("s", MEASURABLE, "a force that relaxes in no time is none"),
}
_CYLINDER: _Rules = {
    "bore": ("m", ABOVE_ZERO, _SIZE),
    "rod": ("m", ABOVE_ZERO, _SIZE),
    "area": ("m^2", ABOVE_ZERO, _SIZE),
    "area_ratio": ("1", SHARE, "the rod takes its own section off the area of its side, so that is the smaller one"),
    "stroke": ("m", ABOVE_ZERO, "a piston without a way cannot move"),
    "line_a": ("m^3", ABOVE_ZERO, "a chamber without oil at the end of the stroke would be infinitely stiff"),
    "line_b": ("m^3", ABOVE_ZERO, "a chamber without oil at the end of the stroke would be infinitely stiff"),
    "internal_leakage": ("m^3/(s Pa)", NOT_NEGATIVE, _UPHILL),
    "external_leakage": ("m^3/(s Pa)", NOT_NEGATIVE, _UPHILL),
    "stop_stiffness": ("N/m", ABOVE_ZERO, "an end that does not push back is none"),
    "stop_damping": ("N s/m", NOT_NEGATIVE, _FEEDING),
}
_FRICTION: _Rules = {
    "viscous": ("N s/m", NOT_NEGATIVE, _PUSHING),
    "coulomb": ("N", NOT_NEGATIVE, _PUSHING),
    "stribeck": ("N", NOT_NEGATIVE, _PUSHING),
    "stribeck_velocity": ("m/s", MEASURABLE, "the extra friction fades over a velocity"),
    "transition_velocity": ("m/s", MEASURABLE, "friction changes its direction over a velocity"),
}


def _valve(command: str) -> _Rules:
    return {
        "flow_gain": (flow_gain_unit(command), ABOVE_ZERO, "oil would not flow, or against the pressure"),
        "frequency": ("rad/s", MEASURABLE, "a spool without a frequency would not follow its command"),
        "damping": ("1", NOT_NEGATIVE, _FEEDING),
        "stroke": (command, ABOVE_ZERO, "a spool without a way opens nothing"),
        "overlap": (command, NOT_NEGATIVE, "a valve that is open in the middle is not described by an overlap"),
        "clearance": (command, ABOVE_ZERO, "edges that shut quite are those of a valve without the key"),
        "gain": ("1", ANY, ""),
        "transition_pressure": ("Pa", ABOVE_ZERO, "1e4 Pa is usual; the slope of the flow would be infinite at zero"),
    }


def flow_gain_unit(command: str) -> str:
    """SI unit of the gain of a valve whose command has the SI unit ``command``."""
    return si_unit(f"m^3/(s ({command}) Pa^0.5)")


def supply_rows(supply: Supply) -> Iterator[Row]:
    """Parameters of a supply."""
    yield from _rows((), supply, _SUPPLY)
    yield from _rows(("oil",), supply.oil, _OIL)
    if supply.oil.air is not None:
        yield from _rows(("oil", "air"), supply.oil.air, _AIR)


def actuator_rows(actuator: Actuator, effort: str, kind: JointKind | None) -> Iterator[Row]:
    """Parameters of an actuator.

    Parameters
    ----------
    actuator : Actuator
        Of a hydraulic one the gain of the valve is known.
    effort : str
        SI unit of its effort.
    kind : {"prismatic", "revolute", "helical"} or None
        Of its joint; None on a line.
    """
    command = si_unit(actuator.command_unit)
    match actuator:
        case Ideal():
            gain = si_unit(f"{effort}/({actuator.command_unit})")
            yield Row(("gain",), actuator.gain, gain, ANY, "", "linear")
            if actuator.limit is not None:
                never = "a limit of zero or less would mean that the drive never acts"
                yield Row(("limit",), actuator.limit, effort, ABOVE_ZERO, never)
        case DcMotor():
            turning = kind != "prismatic"
            moving = {
                "gear_ratio": ("1" if turning else "rad/m", ANY, ""),
                "transition_velocity": ("rad/s" if turning else "m/s", MEASURABLE, "the loss turns over a velocity"),
            }
            yield from _rows((), actuator, {**_DC_MOTOR, **moving})
        case SpringDamper():
            yield from _rows((), actuator, _SPRING_DAMPER)
        case Maxwell():
            yield from _rows((), actuator, _MAXWELL)
        case Hydraulic():
            yield from _hydraulic_rows(actuator, command)
        case Table() | Narx() | MaxwellNarx():
            return  # their numbers belong together, so that none is a parameter of its own


def _hydraulic_rows(actuator: Hydraulic, command: str) -> Iterator[Row]:
    place = ANY if actuator.line is None else NOT_NEGATIVE
    yield Row(("retracted_length",), actuator.retracted_length, "m", place, _LENGTH)
    yield from _rows(("valve",), actuator.valve, _valve(command))
    yield from _rows(("cylinder",), actuator.cylinder, _CYLINDER)
    friction = actuator.friction
    if friction is None:
        return
    # A velocity without a law that it shapes would be a parameter that nothing depends on.
    idle = {"stribeck_velocity"} if friction.stribeck is None else set()
    idle |= {"transition_velocity"} if friction.stribeck is None and friction.coulomb is None else set()
    yield from _rows(("friction",), friction, {key: rule for key, rule in _FRICTION.items() if key not in idle})


def _rows(keys: tuple[str, ...], entry: Entry, rules: _Rules) -> Iterator[Row]:
    """Rows of what is given of a table, in the order of its rules."""
    for key, (unit, bounds, impossible) in rules.items():
        quantity = getattr(entry, key)
        if quantity is not None:
            yield Row((*keys, key), quantity, unit, bounds, impossible)
