"""The state from which a simulation of a log starts, from what was measured."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vpm.experiment import Experiment, motion
from vpm.model import Model

Array = NDArray[np.float64]


def measured_states(model: Model, experiment: Experiment, theta: Array, cutoff: float | None) -> Array:
    """State (N, states) along the measured motion: sensor errors undone, lags settled at the held command."""
    m = motion(experiment, model, cutoff=cutoff)
    gain, offset = _sensor_errors(model, theta)
    lags = [i for i, name in enumerate(model.actuators) if model.has_lag(name)]
    return np.ascontiguousarray(
        np.column_stack([(m.position - offset) / gain, m.velocity / gain, m.inputs[:, lags]]), dtype=np.float64
    )


def initial_state(model: Model, experiment: Experiment, theta: Array) -> Array:
    """State at the first sample: at rest at zero where the log holds no position, lags settled at the command."""
    n = len(model.joints)
    state = np.zeros(model.core.n_states)
    gain, offset = _sensor_errors(model, theta)
    lags = [name for name in model.actuators if model.has_lag(name)]
    for place, name in enumerate(lags):
        if f"{name}.command" in experiment:
            state[2 * n + place] = experiment[f"{name}.command"][0]
    for joint, name in enumerate(model.joints):
        if f"{name}.position" in experiment:
            position, velocity = _fit_start(experiment, f"{name}.position")
            state[joint] = (position - offset[joint]) / gain[joint]
            state[n + joint] = velocity / gain[joint]
    return state


def _fit_start(experiment: Experiment, channel: str, samples: int = 15) -> tuple[float, float]:
    """Position and velocity at the first sample from a parabola through the first few."""
    count = min(samples, len(experiment))
    time = experiment.time[:count] - experiment.time[0]
    curve = np.polynomial.Polynomial.fit(time, experiment[channel][:count], min(2, count - 1)).convert()
    coefficients = np.append(curve.coef, [0.0, 0.0])
    return float(coefficients[0]), float(coefficients[1])


def _sensor_errors(model: Model, theta: Array) -> tuple[Array, Array]:
    """Gain and offset of the position sensor of each joint (1 and 0 where none is modelled)."""
    gain, offset = np.ones(len(model.joints)), np.zeros(len(model.joints))
    for joint, name in enumerate(model.joints):
        sensor = model.sensor_of(f"{name}.position")
        for index, key, target in ((joint, "gain.value", gain), (joint, "offset.value", offset)):
            full = f"{sensor}.{key}"
            if sensor is not None and full in model.parameters:
                target[index] = theta[model.index(full)]
    return gain, offset
