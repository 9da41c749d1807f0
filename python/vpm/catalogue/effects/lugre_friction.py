"""LuGre friction: bristles that bend over short ways and slide over long ones.

Source: Canudas de Wit et al. 1995.
"""

from vpm.catalogue.kinds import NOT_NEGATIVE, EffectType, shape, size
from vpm.catalogue.shared import STRIBECK
from vpm.catalogue.signature import Signature

#: Way over which bristles bend where none is given: prismatic (m), revolute (rad).
_PRESLIDING = (1e-5, 1e-4)

EFFECT = EffectType(
    name="lugre_friction",
    site="joint",
    group="lugre",
    parameters=(
        size("coulomb", "{E}", "resistance in fast motion, but for its viscous part", physical=NOT_NEGATIVE),
        size("damping", "{E} s/{C}", "resistance of the bristles to bending", physical=NOT_NEGATIVE),
        shape(
            "displacement",
            "{C}",
            "way over which the bristles bend; their stiffness is coulomb/displacement",
            start=_PRESLIDING,
            learnt=True,
        ),
        shape(
            "excess",
            "1",
            "share by which the resistance in slow motion is larger",
            start=0.0,
            bounds=NOT_NEGATIVE,
            learnt=True,
        ),
        shape(
            "stribeck_velocity", "{C}/s", "speed at which this share has fallen to 37 %", start=STRIBECK, learnt=True
        ),
    ),
    law=(
        "tau = -coulomb z - damping displacement dz/dt, dz/dt = (v - |v| z/h)/displacement,"
        " h = 1 + excess exp(-(v/stribeck_velocity)^2)"
    ),
    sentence=(
        "{at} rubs as bristles do: they bend over ways of about {displacement}, damped with {damping}, and slide with"
        " {coulomb} in fast motion."
    ),
    impossible="a negative friction of bristles would push along the motion and feed energy into it",
    memory="lugre.memory",
    contains=("coulomb_friction",),
    signature=Signature(
        ("position", "velocity"),
        "A loop over short ways, and over long ones levels with a hump close to rest",
        "Slow reversals over ways of several lengths, and starts from rest",
    ),
)
