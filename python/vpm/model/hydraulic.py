"""Form of hydraulic supplies and drives in a model file: oil, servovalve, cylinder, seals.

Their laws are in docs/hydraulics.md.
"""

from __future__ import annotations

from typing import Literal

from vpm.model.entry import ZERO, Entry, ParameterValue, Quantity, Text

#: Standard atmosphere, Pa (NIST SP 811, appendix B).
ATMOSPHERE = 101325.0
#: Damping ratio of a spool, where none is given.
SPOOL_DAMPING = 0.7
#: Adiabatic exponent of air.
ADIABATIC = 1.4


class Air(Entry):
    """Bubbles in oil: volume of air per volume of oil at a pressure, and the polytropic exponent of its compression."""

    fraction: ParameterValue
    exponent: ParameterValue = Quantity(value=ADIABATIC)
    reference_pressure: ParameterValue = Quantity(value=ATMOSPHERE)


class Oil(Entry):
    """What the pressures act through."""

    bulk_modulus: ParameterValue
    vapour_pressure: ParameterValue = Quantity(value=2000.0)
    air: Air | None = None


class Supply(Entry):
    """Pump and tank: two pressures, constant, from the log, or sagging behind a resistance under the drawn flow."""

    pressure: ParameterValue
    tank_pressure: ParameterValue
    source: Literal["constant", "logged", "sagging"] = "constant"
    resistance: ParameterValue | None = None
    capacitance: ParameterValue | None = None
    oil: Oil


class Valve(Entry):
    """Servovalve: a spool, of second order or following at once, and four edges; spool in the command's unit.

    The gain of the edges is given as such, or by the rated flow of a data sheet.
    """

    flow_gain: ParameterValue | None = None
    rated_flow: ParameterValue | None = None
    rated_drop: ParameterValue | None = None
    rated_current: ParameterValue | None = None
    spool: Literal["second_order", "static"] = "second_order"
    frequency: ParameterValue | None = None
    damping: ParameterValue | None = None
    stroke: ParameterValue
    overlap: ParameterValue = ZERO
    clearance: ParameterValue | None = None
    gain: ParameterValue = Quantity(value=1.0)
    transition_pressure: ParameterValue = Quantity(value=1e4)


class Cylinder(Entry):
    """Cylinder with a rod on one side; its size is two diameters, or an area and the share of it on the rod's side."""

    bore: ParameterValue | None = None
    rod: ParameterValue | None = None
    area: ParameterValue | None = None
    area_ratio: ParameterValue | None = None
    stroke: ParameterValue
    line_a: ParameterValue
    line_b: ParameterValue
    internal_leakage: ParameterValue = ZERO
    external_leakage: ParameterValue = ZERO
    stop_stiffness: ParameterValue = Quantity(value=5e8)
    stop_damping: ParameterValue = Quantity(value=2e4)
    pressures: Literal["chambers", "load", "quasi_static"] = "chambers"


class SealFriction(Entry):
    """Friction of the seals; each law acts if its size is given, and the velocities shape those."""

    viscous: ParameterValue | None = None
    coulomb: ParameterValue | None = None
    stribeck: ParameterValue | None = None
    stribeck_velocity: ParameterValue = Quantity(value=0.01)
    transition_velocity: ParameterValue = Quantity(value=0.001)


class Hydraulic(Entry):
    """Servo-cylinder on a line or a prismatic joint; the command drives the spool of its valve."""

    type: Literal["hydraulic"]
    joint: Text | None = None
    line: Text | None = None
    transmission: Text | None = None
    supply: Text
    retracted_length: ParameterValue
    command_unit: Text = "A"
    valve: Valve
    cylinder: Cylinder
    friction: SealFriction | None = None


#: Tables inside of actuators and supplies, by their key.
NESTED: dict[str, dict[str, type[Entry]]] = {
    "actuators": {"valve": Valve, "cylinder": Cylinder, "friction": SealFriction},
    "supplies": {"oil": Oil, "air": Air},
}

#: How a key is written, for messages about missing ones.
EXAMPLES: dict[str, str] = {
    "supplies.pressure": 'pressure = { value = 160, unit = "bar" }',
    "supplies.tank_pressure": 'tank_pressure = { value = 1, unit = "bar" }',
    "supplies.oil": 'oil = { bulk_modulus = { value = 1.2, unit = "GPa" } }',
    "supplies.bulk_modulus": 'bulk_modulus = { value = 1.2, unit = "GPa" }',
    "supplies.fraction": "fraction = 0.005",
    "actuators.supply": 'supply = "pump"',
    "actuators.retracted_length": 'retracted_length = { value = 281, unit = "mm" }',
    "actuators.valve": 'valve = { flow_gain = 6.7e-6, frequency = { value = 250, unit = "rev/s" }, stroke = 0.01 }',
    "actuators.frequency": 'frequency = { value = 250, unit = "rev/s" }',
    "actuators.clearance": 'clearance = { value = 0.2, unit = "mA" }',
    "actuators.cylinder": "cylinder = { bore = 0.016, rod = 0.01, stroke = 0.08, line_a = 2.9e-6, line_b = 2.9e-6 }",
    "actuators.stroke": 'stroke = { value = 80, unit = "mm" }',
    "actuators.line_a": 'line_a = { value = 2.9, unit = "cm^3" }',
    "actuators.line_b": 'line_b = { value = 1.7, unit = "cm^3" }',
}
