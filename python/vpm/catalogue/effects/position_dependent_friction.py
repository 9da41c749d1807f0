"""Friction that is not the same everywhere: dry friction that repeats over the way.

Source: Armstrong-Hélouvry 1991.
"""

from vpm.catalogue.kinds import EffectType, shape, size
from vpm.catalogue.shared import transition
from vpm.catalogue.signature import Signature

EFFECT = EffectType(
    name="position_dependent_friction",
    site="joint",
    group="friction",
    parameters=(
        shape(
            "period",
            "{C}",
            "way after which the level repeats; it follows from the machine: a turn of a shaft, screw or gear",
            suffix="friction.position_period",
            start=None,
        ),
        size("cosine", "{E}", "part of the level that is greatest at zero", suffix="friction.position_cosine"),
        size("sine", "{E}", "part of the level that vanishes at zero", suffix="friction.position_sine"),
        transition("friction.position_transition_velocity"),
    ),
    law="tau = -(cosine cos(2 pi q/period) + sine sin(2 pi q/period)) tanh(v/transition_velocity)",
    sentence="{at} rubs differently along its way, by {cosine} (cosine) and {sine} (sine), every {period} alike.",
    impossible="either sign is possible; the friction of each place as a whole has to stay above zero",
    requires="coulomb_friction",
    signature=Signature(
        ("position", "velocity"),
        "A wave that repeats over the way and turns over with the direction",
        "Slow motion at constant speed over many periods, forward and back",
    ),
)
