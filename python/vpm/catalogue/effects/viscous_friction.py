"""Viscous friction: oil and seals resist in proportion to the speed.

Source: Armstrong-Hélouvry et al. 1994.
"""

from vpm.catalogue.kinds import NOT_NEGATIVE, EffectType, size
from vpm.catalogue.signature import Signature

EFFECT = EffectType(
    name="viscous_friction",
    site="joint",
    group="friction",
    parameters=(size("viscous", "{E} s/{C}", "resistance per speed", physical=NOT_NEGATIVE),),
    law="tau = -viscous v",
    sentence="{at} resists motion in proportion to its speed, with {viscous}.",
    impossible="a negative viscous friction would feed energy into the motion instead of taking it out",
    usual="friction",
    plain="damping",
    signature=Signature(("velocity",), "A straight line through zero", "Motion at several constant speeds"),
)
