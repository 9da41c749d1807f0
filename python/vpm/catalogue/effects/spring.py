"""Spring: it pulls a joint back to a place of rest, in proportion to its way.

Source: Hooke's law.
"""

from vpm.catalogue.kinds import ANY, NOT_NEGATIVE, EffectType, shape, size
from vpm.catalogue.signature import Signature
from vpm.catalogue.traits import Tried

EFFECT = EffectType(
    name="spring",
    site="joint",
    group="spring",
    parameters=(
        size("stiffness", "{E}/{C}", "restoring effort per way", physical=NOT_NEGATIVE),
        shape("rest", "{C}", "position without restoring effort", start=0.0, bounds=ANY),
    ),
    law="tau = -stiffness (q - rest)",
    sentence="{at} is pulled back towards {rest} with {stiffness}.",
    impossible="a negative stiffness would push the joint away from its rest position",
    confused_with={
        "bias_force": "they agree over a short way; motion over a longer way discriminates",
    },
    tried=(Tried("rest", "way", (0.0,), (-10.0, 10.0)),),
    link_side_alone=True,
    usual="force",
    plain="stiffness",
    signature=Signature(
        ("position",), "A straight line that crosses zero at the place of rest", "Slow motion over the whole way"
    ),
)
