"""Rotor inertia: what turns with the motor and carries no weight.

Source: Featherstone 2008, section 9.6.
"""

from vpm.catalogue.kinds import NOT_NEGATIVE, EffectType, size
from vpm.catalogue.signature import Signature

EFFECT = EffectType(
    name="rotor_inertia",
    site="joint",
    group="rotor",
    parameters=(
        size(
            "inertia",
            "{E} s^2/{C}",
            "inertia of the rotor as the joint feels it, ratio squared times its own",
            physical=NOT_NEGATIVE,
        ),
    ),
    law="tau = -inertia d^2q/dt^2, without gravity or gyroscopic effects",
    sentence="{at} has to accelerate {inertia} more than its links have: that of a rotor, which no gravity acts on.",
    impossible="a negative inertia of a rotor would mean that the links are too heavy: correct their inertia",
    confused_with={
        "joint_compliance": "far below the resonance only the inertias show; faster motion discriminates",
    },
    exact=True,
    rotor=True,
    motor_side_alone=True,
    signature=Signature(
        ("acceleration",),
        "A straight line through zero over the acceleration of the motor",
        "Fast reversals without a load",
    ),
)
