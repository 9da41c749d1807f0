"""Quadratic drag: air and churned oil resist with the square of the speed.

Source: Batchelor 1967, section 5.11.
"""

from vpm.catalogue.kinds import NOT_NEGATIVE, EffectType, size
from vpm.catalogue.signature import Signature

EFFECT = EffectType(
    name="quadratic_drag",
    site="joint",
    group="friction",
    parameters=(
        size(
            "drag",
            "{E} s^2/{C}^2",
            "resistance per square of the speed",
            suffix="friction.quadratic",
            physical=NOT_NEGATIVE,
        ),
    ),
    law="tau = -drag |v| v",
    sentence="{at} resists motion in proportion to the square of its speed, with {drag}.",
    impossible="a negative drag would feed energy into the motion instead of taking it out",
    usual="force",
    signature=Signature(
        ("velocity",), "A parabola that changes its sign at rest", "Fast motion at several constant speeds"
    ),
)
