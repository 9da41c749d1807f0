"""Internal leakage: oil that passes the piston of a cylinder, on top of what is described.

Source: Merritt 1967; D'Imperio 2016, equation 4.11.
"""

from vpm.catalogue.kinds import EffectType
from vpm.catalogue.shared import over_described
from vpm.catalogue.signature import Signature

EFFECT = EffectType(
    name="internal_leakage",
    site="cylinder",
    group="internal_leakage",
    parameters=(
        over_described(
            "coefficient",
            "m^3/(s Pa)",
            "laminar flow past the piston per difference of the pressures, on top of the described one",
            1e-12,
        ),
    ),
    law="q_leak = coefficient (p_a - p_b)",
    sentence="The piston of {at} leaks {coefficient} more from chamber to chamber than described.",
    impossible="less leakage than described: a negative one means that the described leakage is too large; correct it",
    confused_with={
        "viscous_friction": "both let a loaded piston give way; the pressures of both chambers discriminate",
    },
    signature=Signature(
        ("pressure_difference",),
        "A line over the difference of the chambers' pressures",
        "Holding a load, and slow motion under load",
    ),
)
