"""Current ripple: a motor whose torque per current changes with its angle.

Source: Holtz and Springob 1996.
"""

from vpm.catalogue.kinds import EffectType, shape, size
from vpm.catalogue.signature import Signature

EFFECT = EffectType(
    name="current_ripple",
    site="joint",
    group="current_ripple",
    parameters=(
        shape(
            "period",
            "{C}",
            "way after which the ripple repeats; it follows from the motor: a turn, or a pair of its poles",
            start=None,
        ),
        size("cosine", "1", "share of the actuators' effort that is lost at zero"),
        size("sine", "1", "share of it that is lost a quarter of a period later"),
    ),
    law=(
        "tau = -u (cosine cos(2 pi q/period) + sine sin(2 pi q/period)), u the effort of the actuators on the joint,"
        " the bracket within 0.95"
    ),
    sentence=(
        "{at} gets more and less of its effort along its way, by {cosine} (cosine) and {sine} (sine), every {period}"
        " alike."
    ),
    impossible="a motor that pushes the other way at some angles is wired wrongly",
    motor_side_alone=True,
    takes_effort=True,
    signature=Signature(
        ("position", "effort"),
        "A wave that repeats over the way, as large as the effort, and turns over with it",
        "Slow motion at constant speed over many periods, under several loads",
    ),
)
