"""What lags and spools do to the commands of a whole record: linear dynamics, and no motion enters.

Between samples a command is held; the response to that is exact for a lag and for a spool alone (G. F. Franklin, J. D.
Powell and M. L. Workman, "Digital Control of Dynamic Systems", 1998, section 4.3). A spool behind a lag is given the
mean of the lag over each interval.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from vpm.model.evaluation import Evaluations

Array = NDArray[np.float64]

#: Value of a parameter by its dotted name; the second number where the model has none.
Value = Callable[[str, float], float]


def commanded_states(model: Evaluations, theta: Array, inputs: Array, dt: float) -> dict[str, Array]:
    """Lags, spools and rates of spools at every sample of a record, which begins with them settled.

    Parameters
    ----------
    model : Model
    theta : ndarray, shape (P,)
    inputs : ndarray, shape (N, nu)
        In the order of ``model.inputs``.
    dt : float
        s.

    Returns
    -------
    dict of str to ndarray, shape (N,)
        By name of the state, as in ``model.internal_names``.
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
    """What is left of a command after delay, dead zone and saturation."""
    samples = np.arange(command.size, dtype=np.float64)
    late = np.interp(samples - value(f"{name}.delay.time", 0.0) / dt, samples, command)
    width = value(f"{name}.dead_zone.width", 0.0)
    limit = value(f"{name}.saturation.limit", np.inf)
    return np.asarray(np.clip(np.sign(late) * np.maximum(np.abs(late) - width, 0.0), -limit, limit))


def _lagged(held: Array, time_constant: float, dt: float) -> tuple[Array, Array]:
    """A lag at every sample, and its mean over the interval that follows."""
    from scipy.signal import lfilter  # slow to import, and seldom needed

    decay = float(np.exp(-dt / time_constant))
    state = held[0] + np.asarray(lfilter([0.0, 1.0 - decay], [1.0, -decay], held - held[0]))
    return state, held + (state - held) * time_constant / dt * (1.0 - decay)


def _spool(held: Array, name: str, value: Value, dt: float) -> tuple[Array, Array]:
    """Place and rate of a spool at every sample."""
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
