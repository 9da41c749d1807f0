"""Sensors: which channel each reads, and what a model file states of how well."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from vpm.errors import near_match
from vpm.model.component import Component, Described, Index
from vpm.model.entry import ParameterValue, Text
from vpm.model.messages import Problem, place
from vpm.model.outputs import described_channel
from vpm.model.parameters import Range, Slot

if TYPE_CHECKING:
    from vpm.model.schema import Document
    from vpm.model.structure import Structure

#: Least noise and resolution that mean anything.
_RANGE: Range = (math.ulp(0.0), math.inf)
#: Variance of a reading that is rounded to steps of 1: those of a uniform distribution.
_ROUNDED = 1.0 / 12.0


class Sensor(Component):
    """Sensor that reads one channel, with noise and resolution."""

    measures: Text
    noise: ParameterValue | None = None  #: Standard deviation of what is independent from sample to sample.
    resolution: ParameterValue | None = None  #: Step between two readings that it can show.

    def stated(self, name: str, structure: Structure) -> Iterator[Slot]:
        """Values that a sensor states and that are no parameters."""
        for key in ("noise", "resolution"):
            quantity = getattr(self, key)
            if quantity is not None:
                yield Slot(("sensors", name, key), quantity, structure.unit(self.measures), _RANGE)

    def described(self, name: str, structure: Structure, index: Index) -> Described:
        """What the core reads of a sensor."""
        effects = {key: index.get(f"{name}.{key}.{last}") for key, last in _EFFECTS.items()}
        return {"name": name, "channel": described_channel(self.measures, structure), **effects}


#: What effects do to its reading: group and parameter.
_EFFECTS = {"gain": "value", "offset": "value", "delay": "time"}


def sensor_problems(document: Document, structure: Structure) -> Iterator[Problem]:
    """Problems of sensors: readings of what is not there, or of what is read already."""
    seen: dict[str, str] = {}
    for name, sensor in document.sensors.items():
        where, read = place("sensors", name, "measures"), sensor.measures
        if read not in structure.outputs:
            repair = near_match(read, structure.outputs, what="it can measure")
            yield Problem(where, f'is "{read}", which is no output of the model; {repair}')
        elif read in seen:
            yield Problem(where, f'is "{read}", which sensor "{seen[read]}" already reads; remove one')
        seen.setdefault(read, name)


def noise_problems(document: Document, structure: Structure) -> Iterator[Problem]:
    """Problems of sensor noise: wrong units, sizes that are not positive, useless uncertainties."""
    for name, sensor in document.sensors.items():
        for slot in sensor.stated(name, structure):
            given = slot.quantity
            if (given.uncertainty, given.minimum, given.maximum) != (None, None, None):
                yield Problem(place(*slot.keys), "is no parameter: give its value and its unit alone")
            yield from slot.problems()


def stated_noise(document: Document, structure: Structure) -> dict[str, float]:
    """Standard deviation (SI) of readings by channel: noise and rounding, of sensors that state any of them."""
    variances: dict[str, float] = {}
    for name, sensor in document.sensors.items():
        for slot in sensor.stated(name, structure):
            weight = _ROUNDED if slot.keys[2] == "resolution" else 1.0
            variances[sensor.measures] = variances.get(sensor.measures, 0.0) + weight * slot.si_quantity().value ** 2
    return {channel: math.sqrt(variance) for channel, variance in variances.items()}
