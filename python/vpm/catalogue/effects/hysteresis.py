"""Hysteresis: friction that builds up over a way and remembers the path.

Source: Ikhouane and Rodellar 2007, section 2.5; Dahl 1968.
"""

from vpm.catalogue.kinds import NOT_NEGATIVE, EffectType, shape, size
from vpm.catalogue.signature import Signature
from vpm.catalogue.traits import Tried

#: Pre-sliding way where none is given: prismatic (m), revolute (rad).
_PRESLIDING = (1e-3, 1e-2)

EFFECT = EffectType(
    name="hysteresis",
    site="joint",
    group="hysteresis",
    parameters=(
        size("force", "{E}", "resistance after a long way in one direction", physical=NOT_NEGATIVE),
        shape(
            "displacement",
            "{C}",
            "way over which the resistance builds up; from a relaxed start 63 % of it are there after that way",
            start=_PRESLIDING,
            learnt=True,
        ),
        shape(
            "shape",
            "1",
            "stiffness on reversal over that about the relaxed state, less 1; 1 is Dahl's friction",
            start=1.0,
            bounds=NOT_NEGATIVE,
            learnt=True,
        ),
    ),
    law=(
        "tau = -force z, dz/dt = (v/displacement) (1 - |z|) where v z >= 0,"
        " (v/displacement) (1 + shape |z|) where v z < 0"
    ),
    sentence=(
        "{at} resists with a memory of its path: against {force} after a long way, which build up and turn round over"
        " ways of about {displacement}."
    ),
    impossible="a negative hysteresis would give out more energy in every loop than went in",
    confused_with={
        "coulomb_friction": "they agree but after a reversal; short strokes and slow reversals discriminate",
        "stribeck_friction": "both shape the start of a motion; starts at several accelerations discriminate",
        "spring": "they agree over ways that are too short to slide; a longer way discriminates",
    },
    sticks=True,
    in_springs=True,
    tried=(
        Tried("displacement", "travel", (0.004, 0.02, 0.1), (0.0, 2.0), sampled=True),
        Tried("shape", "one", (), (0.0, 20.0)),
    ),
    memory="memory",
    signature=Signature(
        ("position",),
        "A loop that is run through in the same sense at every speed",
        "Slow reversals over ways of several lengths",
    ),
)
