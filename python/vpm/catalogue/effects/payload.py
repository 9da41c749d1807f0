"""Payload: a point mass on a body or at the tip of a beam.

Source: Featherstone 2008, equation 2.63.
"""

from vpm.catalogue.kinds import ANY, NOT_NEGATIVE, EffectParameter, EffectType, shape, size
from vpm.catalogue.signature import Signature


def _coordinate(name: str) -> EffectParameter:
    return shape(name, "m", f"{name} of the payload in the body's frame", start=0.0, bounds=ANY)


EFFECT = EffectType(
    name="payload",
    site="body",
    group="payload",
    parameters=(
        size("mass", "kg", "mass of the payload, a point", physical=NOT_NEGATIVE),
        _coordinate("x"),
        _coordinate("y"),
        _coordinate("z"),
    ),
    law="a point of the given mass, fixed to the body at (x, y, z) of its frame",
    sentence="{at} carries {mass} more than described, at ({x}, {y}, {z}) of its frame.",
    impossible="a negative payload would mean that the body is lighter than described: correct the mass of the body",
    confused_with={
        "rotor_inertia": "both need effort to accelerate; a payload has weight and loads the joints before it too",
        "bias_force": "they agree where gravity's lever does not change; other poses or fast motion discriminate",
        "spring": "near the hanging position gravity acts like a spring; large angles or fast motion discriminate",
        "torque_ripple": "gravity repeats once per turn; a vertical axis or fast motion discriminates",
    },
    exact=True,
    signature=Signature(
        ("position", "acceleration", "effort"),
        "The course of gravity over the way, or a line over the acceleration where gravity has no lever",
        "Slow motion through several poses, then fast motion",
    ),
)
