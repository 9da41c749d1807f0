"""Viscous friction: oil and seals resist in proportion to the speed.

Source: Armstrong-Hélouvry et al. 1994.
"""

from vpm.catalogue.kinds import NOT_NEGATIVE, EffectType, size
from vpm.catalogue.signature import Signature

EFFECT = EffectType(
    name="viscous_friction",
    site="joint",
    group="friction",
    parameters=(size("viscous", "{E} s/{C}", "resistance per speed", physical=NOT_NEGATIVE),),
    law="tau = -viscous v",
    sentence="{at} resists motion in proportion to its speed, with {viscous}.",
    impossible="a negative viscous friction would feed energy into the motion instead of taking it out",
    confused_with={
        "structural_damping": "both calm vibrations; friction also brakes motion that does not bend the link",
        "internal_leakage": "both let a loaded piston give way; the pressures of both chambers discriminate",
        "supply_drop": "both weaken fast motion; the pressures of both chambers discriminate",
        "coulomb_friction": "motion at one speed alone does not discriminate; records at several speeds do",
        "actuator_lag": "both weaken fast motion; steady motion at several speeds shows the friction alone",
        "saturation": "both weaken large commands; large commands at low speed discriminate",
        "sensor_gain": "both scale the effort that a speed needs; a reference length discriminates",
    },
    usual="friction",
    plain="damping",
    signature=Signature(("velocity",), "A straight line through zero", "Motion at several constant speeds"),
)
