"""Sensor offset: a sensor whose zero is shifted.

Source: Doebelin 2004, section 3.2.
"""

from vpm.catalogue.kinds import ANY, EffectType, nonlinear
from vpm.catalogue.signature import Signature

EFFECT = EffectType(
    name="sensor_offset",
    site="sensor",
    group="offset",
    parameters=(nonlinear("value", "{S}", "reading at a true zero", neutral=0.0, physical=ANY, evaluable=ANY),),
    law="y = x + value",
    sentence="{at} reads {value} too much, always.",
    impossible="either sign is possible: it says in which direction the zero is shifted",
    confused_with={
        "gravity_tilt": "a shifted zero of an angle turns gravity for all that hangs on it; other poses discriminate",
        "bias_force": "through gravity or a spring a shifted zero acts like a load; other poses discriminate",
        "spring": "a shifted rest position and a shifted zero agree; a reference position discriminates",
    },
    zero=True,
    signature=Signature(
        ("position", "time"),
        "The slope of gravity or of a spring over the way; nothing without either",
        "A reference position",
    ),
)
