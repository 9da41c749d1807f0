"""Saturation: the largest command that a drive follows.

Source: Åström and Hägglund 2006, section 3.5.
"""

from vpm.catalogue.kinds import ABOVE_ZERO, EffectType, nonlinear
from vpm.catalogue.shared import NEVER
from vpm.catalogue.signature import Signature
from vpm.catalogue.traits import Tried

EFFECT = EffectType(
    name="saturation",
    site="actuator",
    group="saturation",
    parameters=(
        nonlinear(
            "limit", "{U}", "largest command that is followed", neutral=NEVER, physical=ABOVE_ZERO, evaluable=ABOVE_ZERO
        ),
    ),
    law="u_out = min(max(u, -limit), limit)",
    sentence="{at} does not follow commands beyond {limit}.",
    impossible="a limit of zero or less would mean that the drive never acts",
    confused_with={
        "end_stop": "both stop the motion at large commands; the same command in the middle of the way discriminates",
        "viscous_friction": "both weaken large commands; large commands at low speed discriminate",
    },
    tried=(Tried("limit", "command", (0.95, 0.7, 0.4), (0.02, 1.0)),),
    signature=Signature(
        ("command",),
        "Nothing up to the limit, and beyond it a straight line",
        "Commands up to the largest that the drive may take",
    ),
)
