"""What supplies and drives of a model name, need, and may not be together; and what a data sheet says of a valve."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from vpm.errors import UnitError, near_match
from vpm.model.drive_parameters import flow_gain_unit
from vpm.model.drives import COMPLIANT, Actuator, DcMotor
from vpm.model.entry import Quantity
from vpm.model.hydraulic import EXAMPLES, SPOOL_DAMPING, Cylinder, Hydraulic, Supply, Valve
from vpm.model.messages import Problem, place
from vpm.model.parameters import Parameter
from vpm.model.sampled import MaxwellNarx
from vpm.model.sampled_check import sampled_problems
from vpm.model.schema import Document
from vpm.model.structure import Structure
from vpm.model.table import Table, table_problems
from vpm.units import convert, parse_unit, require_dimension, si_unit

_RATED: Mapping[str, str] = {"rated_flow": "m^3/s", "rated_drop": "Pa", "rated_current": ""}


def drive_problems(document: Document, structure: Structure) -> Iterator[Problem]:
    """Supplies that are not there, drives on what they cannot drive, sizes that are missing or given twice."""
    for name, supply in document.supplies.items():
        yield from _source_problems(name, supply)
    for name, actuator in document.actuators.items():
        yield from _carrier_problems(name, actuator, structure)
        if isinstance(actuator, Hydraulic):
            yield from _supply_problems(name, actuator, document)
            yield from _alternatives(("actuators", name, "cylinder"), actuator.cylinder)
            yield from _rating_keys(("actuators", name, "valve"), actuator.valve)
            yield from _spool_keys(("actuators", name, "valve"), actuator.valve)
            yield from _late_spool(name, actuator.valve, document)
            yield from _shut_valve(name, actuator)
        if isinstance(actuator, Table):
            yield from table_problems(name, actuator)
    yield from sampled_problems(document, structure)


def _source_problems(name: str, supply: Supply) -> Iterator[Problem]:
    examples = {"resistance": 'resistance = { value = 1, unit = "bar min/l" }', "capacitance": "capacitance = 1e-11"}
    for key, example in examples.items():
        given = getattr(supply, key) is not None
        if supply.source == "sagging" and not given:
            rest = f"is missing; a sagging supply needs it, for example {example}"
            yield Problem(place("supplies", name, key), rest)
        elif supply.source != "sagging" and given:
            rest = f'is given, but a {supply.source} supply has none; remove it, or take source = "sagging"'
            yield Problem(place("supplies", name, key), rest)


def _carrier_problems(name: str, actuator: Actuator, structure: Structure) -> Iterator[Problem]:
    """Drives on a joint or a line that their law does not know."""
    where = place("actuators", name)
    if isinstance(actuator, DcMotor) and actuator.line is not None:
        rest = f'is a dc_motor on the line "{actuator.line}", but a motor turns a joint or a transmission; '
        rest += "give joint or transmission in place of line"
        yield Problem(where, rest)
    if isinstance(actuator, COMPLIANT) and actuator.joint is not None:
        rest = f'is a {actuator.type} on the joint "{actuator.joint}", but its force acts along a line; '
        rest += "give line in place of joint, or take an effect (spring, viscous_friction) of the joint"
        yield Problem(where, rest)
    if isinstance(actuator, (*COMPLIANT, Hydraulic, MaxwellNarx)) and actuator.transmission is not None:
        rest = f'is a {actuator.type} on the transmission "{actuator.transmission}", but its force acts along a line; '
        yield Problem(where, f"{rest}give line in place of transmission, or take an ideal actuator or a dc_motor")
    if isinstance(actuator, Hydraulic) and actuator.joint in structure.joints:
        kind = structure.joint_kind(str(actuator.joint))
        if kind != "prismatic":
            rest = f'is a hydraulic cylinder on the {kind} joint "{actuator.joint}", but a piston moves straight; '
            yield Problem(where, f"{rest}put it on a line, or on a prismatic joint")


def _supply_problems(name: str, actuator: Hydraulic, document: Document) -> Iterator[Problem]:
    if actuator.supply in document.supplies:
        return
    if document.supplies:
        repair = near_match(actuator.supply, document.supplies, what="it has")
    else:
        repair = f"add a table [supplies.{actuator.supply}]"
    where = place("actuators", name, "supply")
    yield Problem(where, f'is "{actuator.supply}", which is no supply of the model; {repair}')


def _alternatives(keys: tuple[str, ...], cylinder: Cylinder) -> Iterator[Problem]:
    """Bore and rod, or area and area ratio: both of a pair, and one pair."""
    pairs = (("bore", "rod"), ("area", "area_ratio"))
    given = [key for pair in pairs for key in pair if getattr(cylinder, key) is not None]
    if not given:
        rest = 'has no size; add bore = { value = 16, unit = "mm" } and rod, or area and area_ratio'
        yield Problem(place(*keys), rest)
    elif given not in [list(pair) for pair in pairs]:
        missing = [pair[1 - pair.index(given[0])] for pair in pairs if len(given) == 1 and given[0] in pair]
        shown = " and ".join([", ".join(given[:-1]), given[-1]] if len(given) > 1 else given)
        repair = f"add {missing[0]}" if missing else "leave bore and rod, or area and area_ratio"
        yield Problem(
            place(*keys), f"is given by {shown}, but a size is bore and rod, or area and area_ratio; {repair}"
        )


def _rating_keys(keys: tuple[str, ...], valve: Valve) -> Iterator[Problem]:
    rated = [key for key in _RATED if getattr(valve, key) is not None]
    missing = [key for key in _RATED if key not in rated]
    if valve.flow_gain is not None and rated:
        rest = f"says with flow_gain how much flows, and with {' and '.join(rated)} as well; remove one"
        yield Problem(place(*keys), rest)
    elif valve.flow_gain is None and not rated:
        rest = "has no gain; add flow_gain, or rated_flow, rated_drop (per edge) and rated_current of a data sheet"
        yield Problem(place(*keys), rest)
    elif valve.flow_gain is None and missing:
        rest = f"is missing; {' and '.join(rated)} alone do not say how much flows"
        yield Problem(place(*keys, missing[0]), rest)


def _spool_keys(keys: tuple[str, ...], valve: Valve) -> Iterator[Problem]:
    """A frequency of what moves, and none of what follows at once."""
    if valve.spool == "second_order" and valve.frequency is None:
        rest = f'is missing; add it, for example {EXAMPLES["actuators.frequency"]}, or take spool = "static"'
        yield Problem(place(*keys, "frequency"), rest)
    for key in ("frequency", "damping"):
        if valve.spool == "static" and getattr(valve, key) is not None:
            rest = 'is given, but a static spool follows at once and has none; remove it, or spool = "static"'
            yield Problem(place(*keys, key), rest)


def _late_spool(name: str, valve: Valve, document: Document) -> Iterator[Problem]:
    slower = [e.type for e in document.effects if e.traits.late == "spool" and e.at == name]
    if valve.spool == "static" and slower:
        rest = f"is static, but the effect {slower[0]} makes it slower; remove one of them"
        yield Problem(place("actuators", name, "valve", "spool"), rest)


def _shut_valve(name: str, actuator: Hydraulic) -> Iterator[Problem]:
    """Pressures without states balance flows, and a valve that shuts has none."""
    if actuator.cylinder.pressures == "quasi_static" and actuator.valve.clearance is None:
        rest = 'is missing; with pressures = "quasi_static" a valve that shuts would lock the piston in its middle; '
        rest += f"add it, for example {EXAMPLES['actuators.clearance']}"
        yield Problem(place("actuators", name, "valve", "clearance"), rest)


def unit_problems(document: Document) -> Iterator[Problem]:
    """Commands of the wrong kind, and numbers of a data sheet that cannot be right."""
    for name, actuator in document.actuators.items():
        wanted = "V" if isinstance(actuator, DcMotor) else "m" if isinstance(actuator, COMPLIANT) else None
        if wanted is not None:
            try:
                require_dimension(actuator.command_unit, wanted)
            except UnitError as error:
                yield Problem(place("actuators", name, "command_unit"), f"is wrong: {error}")
        if isinstance(actuator, Hydraulic):
            keys = ("actuators", name, "valve")
            yield from _rated_problems(keys, actuator.valve, si_unit(actuator.command_unit))
            if actuator.valve.frequency is not None:
                yield from _turns_problems((*keys, "frequency"), actuator.valve.frequency)


def _rated_problems(keys: tuple[str, ...], valve: Valve, command: str) -> Iterator[Problem]:
    for key, unit in _RATED.items():
        quantity: Quantity | None = getattr(valve, key)
        if quantity is None:
            continue
        where = place(*keys, key)
        try:
            require_dimension(quantity.unit or unit or command, unit or command)
        except UnitError as error:
            yield Problem(where, f"has a wrong unit: {error}")
            continue
        if not quantity.value > 0.0:
            shown = f"{quantity.value:g} {quantity.unit or unit or command}"
            yield Problem(where, f"is {shown}, but only more than 0 is physically possible; correct the value")
        elif key != "rated_flow" and (quantity.uncertainty, quantity.minimum, quantity.maximum) != (None,) * 3:
            yield Problem(
                where, "has an uncertainty or bounds, but those of the gain follow from rated_flow; remove them"
            )


def _turns_problems(keys: tuple[str, ...], frequency: Quantity) -> Iterator[Problem]:
    """Hz is 1/s: a data sheet's 250 Hz would be read as 250 rad/s."""
    try:
        hertz = frequency.unit is not None and "Hz" in dict(parse_unit(frequency.unit).si_terms)
    except UnitError:
        return  # said with the other units
    if hertz:
        given = convert(frequency.value, str(frequency.unit), "Hz")
        rest = f"is in {frequency.unit}, which would be taken as rad/s; write {given:g} rev/s"
        yield Problem(place(*keys), f'{rest}, {{ value = {given:g}, unit = "rev/s" }}')


