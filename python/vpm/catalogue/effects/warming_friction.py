"""Warming friction: what a cold machine resists more, until it is warm.

Source: Carvalho Bittencourt and Gunnarsson 2012.
"""

from vpm.catalogue.kinds import ABOVE_ZERO, NOT_NEGATIVE, EffectType, shape, size
from vpm.catalogue.shared import transition
from vpm.catalogue.signature import Signature
from vpm.catalogue.traits import Tried

EFFECT = EffectType(
    name="warming_friction",
    site="joint",
    group="warming",
    parameters=(
        size("coulomb", "{E}", "cold less warm resistance that does not depend on speed", physical=NOT_NEGATIVE),
        size("viscous", "{E} s/{C}", "cold less warm resistance per speed", physical=NOT_NEGATIVE),
        shape("time_constant", "s", "time after which 63 % of these are gone", start=None, bounds=ABOVE_ZERO),
        transition(),
    ),
    law=(
        "tau = -(1 - w) (coulomb tanh(v/transition_velocity) + viscous v), dw/dt = (1 - w)/time_constant,"
        " w = 0 at the first sample"
    ),
    sentence=(
        "{at} rubs more while it is cold: at the beginning by {coulomb} at any speed and by {viscous} in proportion to"
        " speed, which fade with a time constant of {time_constant}."
    ),
    impossible="a negative one would mean friction that grows as the machine gets warm",
    memory="warming.memory",
    tried=(Tried("time_constant", "record", (0.1, 0.4), (0.01, 1.0)),),
    signature=Signature(
        ("time", "velocity"),
        "Levels for each direction that come together over time",
        "The same motion again and again after a cold start",
    ),
)
