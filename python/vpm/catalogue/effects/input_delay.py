"""Input delay: a drive that answers to its command after a while.

Source: Åström and Wittenmark 1997, section 2.3.
"""

from vpm.catalogue.kinds import EffectType
from vpm.catalogue.shared import delay
from vpm.catalogue.signature import Signature

EFFECT = EffectType(
    name="input_delay",
    site="actuator",
    group="delay",
    parameters=(delay("time between a command and its effect"),),
    law="u_delayed(t) = u(t - time)",
    sentence="{at} acts on a command {time} late.",
    impossible="a negative delay would mean that the drive acts before it is told to: check the time stamps of the log",
    late="delay",
    signature=Signature(("command_rate",), "A straight line over the rate of the command", "Steps and fast commands"),
)
