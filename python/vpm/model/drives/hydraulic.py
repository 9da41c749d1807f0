"""Servo-cylinders: valve, cylinder and seals. Their laws are in docs/hydraulics.md."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, Self

from vpm.errors import UnitError, near_match
from vpm.model.component import Described, Index
from vpm.model.drives.drive import LENGTH, Drive, group, numbers
from vpm.model.entry import ZERO, Entry, ParameterValue, Quantity, Text
from vpm.model.messages import Problem, place
from vpm.model.parameters import (
    ABOVE_ZERO,
    ANY,
    FEEDING,
    NOT_NEGATIVE,
    PUSHING,
    SHARE,
    TINY,
    Keys,
    Parameter,
    Rule,
    Slot,
)
from vpm.units import convert, parse_unit, require_dimension, si_unit

if TYPE_CHECKING:
    from vpm.model.schema import Document
    from vpm.model.structure import Structure

#: Damping ratio of a spool, where none is given.
SPOOL_DAMPING = 0.7
#: States of the oil in a cylinder by how its pressures come about.
_OIL: Mapping[str, tuple[str, ...]] = {"chambers": ("chamber_a", "chamber_b"), "load": ("load",), "quasi_static": ()}
#: Numbers of a data sheet that stand for the gain of a valve, with their units; "" is that of the command.
_RATED: Mapping[str, str] = {"rated_flow": "m^3/s", "rated_drop": "Pa", "rated_current": ""}

_UPHILL = "negative leakage would mean oil that flows against the pressure"
_SIZE = "a size of zero or less is no size"
_STIFF = "a chamber without oil at the end of the stroke would be infinitely stiff"


class Valve(Entry):
    """Servovalve: a spool, of second order or following at once, and four edges; spool in the command's unit.

    The gain of the edges is given as such, or by the rated flow of a data sheet.
    """

    flow_gain: Annotated[ParameterValue | None, Rule("", TINY, "oil would not flow, or against the pressure")] = None
    rated_flow: ParameterValue | None = None
    rated_drop: ParameterValue | None = None
    rated_current: ParameterValue | None = None
    spool: Literal["second_order", "static"] = "second_order"
    frequency: Annotated[
        ParameterValue | None, Rule("rad/s", ABOVE_ZERO, "a spool without a frequency would not follow its command")
    ] = None
    damping: Annotated[ParameterValue | None, Rule("1", NOT_NEGATIVE, FEEDING)] = None
    stroke: Annotated[ParameterValue, Rule("", TINY, "a spool without a way opens nothing")]
    overlap: Annotated[
        ParameterValue, Rule("", NOT_NEGATIVE, "a valve that is open in the middle is not described by an overlap")
    ] = ZERO
    clearance: Annotated[
        ParameterValue | None, Rule("", TINY, "edges that shut quite are those of a valve without the key")
    ] = None
    gain: Annotated[ParameterValue, Rule("1", ANY, "")] = Quantity(value=1.0)
    transition_pressure: Annotated[
        ParameterValue, Rule("Pa", TINY, "1e4 Pa is usual; the slope of the flow would be infinite at zero")
    ] = Quantity(value=1e4)

    def problems(self, keys: Keys) -> Iterator[Problem]:
        """Problems of a hydraulic valve: gain missing or given twice, frequency without a moving spool."""
        rated = [key for key in _RATED if getattr(self, key) is not None]
        missing = [key for key in _RATED if key not in rated]
        if self.flow_gain is not None and rated:
            rest = f"says with flow_gain how much flows, and with {' and '.join(rated)} as well; remove one"
            yield Problem(place(*keys), rest)
        elif self.flow_gain is None and not rated:
            rest = "has no gain; add flow_gain, or rated_flow, rated_drop (per edge) and rated_current of a data sheet"
            yield Problem(place(*keys), rest)
        elif self.flow_gain is None and missing:
            rest = f"is missing; {' and '.join(rated)} alone do not say how much flows"
            yield Problem(place(*keys, missing[0]), rest)
        if self.spool == "second_order" and self.frequency is None:
            rest = f'is missing; add it, for example {Hydraulic.EXAMPLES["frequency"]}, or take spool = "static"'
            yield Problem(place(*keys, "frequency"), rest)
        for key in ("frequency", "damping"):
            if self.spool == "static" and getattr(self, key) is not None:
                rest = 'is given, but a static spool follows at once and has none; remove it, or spool = "static"'
                yield Problem(place(*keys, key), rest)

    def unit_problems(self, keys: Keys, command: str) -> Iterator[Problem]:
        """Impossible data-sheet numbers of a hydraulic valve; ``command`` is the command's SI unit."""
        for key, of_key in _RATED.items():
            quantity: Quantity | None = getattr(self, key)
            if quantity is None:
                continue
            where, unit = place(*keys, key), of_key or command
            try:
                require_dimension(quantity.unit or unit, unit)
            except UnitError as error:
                yield Problem(where, f"has a wrong unit: {error}")
                continue
            if not quantity.value > 0.0:
                shown = f"{quantity.value:g} {quantity.unit or unit}"
                yield Problem(where, f"is {shown}, but only more than 0 is physically possible; correct the value")
            elif key != "rated_flow" and (quantity.uncertainty, quantity.minimum, quantity.maximum) != (None,) * 3:
                yield Problem(
                    where, "has an uncertainty or bounds, but those of the gain follow from rated_flow; remove them"
                )
        if self.frequency is not None:
            yield from _turns_problems((*keys, "frequency"), self.frequency)

    def complete(self, command: str) -> Valve:
        """Hydraulic valve with gain and damping; rated flow gives ``rated_flow / (current sqrt(drop))``.

        A spool that moves has a damping; ``command`` is the SI unit of the command.
        """
        found: dict[str, Quantity | None] = {}
        flow, drop, current = self.rated_flow, self.rated_drop, self.rated_current
        if self.flow_gain is None and flow is not None and drop is not None and current is not None:
            opening = convert(current.value, current.unit or command, command)
            factor = convert(1.0, flow.unit or "m^3/s", "m^3/s")
            factor /= opening * math.sqrt(convert(drop.value, drop.unit or "Pa", "Pa"))
            found = {
                "flow_gain": flow.mapped(lambda number: number * factor, flow_gain_unit(command)),
                **dict.fromkeys(_RATED),
            }
        if self.spool == "second_order" and self.damping is None:
            found["damping"] = Quantity(value=SPOOL_DAMPING)
        return self.model_copy(update=found)


