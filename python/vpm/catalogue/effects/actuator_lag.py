"""Actuator lag: a drive that follows its command as a system of first order.

Source: Franklin et al. 2015, section 3.1.
"""

import math

from vpm.catalogue.kinds import ABOVE_ZERO, POSITIVE, EffectType, nonlinear
from vpm.catalogue.signature import Signature
from vpm.catalogue.traits import Tried

EFFECT = EffectType(
    name="actuator_lag",
    site="actuator",
    group="lag",
    parameters=(
        nonlinear(
            "time_constant",
            "s",
            "time after which 63 % of a step have arrived",
            neutral=POSITIVE,
            physical=ABOVE_ZERO,
            evaluable=ABOVE_ZERO,
        ),
    ),
    law="time_constant dx/dt = u - x",
    sentence="{at} follows its command gradually, with a time constant of {time_constant}.",
    impossible="a negative time constant would mean a drive that runs away from its command",
    confused_with={
        "joint_compliance": "both delay the motion of the link; free vibration after a stop shows the spring alone",
        "input_delay": "they agree for slow commands; steps and fast commands discriminate",
        "viscous_friction": "both weaken fast motion; steady motion at several speeds shows the friction alone",
    },
    late="lag",
    tried=(Tried("time_constant", "interval", (1.0, 4.0, 16.0), (0.02, math.inf)),),
    signature=Signature(
        ("command_rate",),
        "A loop around a line over the rate of the command, open for fast commands",
        "Steps and fast commands",
    ),
)
