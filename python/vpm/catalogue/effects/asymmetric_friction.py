"""Asymmetric friction: what a joint resists more in one direction than in the other.

Source: Swevers et al. 2007.
"""

from vpm.catalogue.kinds import EffectType, size
from vpm.catalogue.shared import SLOW_AND_FAST, transition
from vpm.catalogue.signature import Signature

EFFECT = EffectType(
    name="asymmetric_friction",
    site="joint",
    group="friction",
    parameters=(
        size("coulomb_difference", "{E}", "Coulomb friction in positive minus in negative direction"),
        size("viscous_difference", "{E} s/{C}", "viscous friction in positive minus in negative direction"),
        transition("friction.asymmetric_transition_velocity"),
    ),
    law=(
        "tau = -1/2 coulomb_difference tanh(v/transition_velocity)^2"
        " - 1/2 viscous_difference v tanh(v/transition_velocity)"
    ),
    sentence=(
        "{at} resists motion differently in its two directions: by {coulomb_difference} at any speed and by"
        " {viscous_difference} in proportion to speed (positive minus negative direction)."
    ),
    impossible="either sign is possible; the friction of each direction as a whole has to stay above zero",
    contains=("bias_force",),
    fixed=("transition_velocity",),
    usual="force",
    signature=Signature(("velocity",), "Levels or slopes that differ between the two directions", SLOW_AND_FAST),
)
