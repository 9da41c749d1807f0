"""Stribeck friction: what dry friction is larger by close to rest, where no film of oil has built up yet.

Source: Armstrong-Hélouvry et al. 1994, section 2.1.
"""

from vpm.catalogue.kinds import NOT_NEGATIVE, EffectType, shape, size
from vpm.catalogue.shared import STRIBECK, transition
from vpm.catalogue.signature import Signature
from vpm.catalogue.traits import Tried

EFFECT = EffectType(
    name="stribeck_friction",
    site="joint",
    group="friction",
    parameters=(
        size("stribeck", "{E}", "friction close to rest in excess of the Coulomb friction", physical=NOT_NEGATIVE),
        shape(
            "stribeck_velocity", "{C}/s", "speed at which the excess has fallen to 37 %", start=STRIBECK, learnt=True
        ),
        transition("friction.stribeck_transition_velocity"),
    ),
    law="tau = -stribeck tanh(v/transition_velocity) exp(-(v/stribeck_velocity)^2)",
    sentence=(
        "{at} sticks: close to rest it resists motion with {stribeck} more than in motion, an excess that fades at a"
        " speed of about {stribeck_velocity}."
    ),
    impossible="a negative Stribeck level would mean friction that is lower close to rest than in motion",
    confused_with={
        "coulomb_friction": "they differ only at low speed; slow motion and starts from rest discriminate",
    },
    requires="coulomb_friction",
    sticks=True,
    close_to_rest=True,
    # Beyond 0.3 of the largest speed it is no excess close to rest any more.
    tried=(Tried("stribeck_velocity", "speed", (0.015, 0.05, 0.15), (2e-3, 0.3)),),
    fixed=("transition_velocity",),
    signature=Signature(
        ("velocity",),
        "A hump on both sides of rest that is gone at higher speed",
        "Slow motion that starts from rest, again and again",
    ),
)
