"""End stop: the ends of the way of a joint, which push back harder in impact.

Source: Hunt and Crossley 1975.
"""

from vpm.catalogue.kinds import ANY, NOT_NEGATIVE, EffectType, shape, size
from vpm.catalogue.shared import CONTACT, NEVER
from vpm.catalogue.signature import Signature

EFFECT = EffectType(
    name="end_stop",
    site="joint",
    group="end_stop",
    parameters=(
        size("stiffness", "{E}/{C}", "effort per way beyond an end", physical=NOT_NEGATIVE),
        shape(
            "damping",
            "s/{C}",
            "share by which the effort grows per approaching speed",
            start=0.0,
            bounds=NOT_NEGATIVE,
            learnt=True,
        ),
        shape("low", "{C}", "lower end of the way", start=-NEVER, bounds=ANY),
        shape("high", "{C}", "upper end of the way", start=NEVER, bounds=ANY),
        shape("width", "{C}", "way over which a contact closes", start=CONTACT),
    ),
    law=(
        "tau = -stiffness (p(q - high) r(damping v) - p(low - q) r(-damping v)), p(x) = 1/2 (x + sqrt(x^2 + width^2)),"
        " r(y) = 1 + y, rounded above 0"
    ),
    sentence=(
        "{at} runs against stops at {low} and {high}, which push back with {stiffness}, harder by {damping} in impact."
    ),
    impossible="a negative stiffness would pull the joint beyond its end",
    confused_with={
        "spring": "they agree over a way beyond the end alone; motion on both sides of it discriminates",
    },
    impacts=True,
    link_side_alone=True,
    signature=Signature(
        ("position",),
        "Nothing, and beyond one place a steep wall",
        "Slow motion into the stop, and faster than that",
    ),
)
