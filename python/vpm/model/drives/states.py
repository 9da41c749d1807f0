"""What drives hold in a machine that nobody saw inside: at rest, behind held commands, and along those of a record.

Lags and spools are linear and know no motion. Between samples a command is held; the response to that is exact for a
lag and for a spool alone (G. F. Franklin, J. D. Powell and M. L. Workman, "Digital Control of Dynamic Systems", 1998,
section 4.3). A spool behind a lag is given the mean of the lag over each interval.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from vpm.numbers import Array

if TYPE_CHECKING:
    from vpm.model.evaluation import Evaluations

#: Value of a parameter by its dotted name; the second number where the model has none.
Value = Callable[[str, float], float]


def rest(model: Evaluations, theta: Array, coordinates: Array) -> Array:
    """States of drives and supplies after a long rest without commands at ``coordinates``.

    - ``theta``: shape (P,)
    - ``coordinates``: shape (n,)

    Result: in the order of ``model.internal_names``: lags, currents and spools 0, visco-elastic elements settled,
    chambers without net force, supplies at their pressure.
    """
    if all(name.endswith(".lag") for name in model.internal_names):
        return np.zeros(len(model.internal_names))
    return np.array(model.core.internal_state(theta, coordinates))


def follow(model: Evaluations, theta: Array, internal: Array, inputs: Array, velocity: Array) -> None:
    """Let states of lags, spools and currents settle on held commands, in place.

    - ``theta``: shape (P,)
    - ``internal``: in the order of ``model.internal_names``
    - ``inputs``: shape (nu,), in the order of ``model.inputs``
    - ``velocity``: shape (joints,), m/s or rad/s
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
    """Speed of a motor's joint or shaft (rad/s or m/s), for its states."""
    transmission = model.transmission_of_actuator(motor)
    if transmission is None:
        return float(velocity[model.joints.index(model.joint_of_actuator(motor))])
    ratios = model.ratios(transmission).items()
    return float(sum(theta[model.index(name)] * velocity[model.joints.index(joint)] for joint, name in ratios))


def commanded_states(model: Evaluations, theta: Array, inputs: Array, dt: float) -> dict[str, Array]:
    """States of lags and spools at every sample of a record, which begins with them settled.

    ``theta``: shape (P,); ``inputs``: shape (N, nu), in the order of ``model.inputs``; ``dt``: s.
    Result: each of shape (N,), by name of the state, as in ``model.internal_names``.
    """

    def value(name: str, missing: float) -> float:
        return float(theta[model.index(name)]) if name in model.parameters else missing

    found: dict[str, Array] = {}
    for number, name in enumerate(model.actuators):
        lag, spool = (f"{name}.{state}" in model.internal_names for state in ("lag", "spool"))
        if not (lag or spool):
            continue
        driving = _through_links(inputs[:, number], name, value, dt)
        if lag:
            found[f"{name}.lag"], driving = _lagged(driving, value(f"{name}.lag.time_constant", 1.0), dt)
        if spool:
            reach = value(f"{name}.valve.stroke", np.inf)
            target = np.clip(value(f"{name}.valve.gain", 1.0) * driving, -reach, reach)
            found[f"{name}.spool"], found[f"{name}.spool_rate"] = _spool(target, name, value, dt)
    return found


def _through_links(command: Array, name: str, value: Value, dt: float) -> Array:
    """Command (N,) after delay, dead zone and saturation of a drive, for its states."""
    samples = np.arange(command.size, dtype=np.float64)
    late = np.interp(samples - value(f"{name}.delay.time", 0.0) / dt, samples, command)
    width = value(f"{name}.dead_zone.width", 0.0)
    limit = value(f"{name}.saturation.limit", np.inf)
    return np.asarray(np.clip(np.sign(late) * np.maximum(np.abs(late) - width, 0.0), -limit, limit))


def _lagged(held: Array, time_constant: float, dt: float) -> tuple[Array, Array]:
    """State of a lag at every sample, and its mean over the interval that follows."""
    from scipy.signal import lfilter  # slow to import, and seldom needed

    decay = float(np.exp(-dt / time_constant))
    state = held[0] + np.asarray(lfilter([0.0, 1.0 - decay], [1.0, -decay], held - held[0]))
    return state, held + (state - held) * time_constant / dt * (1.0 - decay)


def _spool(held: Array, name: str, value: Value, dt: float) -> tuple[Array, Array]:
    """States of a spool at every sample: place and rate."""
    from scipy.signal import cont2discrete, lfilter

    frequency = value(f"{name}.valve.frequency", 1.0)
    frequency /= 1.0 + frequency * value(f"{name}.valve_dynamics.time", 0.0)
    damping = value(f"{name}.valve.damping", 0.0)
    a = np.array([[0.0, 1.0], [-(frequency**2), -2.0 * damping * frequency]])
    stepped = cont2discrete((a, np.array([[0.0], [frequency**2]]), np.eye(2), np.zeros((2, 1))), dt)
    transition, drive = np.asarray(stepped[0]), np.asarray(stepped[1])[:, 0]
    trace, determinant = float(np.trace(transition)), float(np.linalg.det(transition))
    # (z I - A)^-1 B of a 2x2 matrix by its adjugate.
    adjugate = transition @ drive - trace * drive
    rows = [
        np.asarray(lfilter([0.0, drive[k], adjugate[k]], [1.0, -trace, determinant], held - held[0])) for k in (0, 1)
    ]
    return held[0] + rows[0], rows[1]
