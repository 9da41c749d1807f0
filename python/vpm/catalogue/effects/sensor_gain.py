"""Sensor gain: a sensor that reads too much or too little of everything.

Source: Doebelin 2004, section 3.2.
"""

from vpm.catalogue.kinds import ABOVE_ZERO, EffectType, nonlinear
from vpm.catalogue.signature import Signature

EFFECT = EffectType(
    name="sensor_gain",
    site="sensor",
    group="gain",
    parameters=(
        nonlinear("value", "1", "reading per true value", neutral=1.0, physical=ABOVE_ZERO, evaluable=ABOVE_ZERO),
    ),
    law="y = value x",
    sentence="{at} reads {value} times the true value.",
    impossible="a gain of zero or less would mean a reading that does not follow the motion, or runs against it",
    confused_with={
        "rotor_inertia": "both scale the effort that an acceleration needs; a record with a known load discriminates",
        "payload": "both scale the effort that an acceleration needs; a record with a known load discriminates",
        "viscous_friction": "both scale the effort that a speed needs; a reference length discriminates",
    },
    signature=Signature(
        ("effort", "position"), "A straight line over the effort that the motion needs", "A way of known length"
    ),
)
