"""Friction in proportion to the effort of one drive, as of seals under pressure.

Source: Hamon et al. 2010.
"""

from vpm.catalogue.kinds import EffectType
from vpm.catalogue.shared import NEGATIVE_SHARE, law_of_load, shares, transition
from vpm.catalogue.signature import Signature

EFFECT = EffectType(
    name="drive_friction",
    site="actuator",
    group="friction",
    parameters=(
        *shares(
            "share of the effort of this actuator that is lost where it drives",
            "share of its effort that brakes besides where it is driven",
        ),
        transition(),
    ),
    law=law_of_load("the effort of this actuator"),
    sentence=(
        "{at} rubs in proportion to its own effort, as seals under pressure do: {driving} of it is lost where it"
        " drives, and {driven} of it brakes where it is driven."
    ),
    impossible=NEGATIVE_SHARE,
    beside_others=True,
    signature=Signature(
        ("effort",),
        "Lines through zero over the effort of one actuator, one for each direction",
        "The same slow motion forward and back at several efforts of this actuator",
    ),
)
