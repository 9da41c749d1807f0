"""Cubic spring: a spring that stiffens over its way.

Source: Nayfeh and Mook 1979, section 4.1.
"""

from vpm.catalogue.kinds import ANY, EffectType, shape, size
from vpm.catalogue.signature import Signature
from vpm.catalogue.traits import Tried

EFFECT = EffectType(
    name="cubic_spring",
    site="joint",
    group="cubic_spring",
    parameters=(
        size("stiffness", "{E}/{C}^3", "restoring effort per cube of the way"),
        shape("rest", "{C}", "position without restoring effort", start=0.0, bounds=ANY),
    ),
    law="tau = -stiffness (q - rest)^3",
    sentence="{at} is pulled back towards {rest} with the cube of its way, with {stiffness}.",
    impossible="either sign is possible: beside a spring a negative one makes it softer on its way",
    tried=(Tried("rest", "way", (0.0,), (-10.0, 10.0)),),
    link_side_alone=True,
    in_springs=True,
    usual="force",
    signature=Signature(
        ("position",), "A cubic parabola that crosses zero at the place of rest", "Slow motion over the whole way"
    ),
)
