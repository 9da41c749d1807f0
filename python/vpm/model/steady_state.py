"""What drives hold in a machine that nobody saw inside: pressures at rest, and what follows the held commands."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from vpm.model.evaluation import Evaluations

Array = NDArray[np.float64]


def rest(model: Evaluations, theta: Array, coordinates: Array) -> Array:
    """States of drives and supplies after a long rest without commands at ``coordinates``.

    Parameters
    ----------
    model : Model
    theta : ndarray, shape (P,)
    coordinates : ndarray, shape (n,)

    Returns
    -------
    ndarray
        In the order of ``model.internal_names``: lags, currents and spools 0, visco-elastic elements settled, chambers
        without net force, supplies at their pressure.
    """
    if all(name.endswith(".lag") for name in model.internal_names):
        return np.zeros(len(model.internal_names))
    return np.array(model.core.internal_state(theta, coordinates))


def follow(model: Evaluations, theta: Array, internal: Array, inputs: Array, velocity: Array) -> None:
    """Let lags, spools and currents settle on held commands, in place.

    Parameters
    ----------
    model : Model
    theta : ndarray, shape (P,)
    internal : ndarray
        In the order of ``model.internal_names``.
    inputs : ndarray, shape (nu,)
        In the order of ``model.inputs``.
    velocity : ndarray, shape (joints,)
        m/s or rad/s.
    """

    def value(name: str) -> float:
        return float(theta[model.index(name)])

    for place, name in enumerate(model.internal_names):
        owner, _, state = name.partition(".")
        if state not in {"lag", "spool", "current"}:
            continue
        command = float(inputs[model.inputs.index(owner)])
        if state == "spool":
            reach = value(f"{owner}.valve.stroke")
            command = float(np.clip(value(f"{owner}.valve.gain") * command, -reach, reach))
        elif state == "current":
            constant = "back_emf" if f"{owner}.back_emf" in model.parameters else "torque_constant"
            rate = value(f"{owner}.gear_ratio") * _turning(model, theta, owner, velocity)
            command = (command - value(f"{owner}.{constant}") * rate) / value(f"{owner}.resistance")
        internal[place] = command


def _turning(model: Evaluations, theta: Array, motor: str, velocity: Array) -> float:
    """How fast the joint or the shaft of a motor turns (rad/s or m/s)."""
    transmission = model.transmission_of_actuator(motor)
    if transmission is None:
        return float(velocity[model.joints.index(model.joint_of_actuator(motor))])
    ratios = model.ratios(transmission).items()
    return float(sum(theta[model.index(name)] * velocity[model.joints.index(joint)] for joint, name in ratios))