def complete_drives(document: Document) -> Document:
    """Give every valve its gain, for which the rated flow of a data sheet stands, and every moving spool its damping.

    The gain is ``rated_flow / (current sqrt(drop))``.
    """
    actuators = dict(document.actuators)
    for name, actuator in document.actuators.items():
        if not isinstance(actuator, Hydraulic):
            continue
        valve = actuator.valve
        if valve.flow_gain is None:
            valve = _rated(valve, si_unit(actuator.command_unit))
        if valve.spool == "second_order" and valve.damping is None:
            valve = valve.model_copy(update={"damping": Quantity(value=SPOOL_DAMPING)})
        actuators[name] = actuator.model_copy(update={"valve": valve})
    return document.model_copy(update={"actuators": actuators})


def _rated(valve: Valve, command: str) -> Valve:
    flow, drop, current = valve.rated_flow, valve.rated_drop, valve.rated_current
    if flow is None or drop is None or current is None:
        return valve
    opening = convert(current.value, current.unit or command, command)
    factor = convert(1.0, flow.unit or "m^3/s", "m^3/s")
    factor /= opening * math.sqrt(convert(drop.value, drop.unit or "Pa", "Pa"))

    def scaled(number: float | None) -> float | None:
        return None if number is None else number * factor

    gain = Quantity(
        value=flow.value * factor,
        unit=flow_gain_unit(command),
        uncertainty=scaled(flow.uncertainty),
        minimum=scaled(flow.minimum),
        maximum=scaled(flow.maximum),
    )
    return valve.model_copy(update={"flow_gain": gain, **dict.fromkeys(_RATED)})


