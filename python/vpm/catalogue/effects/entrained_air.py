"""Entrained air: bubbles in the oil, on top of those that are described.

Source: Merritt 1967, section 2-4.
"""

import math

from vpm.catalogue.kinds import NOT_NEGATIVE, EffectType, nonlinear, shape
from vpm.catalogue.signature import Signature

#: Standard atmosphere, Pa (NIST SP 811, appendix B), and the adiabatic exponent of air.
_ATMOSPHERE, _ADIABATIC = 101325.0, 1.4

EFFECT = EffectType(
    name="entrained_air",
    site="supply",
    group="entrained_air",
    parameters=(
        nonlinear(
            "fraction",
            "1",
            "volume of air per volume of oil at the reference pressure, on top of the described one",
            neutral=0.0,
            physical=(0.0, 1.0),
            evaluable=NOT_NEGATIVE,
        ),
        shape("exponent", "1", "polytropic exponent of the air", start=_ADIABATIC, bounds=(1.0, math.inf)),
        shape("reference_pressure", "Pa", "pressure at which the fraction is given", start=_ATMOSPHERE),
    ),
    law="beta_e = beta (1 + a)/(1 + a beta/(exponent p)), a = fraction (reference_pressure/p)^(1/exponent)",
    sentence="The oil of {at} carries {fraction} of its volume as air beyond what is described.",
    impossible="a negative fraction would be oil stiffer than its bulk modulus: correct that",
    confused_with={
        "valve_dynamics": "both delay the force behind the command; the spool or both pressures discriminate",
        "actuator_lag": "both delay the force behind the command; pressures at a loaded piston discriminate",
    },
    # Data hardly show in which way air is compressed.
    fixed=("exponent", "reference_pressure"),
    signature=Signature(
        ("pressure_difference", "time"),
        "An error of the pressures that is large where the pressure is low",
        "Load steps at low pressure",
    ),
)
