"""The state in which the machine of a run begins."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from vpm.errors import near_match
from vpm.model import Model
from vpm.scenario.messages import refuse
from vpm.scenario.schema import Document
from vpm.scenario.values import si_value
from vpm.stepping import Simulation

Array = NDArray[np.float64]


def start_state(document: Document, owner: str, model: Model) -> Array:
    """State at time zero, shape (nx,).

    What the scenario names is as it says. Else joints are at zero and at rest, flexible links are deflected as in
    their equilibrium there, and drives are as in a machine that has stood there without commands.

    Raises
    ------
    ScenarioError
        A name is no state of the machine, a unit is wrong, or there is no equilibrium.
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
    if not any(name in document.initial for name in names[joints:coordinates]):
        _deflect(state, joints, coordinates, owner, model)
    if not hasattr(model.core, "internal_state"):
        return state
    settled = model.core.internal_state(model.theta, state[:coordinates])
    for column, name in enumerate(names[2 * coordinates :]):
        if name not in document.initial:
            state[2 * coordinates + column] = settled[column]
    return state


def _deflect(state: Array, joints: int, coordinates: int, owner: str, model: Model) -> None:
    """Put flexible links into the deflection of their equilibrium."""
    if coordinates == joints:
        return
    try:
        state[:coordinates] = model.equilibrium(state[:joints])[0]
    except ValueError as error:
        rest = f"leaves the flexible links of {owner} without an equilibrium ({error})"
        refuse("initial", f"{rest}; name another position, or states of the links")


def held_references(model: Model, state: Array, given: tuple[str, ...]) -> Mapping[str, tuple[float, str]]:
    """References that a scenario does not give: each holds what its controller measures at the beginning.

    Returns
    -------
    mapping of str to (float, str)
        Channel to its value (SI) and to a sentence that says so.
    """
    missing = [name for name in model.controlled_actuators if f"{name}.reference" not in given]
    if not missing:
        return {}
    # What the sensors show before anything moves; it depends on no step.
    seen = Simulation(model, 1e-3, state=state)
    held = {}
    for actuator in missing:
        channel = model.held_channel(actuator)
        unit = model.channel_unit(channel)
        sentence = f"{actuator} has no reference, so it holds {channel} at its initial {seen[channel]:.6g} {unit}."
        held[f"{actuator}.reference"] = (float(seen[channel]), sentence)
    return held
