"""Unknown zeros of deflection readings, which a diagnosis fits before it asks for forces."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vpm.catalogue import EFFECTS
from vpm.experiment import Experiment
from vpm.model import Model

#: A shifted zero of a sensor, and its size.
ZERO = next(effect for effect in EFFECTS.values() if effect.zero)
(SIZE,) = (parameter.name for parameter in ZERO.parameters)
#: What a diagnosis says of a zero that it fits.
NOTE = (
    "the zero of {channel} is fitted beside the parameters: a deflection is what two readings differ by, and each has "
    "a zero of its own"
)


def with_unknown_zeros(model: Model, records: Sequence[Experiment]) -> tuple[Model, list[str]]:
    """Model whose logged deflections are off by an uncertain constant each, and notes on them.

    Nobody reads the wind-up of a joint or the bending of a link. It is what two readings differ by, and where that was
    called zero says nothing. A constant force on the link would take up such a constant, and a lighter link would hide
    that force from the drive. A zero that the model file states, certain or not, is left as it is. An uncertain one
    lies within what was read.
    """
    if not model.added_joints:
        return model, []
    content, notes = model.to_dict(), list[str]()
    for joint in model.added_joints:
        channel = f"{joint}.position"
        read = [record[channel] for record in records if channel in record]
        largest = float(np.max(np.abs(np.concatenate(read)))) if read else 0.0
        sensor = model.sensor_of(channel)
        stated = any((one.name, one.at) == (ZERO.name, sensor) for one in model.effects)
        if not largest > 0.0 or stated:
            continue
        if sensor is None:
            sensor = f"{joint}_reading"
            content.setdefault("sensors", {})[sensor] = {"measures": channel}
        zero = {"type": ZERO.name, "at": sensor, SIZE: {"value": 0.0, "uncertainty": largest}}
        content.setdefault("effects", []).append(zero)
        notes.append(NOTE.format(channel=channel))
    return (Model(content), notes) if notes else (model, notes)


def zeros_of(model: Model) -> dict[str, str]:
    """Uncertain zeros of a model's deflection readings, each with the channel that it shifts."""
    sensors = {model.sensor_of(f"{joint}.position"): f"{joint}.position" for joint in model.added_joints}
    offsets = [one for one in model.effects if one.type.zero and one.at in sensors]
    return {one.parameter_names[SIZE]: sensors[one.at] for one in offsets}