class Cylinder(Entry):
    """Cylinder with a rod on one side; its size is two diameters, or an area and the share of it on the rod's side."""

    bore: Annotated[ParameterValue | None, Rule("m", TINY, _SIZE)] = None
    rod: Annotated[ParameterValue | None, Rule("m", TINY, _SIZE)] = None
    area: Annotated[ParameterValue | None, Rule("m^2", TINY, _SIZE)] = None
    area_ratio: Annotated[
        ParameterValue | None,
        Rule("1", SHARE, "the rod takes its own section off the area of its side, so that is the smaller one"),
    ] = None
    stroke: Annotated[ParameterValue, Rule("m", TINY, "a piston without a way cannot move")]
    line_a: Annotated[ParameterValue, Rule("m^3", TINY, _STIFF)]
    line_b: Annotated[ParameterValue, Rule("m^3", TINY, _STIFF)]
    internal_leakage: Annotated[ParameterValue, Rule("m^3/(s Pa)", NOT_NEGATIVE, _UPHILL)] = ZERO
    external_leakage: Annotated[ParameterValue, Rule("m^3/(s Pa)", NOT_NEGATIVE, _UPHILL)] = ZERO
    stop_stiffness: Annotated[ParameterValue, Rule("N/m", TINY, "an end that does not push back is none")] = Quantity(
        value=5e8
    )
    stop_damping: Annotated[ParameterValue, Rule("N s/m", NOT_NEGATIVE, FEEDING)] = Quantity(value=2e4)
    pressures: Literal["chambers", "load", "quasi_static"] = "chambers"

    def problems(self, keys: Keys) -> Iterator[Problem]:
        """Problems of a hydraulic cylinder: it needs bore and rod, or area and area ratio."""
        pairs = (("bore", "rod"), ("area", "area_ratio"))
        given = [key for pair in pairs for key in pair if getattr(self, key) is not None]
        if not given:
            rest = 'has no size; add bore = { value = 16, unit = "mm" } and rod, or area and area_ratio'
            yield Problem(place(*keys), rest)
        elif given not in [list(pair) for pair in pairs]:
            missing = [pair[1 - pair.index(given[0])] for pair in pairs if len(given) == 1 and given[0] in pair]
            shown = " and ".join([", ".join(given[:-1]), given[-1]] if len(given) > 1 else given)
            repair = f"add {missing[0]}" if missing else "leave bore and rod, or area and area_ratio"
            rest = f"is given by {shown}, but a size is bore and rod, or area and area_ratio; {repair}"
            yield Problem(place(*keys), rest)


class SealFriction(Entry):
    """Friction of the seals; each law acts if its size is given, and the velocities shape those."""

    viscous: Annotated[ParameterValue | None, Rule("N s/m", NOT_NEGATIVE, PUSHING)] = None
    coulomb: Annotated[ParameterValue | None, Rule("N", NOT_NEGATIVE, PUSHING)] = None
    stribeck: Annotated[ParameterValue | None, Rule("N", NOT_NEGATIVE, PUSHING)] = None
    stribeck_velocity: Annotated[
        ParameterValue, Rule("m/s", ABOVE_ZERO, "the extra friction fades over a velocity")
    ] = Quantity(value=0.01)
    transition_velocity: Annotated[
        ParameterValue, Rule("m/s", ABOVE_ZERO, "friction changes its direction over a velocity")
    ] = Quantity(value=0.001)

    @property
    def idle(self) -> set[str]:
        """Velocities of hydraulic seals that shape no law; they are no parameters."""
        if self.stribeck is not None:
            return set()
        return {"stribeck_velocity"} if self.coulomb is not None else {"stribeck_velocity", "transition_velocity"}


