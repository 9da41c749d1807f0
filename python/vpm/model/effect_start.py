"""What an effect begins with that is added to a model: as good as none, as far as nobody says better."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from vpm.catalogue import EffectType, JointKind
from vpm.errors import ModelError
from vpm.model.effects import own_parameters
from vpm.model.joint import TURNING
from vpm.numbers import number_of

if TYPE_CHECKING:
    from vpm.model.model import Model

#: Share of the inertia that a joint moves on the motor side of a spring or play, where nobody says better.
MOTOR_SHARE = 0.1


def starting_values(
    model: Model, effect: EffectType, at: str, joint: str, values: Mapping[str, float]
) -> dict[str, Any]:
    """Values of an effect in the content of a model file.

    - ``at``: component that it sits at
    - ``joint``: joint that it splits, if it splits one
    - ``values``: SI values by short name, as far as they are given
    """
    for short in values:
        effect.parameter(short)
    entry: dict[str, Any] = {}
    kind = kind_at(model, at)
    own = own_parameters(effect, at, model.effects)
    for parameter in effect.parameters:
        if parameter.name not in values and (parameter.optional or parameter not in own):
            continue
        given = values.get(parameter.name, parameter.neutral)
        if given is None:
            given = parameter.default(kind)
        if given is None:
            continue  # the check of the model says what is missing
        if parameter.scale == "inertia" and parameter.shape and parameter.name not in values:
            given = _motor_side(model, effect, joint)
        # Nobody knows beforehand at which velocity a friction law bends; places and periods are told.
        known = parameter.shape and (parameter.name in values or not parameter.learnt)
        number = number_of(given, f"{parameter.name} of {effect.name}", ModelError)
        entry[parameter.name] = number if known else {"value": number, "uncertainty": math.inf}
    return entry


def kind_at(model: Model, at: str) -> JointKind | None:
    """Kind of the joint at which an effect starts, through its drive too; None for a line, a body or a sensor."""
    if at in model.actuators and model.line_of_actuator(at) is None:
        at = model.transmission_of_actuator(at) or model.joint_of_actuator(at)
    return model.joint_kind(at) if at in model.joints else TURNING if at in model.transmissions else None


def _motor_side(model: Model, effect: EffectType, joint: str) -> float:
    """Start value of the inertia before a spring or backlash: a share of what the joint moves at zero."""
    turning = (name for name in model.actuators if model.line_of_actuator(name) is None)
    driving = [name for name in turning if joint in model.joints_of_actuator(name)]
    if joint not in model.joints or (effect.has_play and not driving):
        return 0.0
    known = [f"{joint}.rotor_inertia", f"{joint}.rotor.inertia", *(f"{name}.rotor_inertia" for name in driving)]
    known += [f"{name}.inertia" for name in model.transmissions if joint in model.ratios(name)]
    if any(name in model.parameters for name in known):
        return 0.0
    return MOTOR_SHARE * float(model.masses_at_zero[model.joints.index(joint)])
