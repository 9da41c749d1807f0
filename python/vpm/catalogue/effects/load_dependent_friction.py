"""Friction in proportion to the load: gears that lose a share of the effort that they pass on.

Source: Hamon et al. 2010.
"""

from vpm.catalogue.kinds import EffectType
from vpm.catalogue.shared import NEGATIVE_SHARE, law_of_load, shares, transition
from vpm.catalogue.signature import Signature

EFFECT = EffectType(
    name="load_dependent_friction",
    site="joint",
    group="friction",
    parameters=(
        *shares(
            "share of the actuators' effort that is lost where they drive the joint",
            "share of their effort that brakes the joint besides where it drives them",
        ),
        transition("friction.load_transition_velocity"),
    ),
    law=law_of_load("the effort of the actuators on the joint"),
    sentence=(
        "{at} rubs in proportion to its load: it loses {driving} of the effort where the drive pushes, and {driven} of"
        " it brakes where the joint pushes the drive."
    ),
    impossible=NEGATIVE_SHARE,
    motor_side_alone=True,
    takes_effort=True,
    signature=Signature(
        ("effort",),
        "Lines through zero over the effort, one for each direction",
        "The same slow motion forward and back under several loads",
    ),
)
