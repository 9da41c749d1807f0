"""Sensor delay: a sensor that reads late.

Source: Laakso et al. 1996.
"""

from vpm.catalogue.kinds import EffectType
from vpm.catalogue.shared import delay
from vpm.catalogue.signature import Signature

EFFECT = EffectType(
    name="sensor_delay",
    site="sensor",
    group="delay",
    parameters=(delay("time between the motion and its reading"),),
    law="y(t) = x(t - time)",
    sentence="{at} reads {time} late.",
    impossible="a negative delay would mean a reading ahead of the motion: check the time stamps of the log",
    confused_with={
        "input_delay": "from commands to readings only their sum shows; a second sensor or time stamps discriminate",
        "actuator_lag": "they agree for slow motion; steps and fast motion discriminate",
    },
    late="delay",
    signature=Signature(
        ("command_rate",),
        "A straight line over the rate of the command",
        "Steps, and time stamps of a second sensor",
    ),
)
