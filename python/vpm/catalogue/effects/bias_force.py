"""Bias force: a constant load, such as a weight on a rope.

Source: Khalil and Dombre 2002.
"""

from vpm.catalogue.kinds import EffectType, size
from vpm.catalogue.signature import Signature

EFFECT = EffectType(
    name="bias_force",
    site="joint",
    group="bias",
    parameters=(size("force", "{E}", "load that the drive has to overcome"),),
    law="tau = -force",
    sentence="{at} carries a constant load of {force}, in either direction and at rest.",
    impossible="either sign is possible: it says in which direction the load pulls",
    confused_with={
        "coulomb_friction": "motion in one direction alone does not discriminate; motion in both directions does",
        "asymmetric_friction": (
            "a difference of Coulomb friction and a constant load agree wherever the joint moves; only standstill and"
            " starts from rest discriminate"
        ),
    },
    usual="force",
    signature=Signature(
        ("time", "position"),
        "One level that never changes",
        "The same motion forward and back, and rest in several places",
    ),
)
