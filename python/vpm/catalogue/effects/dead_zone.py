"""Dead zone: small commands that a drive does not answer to.

Source: Tao and Kokotovic 1996, section 2.1.
"""

from vpm.catalogue.kinds import ANY, NOT_NEGATIVE, EffectType, nonlinear
from vpm.catalogue.signature import Signature

EFFECT = EffectType(
    name="dead_zone",
    site="actuator",
    group="dead_zone",
    parameters=(
        nonlinear(
            "width", "{U}", "command below which nothing happens", neutral=0.0, physical=NOT_NEGATIVE, evaluable=ANY
        ),
    ),
    law="u_out = sign(u) max(|u| - width, 0)",
    sentence="{at} does not answer to commands below {width}, and takes as much off larger ones.",
    impossible="a negative dead zone would mean that the drive acts on no command at all",
    confused_with={
        "coulomb_friction": "they agree wherever command and velocity have the same sign; braking discriminates",
        "stribeck_friction": "both hold the joint at rest under small commands; slow reversals under load discriminate",
    },
    signature=Signature(
        ("command",),
        "Two levels of opposite sign, joined through small commands",
        "Small commands of both signs under a load",
    ),
)
