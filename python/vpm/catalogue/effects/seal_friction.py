"""Seal friction: both chambers of a cylinder press its seals, which resist in proportion to their pressures.

Source: Bonchis, Corke and Rye 1999.
"""

from vpm.catalogue.kinds import ANY, NOT_NEGATIVE, EffectType, nonlinear, shape
from vpm.catalogue.shared import SLOW, TRANSITION
from vpm.catalogue.signature import Signature
from vpm.catalogue.traits import Tried

EFFECT = EffectType(
    name="seal_friction",
    site="cylinder",
    group="seal_friction",
    parameters=(
        nonlinear(
            "share",
            "1",
            "dry friction as a share of the piston's area times the sum of both pressures",
            neutral=0.0,
            physical=NOT_NEGATIVE,
            evaluable=ANY,
            typical=0.01,
        ),
        shape(
            "transition_velocity",
            "m/s",
            "speed of the piston below which the law bends from one sign to the other",
            start=TRANSITION[0],
            learnt=True,
        ),
    ),
    law="f = -share area (p_a + p_b) tanh(v/transition_velocity)",
    sentence="The seals of {at} rub by {share} of the piston's area times the sum of the pressures in its chambers.",
    impossible="a negative share would push along the motion and feed energy into it",
    confused_with={
        "coulomb_friction": "one size at every pressure; records at several pressures, or loads, discriminate",
        "asymmetric_friction": "pressures differ between out and back; records under several loads discriminate",
        "drive_friction": "one grows with the effort, the other with the sum of pressures; loads discriminate",
    },
    sticks=True,
    tried=(Tried("transition_velocity", "speed", (0.002, 0.01, 0.04), SLOW),),
    signature=Signature(
        ("velocity",),
        "Two levels of opposite sign that move with the pressures, with a step at rest",
        "Strokes out and back at several pressures, with slow starts from rest",
    ),
)
