"""Structural damping: of a beam that is described as elastic.

Source: Caughey and O'Kelly 1965.
"""

from vpm.catalogue.kinds import NOT_NEGATIVE, EffectType, nonlinear
from vpm.catalogue.signature import Signature

EFFECT = EffectType(
    name="structural_damping",
    site="beam",
    group="structural_damping",
    parameters=(
        nonlinear(
            "time",
            "s",
            "damping per stiffness beside what is described",
            neutral=0.0,
            physical=NOT_NEGATIVE,
            evaluable=NOT_NEGATIVE,
        ),
    ),
    law="D = D_described + time K",
    sentence="{at} damps its vibrations by {time} more than described, in proportion to its stiffness.",
    impossible="a negative damping would feed energy into the vibrations",
    confused_with={
        "viscous_friction": "both calm vibrations; friction also brakes motion that does not bend the link",
    },
    damps=True,
    signature=Signature(
        ("frequency",),
        "A resonance that is lower and broader than modelled",
        "Quick stops, after which the link rings out freely",
    ),
)
