"""Supply drop: pressure that hoses and filters take between a supply and its valves.

Source: Merritt 1967, sections 3-2 and 3-3.
"""

from vpm.catalogue.kinds import EffectType, shape
from vpm.catalogue.shared import over_described
from vpm.catalogue.signature import Signature
from vpm.catalogue.traits import Tried

#: Time in which hoses and filters lose their pressure when nothing better is known, s.
_HOSES = 0.02

EFFECT = EffectType(
    name="supply_drop",
    site="supply",
    group="drop",
    parameters=(
        over_described(
            "resistance", "Pa s/m^3", "pressure lost on the way to the valves per flow that they draw", 1e10
        ),
        shape("time_constant", "s", "time after which 63 % of a loss are there", start=_HOSES),
    ),
    law="p_valve = p - d, time_constant dd/dt = resistance q - d",
    sentence="Between {at} and its valves {resistance} times the flow is lost of the pressure.",
    impossible="a negative resistance would mean a pressure that rises as oil is drawn",
    confused_with={
        "internal_leakage": "both lower the pressures under load; a load held at rest shows the leakage alone",
        "saturation": "both limit the speed; a log of the pressure at the valve discriminates",
        "viscous_friction": "both weaken fast motion; the pressures of both chambers discriminate",
    },
    # Hoses and filters lose their pressure within these.
    tried=(Tried("time_constant", "one", (0.01, 0.05, 0.2), (1e-3, 5.0)),),
    signature=Signature(
        ("flow",),
        "An error of the pressures that grows with the flow that is drawn",
        "Fast strokes, with the supply's pressure logged",
    ),
)
