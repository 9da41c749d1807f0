"""Torque ripple: cogging and other loads that repeat over the way.

Source: Holtz and Springob 1996.
"""

from vpm.catalogue.kinds import EffectType, shape, size
from vpm.catalogue.signature import Signature

EFFECT = EffectType(
    name="torque_ripple",
    site="joint",
    group="ripple",
    parameters=(
        shape(
            "period",
            "{C}",
            "way after which the ripple repeats; it follows from the machine: pole pitch, screw lead, teeth",
            start=None,
        ),
        size("cosine", "{E}", "part that is greatest at the zero position"),
        size("sine", "{E}", "part that is zero at the zero position"),
    ),
    law="tau = -(cosine cos(2 pi q/period) + sine sin(2 pi q/period))",
    sentence="{at} is loaded by a ripple that repeats every {period}, with {cosine} (cosine) and {sine} (sine).",
    impossible="either sign is possible: the signs say where in the period the ripple is greatest",
    confused_with={
        "spring": "they agree over less than a quarter of a period; a longer way discriminates",
    },
    signature=Signature(
        ("position",),
        "A wave that repeats over the way, whatever the speed",
        "Slow motion at constant speed over many periods",
    ),
)
