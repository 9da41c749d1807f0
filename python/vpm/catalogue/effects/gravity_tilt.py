"""Gravity tilt: the whole machine does not stand level.

Source: two turns of the frame of the world.
"""

import math

from vpm.catalogue.kinds import ANY, EffectParameter, EffectType, nonlinear
from vpm.catalogue.signature import Signature

_UPRIGHT = (-0.5 * math.pi, 0.5 * math.pi)


def _angle(name: str, which: str) -> EffectParameter:
    meaning = f"angle by which gravity is turned about the {which} horizontal axis of the world"
    return nonlinear(name, "rad", meaning, neutral=0.0, physical=_UPRIGHT, evaluable=ANY)


EFFECT = EffectType(
    name="gravity_tilt",
    site="world",
    group="tilt",
    parameters=(_angle("first", "first"), _angle("second", "second")),
    law="g = R_second(second) R_first(first) g_described",
    sentence="The base is not level: gravity is turned by {first} and {second} about the horizontal axes of the {at}.",
    impossible="beyond 90 degrees gravity would point upwards: correct its direction in the model",
    confused_with={
        "bias_force": "they agree where gravity's lever does not change; other poses discriminate",
        "payload": "both change the load of gravity; fast motion shows the payload's inertia",
    },
    exact=True,
    signature=Signature(
        ("position",), "A sine over the pose, shifted against that of gravity", "Slow motion through several poses"
    ),
)
