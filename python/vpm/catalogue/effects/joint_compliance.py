"""Joint compliance: an elastic transmission; it splits its joint, and the link hangs behind, as with backlash.

Source: Spong 1987, equation 2.
"""

from vpm.catalogue.kinds import ANY, NOT_NEGATIVE, EffectType, nonlinear, size
from vpm.catalogue.shared import RIGID, motor_inertia
from vpm.catalogue.signature import Signature

EFFECT = EffectType(
    name="joint_compliance",
    site="joint",
    group="compliance",
    parameters=(
        nonlinear(
            "stiffness",
            "{E}/{C}",
            "effort per deflection between motor side and link side",
            neutral=RIGID,
            physical=NOT_NEGATIVE,
            evaluable=ANY,
        ),
        size("damping", "{E} s/{C}", "resistance per rate of the deflection", physical=NOT_NEGATIVE, linear=False),
        motor_inertia(),
    ),
    law="tau = -stiffness d - damping dd/dt on the deflection d, with inertia on the motor side",
    sentence=(
        "{at} is compliant between motor and link, with a stiffness of {stiffness}, a damping of {damping} and an"
        " inertia of {inertia} on the motor side."
    ),
    impossible="a negative stiffness would drive motor and link apart, a negative damping would feed energy in",
    confused_with={
        "backlash": "they agree where the load never changes its sign; reversals and small motion discriminate",
    },
    contains=("rotor_inertia",),
    motion="deflection",
    motor_side_alone=True,
    signature=Signature(
        ("frequency",),
        "A peak at the resonance of load and motor against each other",
        "A chirp or a multisine through the resonance",
    ),
)