class Hydraulic(Drive):
    """Servo-cylinder on a line or a prismatic joint; the command drives the spool of its valve."""

    EXAMPLES: ClassVar[Mapping[str, str]] = {
        "supply": 'supply = "pump"',
        "retracted_length": 'retracted_length = { value = 281, unit = "mm" }',
        "valve": 'valve = { flow_gain = 6.7e-6, frequency = { value = 250, unit = "rev/s" }, stroke = 0.01 }',
        "frequency": 'frequency = { value = 250, unit = "rev/s" }',
        "clearance": 'clearance = { value = 0.2, unit = "mA" }',
        "cylinder": "cylinder = { bore = 0.016, rod = 0.01, stroke = 0.08, line_a = 2.9e-6, line_b = 2.9e-6 }",
        "stroke": 'stroke = { value = 80, unit = "mm" }',
        "line_a": 'line_a = { value = 2.9, unit = "cm^3" }',
        "line_b": 'line_b = { value = 1.7, unit = "cm^3" }',
    }
    #: "" is the unit of the command.
    CHANNELS: ClassVar[Mapping[str, str]] = {
        "spool": "",
        **dict.fromkeys(("pressure_a", "pressure_b"), "Pa"),
        **dict.fromkeys(("flow_a", "flow_b"), "m^3/s"),
    }
    STRAIGHT: ClassVar[bool] = True

    type: Literal["hydraulic"]
    supply: Text
    retracted_length: Annotated[ParameterValue, Rule("m", NOT_NEGATIVE, LENGTH)]
    command_unit: Text = "A"
    valve: Valve
    cylinder: Cylinder
    friction: SealFriction | None = None

    # ---- checks ------------------------------------------------------------------------------------------------------

    def carrier_problems(self, name: str, structure: Structure) -> Iterator[Problem]:
        """Problem of a hydraulic drive on a transmission, or on a joint that does not move straight."""
        yield from super().carrier_problems(name, structure)
        if self.joint in structure.joints:
            kind = structure.joint_kind(str(self.joint))
            if kind != "prismatic":
                rest = f'is a hydraulic cylinder on the {kind} joint "{self.joint}", but a piston moves straight; '
                yield Problem(place("actuators", name), f"{rest}put it on a line, or on a prismatic joint")

    def problems(self, name: str, structure: Structure) -> Iterator[Problem]:
        """Problems of a hydraulic drive: no supply, sizes missing or given twice, inconsistent states."""
        document, keys = structure.document, ("actuators", name)
        if self.supply not in document.supplies:
            known = document.supplies
            repair = near_match(self.supply, known, what="it has") if known else f"add a table [supplies.{self.supply}]"
            rest = f'is "{self.supply}", which is no supply of the model; {repair}'
            yield Problem(place(*keys, "supply"), rest)
        yield from self.cylinder.problems((*keys, "cylinder"))
        yield from self.valve.problems((*keys, "valve"))
        yield from self._static_problems(name, document)

    def _static_problems(self, name: str, document: Document) -> Iterator[Problem]:
        """Problems of a quasi-static hydraulic drive: effects that slow it down, valves that shut."""
        slower = [e.type for e in document.effects if e.traits.late == "spool" and e.at == name]
        if self.valve.spool == "static" and slower:
            rest = f"is static, but the effect {slower[0]} makes it slower; remove one of them"
            yield Problem(place("actuators", name, "valve", "spool"), rest)
        if self.cylinder.pressures == "quasi_static" and self.valve.clearance is None:
            rest = (
                'is missing; with pressures = "quasi_static" a valve that shuts would lock the piston in its middle; '
            )
            rest += f"add it, for example {self.EXAMPLES['clearance']}"
            yield Problem(place("actuators", name, "valve", "clearance"), rest)

    def unit_problems(self, name: str) -> Iterator[Problem]:
        """Impossible data-sheet numbers of a hydraulic drive's valve."""
        yield from self.valve.unit_problems(("actuators", name, "valve"), si_unit(self.command_unit))

    def complete(self) -> Self:
        """Hydraulic drive with the values that its valve need not give."""
        return self.model_copy(update={"valve": self.valve.complete(si_unit(self.command_unit))})

    def value_problems(self, name: str, parameters: Mapping[str, Parameter]) -> Iterator[Problem]:
        """Problems of hydraulic values: rods thicker than bores, edges that never shut or never open."""

        def value(key: str) -> float:
            return parameters[f"{name}.{key}"].value

        if self.cylinder.bore is not None:
            bore, rod = value("cylinder.bore"), value("cylinder.rod")
            if not rod < bore:
                rest = f"is {rod:g} m, but has to be thinner than the bore, {bore:g} m; correct one of them"
                yield Problem(place("actuators", name, "cylinder", "rod"), rest)
        stroke, unit = value("valve.stroke"), parameters[f"{name}.valve.stroke"].unit
        never = {"clearance": "only, so that it would never shut", "overlap": "only, so it never opens"}
        for key, rest in never.items():
            if f"{name}.valve.{key}" in parameters and not value(f"valve.{key}") < stroke:
                shown = f"is {value(f'valve.{key}'):g} {unit}, but the spool moves by {stroke:g} {unit}"
                yield Problem(place("actuators", name, "valve", key), f"{shown} {rest}; correct one of them")

    # ---- what the model and the core are told ------------------------------------------------------------------------

    def units(self, name: str, structure: Structure) -> Mapping[str, str]:  # noqa: ARG002
        """SI units of a hydraulic drive that depend on that of the command."""
        command = si_unit(self.command_unit)
        return {**dict.fromkeys(("stroke", "overlap", "clearance"), command), "flow_gain": flow_gain_unit(command)}

    def slots(self, keys: Keys, structure: Structure) -> Iterator[Slot]:
        """Parameters of a hydraulic drive; the gain of its valve is known."""
        idle = set() if self.friction is None else self.friction.idle
        for slot in super().slots(keys, structure):
            if slot.keys[-1] == "retracted_length" and self.line is None:
                yield replace(slot, physical=ANY)
            elif slot.keys[-1] not in idle:
                yield slot

    @property
    def states(self) -> Mapping[str, str]:
        """States of a hydraulic drive with their SI units."""
        spool = {"spool": "", "spool_rate": "/s"} if self.valve.spool == "second_order" else {}
        return {**spool, **dict.fromkeys(_OIL[self.cylinder.pressures], "Pa")}

    def law(self, name: str, structure: Structure, index: Index) -> Described:
        """What the core reads of the law of a hydraulic drive."""
        valve, size = f"{name}.valve", ("area", "area_ratio") if self.cylinder.bore is None else ("bore", "rod")
        cleared = {} if self.valve.clearance is None else numbers(valve, ("clearance",), index)
        pressures = {} if self.cylinder.pressures == "chambers" else {"pressures": self.cylinder.pressures}
        seals = {
            "viscous": ("viscous",),
            "coulomb": ("coulomb", "transition_velocity"),
            "stribeck": ("stribeck", "stribeck_velocity", "transition_velocity"),
        }
        cylinder = ("stroke", "line_a", "line_b", "internal_leakage", "external_leakage")
        return {
            "supply": tuple(structure.document.supplies).index(self.supply),
            "retracted_length": index[f"{name}.retracted_length"],
            "valve": {
                **numbers(valve, ("gain", "stroke", "overlap", "frequency", "damping"), index),
                "orifice": {"gain": index[f"{valve}.flow_gain"], **numbers(valve, ("transition_pressure",), index)},
                "delay": index.get(f"{name}.valve_dynamics.time"),
                **cleared,
            },
            "cylinder": {
                "size": numbers(f"{name}.cylinder", size, index),
                **numbers(f"{name}.cylinder", cylinder, index),
                "worn_leakage": index.get(f"{name}.internal_leakage.coefficient"),
                "stop": {key: index[f"{name}.cylinder.stop_{key}"] for key in ("stiffness", "damping")},
                "seal": {
                    **{law: group(f"{name}.friction", keys, index) for law, keys in seals.items()},
                    "pressed": group(f"{name}.seal_friction", ("share", "transition_velocity"), index),
                },
            },
            **pressures,
        }


def flow_gain_unit(command: str) -> str:
    """SI unit of a hydraulic valve's gain, whose command has the SI unit ``command``."""
    return si_unit(f"m^3/(s ({command}) Pa^0.5)")


def _turns_problems(keys: Keys, frequency: Quantity) -> Iterator[Problem]:
    """Problem of a hydraulic valve's frequency in Hz: 250 Hz would be read as 250 rad/s."""
    try:
        hertz = frequency.unit is not None and "Hz" in dict(parse_unit(frequency.unit).si_terms)
    except UnitError:
        return  # said with the other units
    if hertz:
        given = convert(frequency.value, str(frequency.unit), "Hz")
        rest = f"is in {frequency.unit}, which would be taken as rad/s; write {given:g} rev/s"
        yield Problem(place(*keys), f'{rest}, {{ value = {given:g}, unit = "rev/s" }}')
