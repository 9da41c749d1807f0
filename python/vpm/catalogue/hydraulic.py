"""Effects that sit at a servo-cylinder or at the supply that feeds it.

The cylinder, the valve that is screwed on it, and the actuator have one name. What is described of leakage, air and
frequency stays; an effect comes on top of it, so that its neutral value is zero.
"""

from __future__ import annotations

import math

from vpm.catalogue.kinds import ANY, NOT_NEGATIVE, EffectParameter, EffectType, Range, Scale, nonlinear, shape

#: Standard atmosphere, Pa (NIST SP 811, appendix B), and the adiabatic exponent of air.
_ATMOSPHERE, _ADIABATIC = 101325.0, 1.4
#: Time in which hoses and filters lose their pressure when nothing better is known, s.
_HOSES = 0.02


def _size(
    name: str, suffix: str, unit: str, scale: Scale, meaning: str, typical: float, evaluable: Range = ANY
) -> EffectParameter:
    return nonlinear(
        name,
        suffix,
        unit,
        scale,
        meaning,
        neutral=0.0,
        physical=NOT_NEGATIVE,
        evaluable=evaluable,
        typical=typical,
    )


INTERNAL_LEAKAGE = EffectType(
    name="internal_leakage",
    site="cylinder",
    group="internal_leakage",
    parameters=(
        _size(
            "coefficient",
            "internal_leakage.coefficient",
            "m^3/(s Pa)",
            "leakage",
            "laminar flow past the piston per difference of the pressures, on top of the described one",
            1e-12,
        ),
    ),
    law="q_leak = coefficient (p_a - p_b)",
    sentence="The piston of {at} leaks {coefficient} more from chamber to chamber than described.",
    impossible="less leakage than described: a negative one means that the described leakage is too large; correct it",
    confused_with={
        "viscous_friction": "both let a loaded piston give way; the pressures of both chambers part them",
        "supply_drop": "both lower the pressures under load; a load held at rest shows the leakage alone",
    },
)

VALVE_DYNAMICS = EffectType(
    name="valve_dynamics",
    site="cylinder",
    group="valve_dynamics",
    parameters=(
        _size(
            "time",
            "valve_dynamics.time",
            "s",
            "time",
            "what is added to the inverse of the spool's natural frequency (in rad/s)",
            1e-3,
            NOT_NEGATIVE,
        ),
    ),
    law="1/w = 1/frequency + time, z'' = w^2 (u - z) - 2 damping w z'",
    sentence="The spool of {at} is slower than described: {time} comes on top of the inverse of its natural frequency.",
    impossible="a negative time means a spool faster than described: correct the frequency of the valve",
    confused_with={
        "actuator_lag": "a lag is a pole before the spool, this is the spool itself; fast commands part them",
        "input_delay": "they agree for slow commands; steps and fast commands part them",
        "entrained_air": "both delay the force behind the command; the spool or both pressures part them",
    },
)

ENTRAINED_AIR = EffectType(
    name="entrained_air",
    site="supply",
    group="entrained_air",
    parameters=(
        nonlinear(
            "fraction",
            "entrained_air.fraction",
            "1",
            "one",
            "volume of air per volume of oil at the reference pressure, on top of the described one",
            neutral=0.0,
            physical=(0.0, 1.0),
            evaluable=NOT_NEGATIVE,
        ),
        shape(
            "exponent",
            "entrained_air.exponent",
            "1",
            "one",
            "polytropic exponent of the air",
            start=_ADIABATIC,
            bounds=(1.0, math.inf),
        ),
        shape(
            "reference_pressure",
            "entrained_air.reference_pressure",
            "Pa",
            "one",
            "pressure at which the fraction is given",
            start=_ATMOSPHERE,
        ),
    ),
    law="beta_e = beta (1 + a)/(1 + a beta/(exponent p)), a = fraction (reference_pressure/p)^(1/exponent)",
    sentence="The oil of {at} carries {fraction} of its volume as air beyond what is described.",
    impossible="a negative fraction would be oil stiffer than its bulk modulus: correct that",
    confused_with={
        "valve_dynamics": "both delay the force behind the command; the spool or both pressures part them",
        "actuator_lag": "both delay the force behind the command; pressures at a loaded piston part them",
    },
)

SUPPLY_DROP = EffectType(
    name="supply_drop",
    site="supply",
    group="drop",
    parameters=(
        _size(
            "resistance",
            "drop.resistance",
            "Pa s/m^3",
            "resistance",
            "pressure lost on the way to the valves per flow that they draw",
            1e10,
        ),
        shape(
            "time_constant",
            "drop.time_constant",
            "s",
            "time",
            "time after which 63 % of a loss are there",
            start=_HOSES,
        ),
    ),
    law="p_valve = p - d, time_constant dd/dt = resistance q - d",
    sentence="Between {at} and its valves {resistance} times the flow is lost of the pressure.",
    impossible="a negative resistance would mean a pressure that rises as oil is drawn",
    confused_with={
        "internal_leakage": "both lower the pressures under load; a load held at rest shows the leakage alone",
        "saturation": "both limit the speed; a log of the pressure at the valve parts them",
        "viscous_friction": "both weaken fast motion; the pressures of both chambers part them",
    },
)

CYLINDER_EFFECTS = (INTERNAL_LEAKAGE, VALVE_DYNAMICS)
SUPPLY_EFFECTS = (ENTRAINED_AIR, SUPPLY_DROP)
