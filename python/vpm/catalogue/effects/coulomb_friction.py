"""Coulomb friction: dry surfaces resist alike at every speed.

Source: Andersson et al. 2007.
"""

from vpm.catalogue.kinds import NOT_NEGATIVE, EffectType, size
from vpm.catalogue.shared import SLOW, SLOW_AND_FAST, transition
from vpm.catalogue.signature import Signature
from vpm.catalogue.traits import Tried

EFFECT = EffectType(
    name="coulomb_friction",
    site="joint",
    group="friction",
    parameters=(
        size("coulomb", "{E}", "resistance that does not depend on speed", physical=NOT_NEGATIVE),
        transition(),
    ),
    law="tau = -coulomb tanh(v/transition_velocity)",
    sentence="{at} resists motion with {coulomb} at any speed, against the direction of motion.",
    impossible="a negative Coulomb friction would push along the motion and feed energy into it",
    confused_with={
        "viscous_friction": "motion at one speed alone does not discriminate; records at several speeds do",
    },
    sticks=True,
    usual="friction",
    plain="friction",
    tried=(Tried("transition_velocity", "speed", (0.002, 0.01, 0.04), SLOW),),
    signature=Signature(
        ("velocity",), "Two levels of opposite sign, one for each direction, with a step at rest", SLOW_AND_FAST
    ),
)