def value_problems(document: Document, parameters: Mapping[str, Parameter]) -> Iterator[Problem]:
    """Pairs of values that contradict each other: rods thicker than their bores, pumps below their tanks."""

    def value(name: str) -> float:
        return parameters[name].value

    for name in document.supplies:
        pump, tank = value(f"{name}.pressure"), value(f"{name}.tank_pressure")
        vapour = value(f"{name}.oil.vapour_pressure")
        if not pump > tank:
            rest = f"is {pump:g} Pa, but has to be above the pressure of the tank, {tank:g} Pa; correct one of them"
            yield Problem(place("supplies", name, "pressure"), rest)
        elif not tank > vapour:
            rest = f"is {tank:g} Pa, but the oil boils at {vapour:g} Pa and would in the tank; correct one of them"
            yield Problem(place("supplies", name, "tank_pressure"), rest)
    for name, actuator in document.actuators.items():
        if not isinstance(actuator, Hydraulic):
            continue
        if actuator.cylinder.bore is not None:
            bore, rod = value(f"{name}.cylinder.bore"), value(f"{name}.cylinder.rod")
            if not rod < bore:
                rest = f"is {rod:g} m, but has to be thinner than the bore, {bore:g} m; correct one of them"
                yield Problem(place("actuators", name, "cylinder", "rod"), rest)
        clearance = f"{name}.valve.clearance"
        if clearance in parameters and not value(clearance) < value(f"{name}.valve.stroke"):
            unit, shown = parameters[clearance].unit, (value(clearance), value(f"{name}.valve.stroke"))
            rest = (
                f"is {shown[0]:g} {unit}, but the spool moves by {shown[1]:g} {unit} only, so that it would never shut"
            )
            yield Problem(place("actuators", name, "valve", "clearance"), f"{rest}; correct one of them")
        overlap, stroke = value(f"{name}.valve.overlap"), value(f"{name}.valve.stroke")
        if not overlap < stroke:
            unit = parameters[f"{name}.valve.stroke"].unit
            rest = f"is {overlap:g} {unit}, but the spool moves by {stroke:g} {unit} only, so it never opens"
            yield Problem(place("actuators", name, "valve", "overlap"), f"{rest}; correct one of them")
