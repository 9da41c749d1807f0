"""The state in which the machine of a run begins."""

from collections.abc import Collection, Mapping

import numpy as np

from vpm.errors import ModelError, near_match
from vpm.model import Model
from vpm.model.drives.states import rest
from vpm.model.loops.states import close, kept
from vpm.numbers import Array
from vpm.scenario.messages import refuse
from vpm.scenario.schema import Document, si_value
from vpm.stepping import Simulation


def start_state(document: Document, owner: str, model: Model, inputs: Mapping[str, Array]) -> Array:
    """Start state at time zero, shape (nx,).

    What the scenario names is as it says. Else joints are at zero and at rest, or close loops, flexible links are
    deflected as in their equilibrium there, and drives are as in a machine that has stood there without commands, its
    logged supplies at their first pressure.

    ``owner``: what to call the machine in messages; ``inputs``: what the scenario gives, by channel.
    """
    names = model.state_names
    state = np.zeros(len(names))
    for name, given in document.initial.items():
        keys = ("initial", name)
        if name not in names:
            refuse(keys, f"is no state of {owner}; {near_match(name, names, what='it has')}")
        column = names.index(name)
        state[column] = si_value(given, model.state_units[column], keys)
    joints, coordinates = len(model.joints), len(model.coordinates)
    if model.loops:
        try:
            close(model, state, {name: float(state[names.index(name)]) for name in document.initial})
        except ModelError as error:
            refuse("initial", f"leaves {owner} open: {error}")
    if not any(name in document.initial for name in names[joints:coordinates]):
        _deflect(state, joints, coordinates, owner, model)
    theta = model.theta.copy()
    for supply in model.logged_supplies:
        if f"{supply}.pressure" in inputs:
            theta[model.index(f"{supply}.pressure")] = inputs[f"{supply}.pressure"][0]
    settled = rest(model, theta, state[:coordinates])
    for column, name in enumerate(names[2 * coordinates :]):
        if name not in document.initial:
            state[2 * coordinates + column] = settled[column]
    return state


def _deflect(state: Array, joints: int, coordinates: int, owner: str, model: Model) -> None:
    """Deflect flexible links at the start as in equilibrium."""
    if coordinates == joints:
        return
    try:
        state[:coordinates] = model.equilibrium(state[:joints])[0]
        if model.loops:
            kept(model, state)
    except ValueError as error:
        rest = f"leaves the flexible links of {owner} without an equilibrium ({error})"
        refuse("initial", f"{rest}; name another position, or states of the links")


def held_inputs(model: Model, state: Array, given: Collection[str]) -> Mapping[str, tuple[float, str]]:
    """Inputs at the start that a scenario does not give and that are not zero.

    A reference holds what its controller measures at the beginning, a pressure is that of the model file.

    Result: channel to its value (SI) and to a sentence that says so.
    """
    return {**_held_references(model, state, given), **_kept_pressures(model, given)}


def _held_references(model: Model, state: Array, given: Collection[str]) -> dict[str, tuple[float, str]]:
    held: dict[str, tuple[float, str]] = {}
    missing = [name for name in model.controlled_actuators if f"{name}.reference" not in given]
    if not missing:
        return held
    seen = Simulation(model, 1e-3, state=state)  # what the sensors show before anything moves; it depends on no step
    for actuator in missing:
        channel = model.held_channel(actuator)
        value = seen[channel]
        shown = f"{value:.6g} {model.channel_unit(channel)}"
        held[f"{actuator}.reference"] = (
            value,
            f"{actuator} has no reference, so it holds {channel} at its initial {shown}.",
        )
    return held


def _kept_pressures(model: Model, given: Collection[str]) -> dict[str, tuple[float, str]]:
    kept = {}
    for supply in model.logged_supplies:
        channel = f"{supply}.pressure"
        if channel not in given:
            value = model.parameters[channel].value
            kept[channel] = (value, f"{supply} has no pressure over time, so it keeps the {value:.6g} Pa of its model.")
    return kept
