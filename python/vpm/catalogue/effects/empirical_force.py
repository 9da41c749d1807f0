"""A force without a law: what is left to write down when no effect explains a residual.

It keeps the range that was seen when it was fitted, and outside of it stays what it is at the edge: no polynomial runs
away. Its coefficients are the efforts of their terms at that edge, so that they can be compared with each other.

Source: data alone.
"""

from dataclasses import replace

from vpm.catalogue.empirical import TERMS
from vpm.catalogue.kinds import ABOVE_ZERO, ANY, EffectParameter, EffectType, shape, size
from vpm.catalogue.signature import Signature


def _shape(
    name: str, unit: str, meaning: str, start: float | None, bounds: tuple[float, float] = ABOVE_ZERO
) -> EffectParameter:
    return shape(name, unit, meaning, start=start, bounds=bounds)


def _term(name: str, text: str) -> EffectParameter:
    of_load = name.startswith("load")
    entry = size(name, "1" if of_load else "{E}", f"coefficient of {text}")
    return replace(entry, optional=True)


EFFECT = EffectType(
    name="empirical_force",
    site="joint",
    group="empirical",
    parameters=(
        _shape("middle", "{C}", "middle of the range of positions that was seen", 0.0, ANY),
        _shape("reach", "{C}", "half of that range", None),
        _shape("speed", "{C}/s", "largest speed that was seen", None),
        _shape("transition_velocity", "{C}/s", "speed below which dry terms bend from one sign to the other", None),
        replace(
            _shape("period", "{C}", "way after which cosines and sines repeat; twice the reach if not given", None),
            optional=True,
        ),
        *(_term(name, text) for name, text in TERMS.items()),
    ),
    law=(
        "tau = -(sum of coefficient times term): "
        + ", ".join(f"{name} {text}" for name, text in TERMS.items())
        + "; x = (q - middle)/reach and y = v/speed, held at -1 and 1, s = tanh(v/transition_velocity), "
        "phi = 2 pi q/period, u the effort of the actuators on the joint"
    ),
    sentence="{at} is loaded by a force that was fitted to data and that no law of physics stands behind.",
    impossible="either sign is possible: it is a fit",
    motor_side_alone=True,
    signature=Signature(
        ("velocity", "position", "acceleration", "effort", "command"),
        "Whatever the sparse formula says over the states that it was found in",
        "The motion over which it has to predict: it is not physics, and says nothing beyond",
    ),
)
