"""Valve dynamics: a spool that is slower than described.

Source: D'Imperio 2016, section 4.1.
"""

import math

from vpm.catalogue.kinds import NOT_NEGATIVE, EffectType
from vpm.catalogue.shared import over_described
from vpm.catalogue.signature import Signature
from vpm.catalogue.traits import Tried

EFFECT = EffectType(
    name="valve_dynamics",
    site="cylinder",
    group="valve_dynamics",
    parameters=(
        over_described(
            "time", "s", "what is added to the inverse of the spool's natural frequency (in rad/s)", 1e-3, NOT_NEGATIVE
        ),
    ),
    law="1/w = 1/frequency + time, z'' = w^2 (u - z) - 2 damping w z'",
    sentence="The spool of {at} is slower than described: {time} comes on top of the inverse of its natural frequency.",
    impossible="a negative time means a spool faster than described: correct the frequency of the valve",
    confused_with={
        "actuator_lag": "a lag is a pole before the spool, the other is the spool itself; fast commands discriminate",
        "input_delay": "they agree for slow commands; steps and fast commands discriminate",
    },
    late="spool",
    tried=(Tried("time", "interval", (1.0, 4.0, 16.0), (0.02, math.inf)),),
    signature=Signature(
        ("frequency", "command_rate"),
        "An error that grows with frequency up to the bandwidth of the valve",
        "A chirp of the current",
    ),
)
