"""What a model file states of how well its sensors read."""

from __future__ import annotations

import math
from collections.abc import Iterator

from vpm.model.messages import Problem, place
from vpm.model.parameters import Slot
from vpm.model.schema import Document
from vpm.model.structure import Structure

#: Least noise and resolution that mean anything.
_RANGE = (math.ulp(0.0), math.inf)
#: Variance of a reading that is rounded to steps of 1: those of a uniform distribution.
_ROUNDED = 1.0 / 12.0


def noise_problems(document: Document, structure: Structure) -> Iterator[Problem]:
    """Units that are none of the channel, sizes that are not positive, uncertainties of what is no parameter."""
    for slot in _stated(document, structure):
        given = slot.quantity
        if (given.uncertainty, given.minimum, given.maximum) != (None, None, None):
            yield Problem(place(*slot.keys), "is no parameter: give its value and its unit alone")
        yield from slot.problems()


def stated_noise(document: Document, structure: Structure) -> dict[str, float]:
    """Standard deviation (SI) of readings by channel: noise and rounding, of sensors that state any of them."""
    variances: dict[str, float] = {}
    for slot in _stated(document, structure):
        channel = document.sensors[str(slot.keys[1])].measures
        weight = _ROUNDED if slot.keys[2] == "resolution" else 1.0
        variances[channel] = variances.get(channel, 0.0) + weight * slot.si_quantity().value ** 2
    return {channel: math.sqrt(variance) for channel, variance in variances.items()}


def _stated(document: Document, structure: Structure) -> Iterator[Slot]:
    for name, sensor in document.sensors.items():
        for key in ("noise", "resolution"):
            quantity = getattr(sensor, key)
            if quantity is not None:
                unit = structure.unit(sensor.measures)
                yield Slot(f"{name}.{key}", ("sensors", name, key), quantity, unit, _RANGE, "shape")
