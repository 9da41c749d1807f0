"""What drives the machine of a run: references, commands and pressures as samples, in the channels of its model."""

from collections.abc import Iterator, Mapping

import numpy as np

from vpm.errors import near_match
from vpm.model import Model
from vpm.numbers import Array
from vpm.scenario import signals
from vpm.scenario.clock import Clock
from vpm.scenario.messages import Keys, refuse
from vpm.scenario.schema import Chirp, Constant, Document, Given, Listed, Points, Signal, Sine, si_value
from vpm.units import parse_unit


def given_inputs(document: Document, owner: str, model: Model, clock: Clock) -> Mapping[str, Array]:
    """Input samples of every channel that the scenario drives, by channel of the model."""
    return {
        channel: sampled(signal, keys, model.channel_unit(channel), clock)
        for channel, keys, signal in _driven(document, owner, model)
    }


def _driven(document: Document, owner: str, model: Model) -> Iterator[tuple[str, Keys, Signal]]:
    for name, signal in document.references.items():
        keys = ("references", name)
        _check_known(name, model.actuators, "actuator", owner, keys)
        if name not in model.controlled_actuators:
            rest = f"is for an actuator that no controller commands in {owner}"
            refuse(keys, f"{rest}; write [commands.{name}], or add a controller to {model.name}")
        yield f"{name}.reference", keys, signal
    for name, signal in document.commands.items():
        keys = ("commands", name)
        _check_known(name, model.actuators, "actuator", owner, keys)
        if name in model.controlled_actuators:
            refuse(keys, f"is for an actuator that a controller commands in {owner}; write [references.{name}]")
        yield f"{name}.command", keys, signal
    for name, signal in document.supplies.items():
        _check_known(name, model.logged_supplies, 'supply with source = "logged"', owner, ("supplies", name))
        yield f"{name}.pressure", ("supplies", name), signal


def _check_known(name: str, known: tuple[str, ...], what: str, owner: str, keys: Keys) -> None:
    if name not in known:
        refuse(keys, f"is no {what} of {owner}; {near_match(name, known, what='it has')}")


def sampled(signal: Signal, keys: Keys, unit: str, clock: Clock) -> Array:
    """Input samples of a signal, shape (steps + 1,), SI.

    - ``keys``: its place in the file
    - ``unit``: SI unit of the channel that it drives

    Raises `ScenarioError`: a number has a unit of another kind, a frequency cannot be sampled, or points are not in
    order.
    """

    def size(given: Given, key: str) -> float:
        return si_value(given, unit, (*keys, key))

    match signal:
        case Constant():
            return np.full(clock.steps + 1, size(signal.value, "value"))
        case Sine():
            return signals.sine(
                clock.time,
                size(signal.mean, "mean"),
                size(signal.amplitude, "amplitude"),
                _frequency(signal.frequency, (*keys, "frequency"), clock),
                si_value(signal.phase, "rad", (*keys, "phase")),
                si_value(signal.start, "s", (*keys, "start")),
            )
        case Chirp():
            first = _frequency(signal.first, (*keys, "from"), clock)
            last = _frequency(signal.last, (*keys, "to"), clock)
            mean, amplitude = size(signal.mean, "mean"), size(signal.amplitude, "amplitude")
            return signals.chirp(clock.time, mean, amplitude, first, last, clock.duration)
        case Points():
            return _points(signal, keys, unit, clock)


def _frequency(given: Given, keys: Keys, clock: Clock) -> float:
    """Frequency of an input in Hz, also from angular velocities, ``rad/s`` or ``rpm``."""
    value = si_value(given, "Hz", keys)
    if given.unit is not None and parse_unit(given.unit).si == "rad/s":
        value /= 2.0 * np.pi
    highest = 0.5 / clock.time_step
    if not 0.0 <= value < highest:
        rest = f"is {value:g} Hz, but samples every {clock.time_step:g} s carry 0 to {highest:g} Hz only"
        refuse(keys, f"{rest}; correct it or shorten time_step")
    return value


def _points(signal: Points, keys: Keys, unit: str, clock: Clock) -> Array:
    time = _listed(signal.time, "s", (*keys, "time"))
    value = _listed(signal.value, unit, (*keys, "value"))
    if len(time) != len(value):
        refuse(keys, f"has {len(time)} times and {len(value)} values; give one value for each time")
    back = np.flatnonzero(np.diff(time) < 0.0)
    if back.size:
        first = int(back[0])
        rest = f"goes back from {time[first]:g} s to {time[first + 1]:g} s; put the points in the order of time"
        refuse((*keys, "time"), rest)
    return signals.points(clock.time, time, value, clock.time_step)


def _listed(given: Listed, unit: str, keys: Keys) -> Array:
    return np.array([si_value(Given(value=value, unit=given.unit), unit, keys) for value in given.value])
