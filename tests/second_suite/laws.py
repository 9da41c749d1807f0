"""Forces on one coordinate, from the physical laws: what springs, drags, stops, and what slides.

Forces that dry friction may take up to a limit are no functions of the velocity: `dry` gives the two limits, and
`second_suite.plant` finds within them the force that lets the contact stick, or slide (Coulomb's law as an inclusion).
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Numbers = Mapping[str, float]

#: Yield ways of the Maxwell slip elements relative to the stated way, and their shares of the force (they add to one).
YIELD_WAYS = np.array([0.2, 0.5, 1.0, 1.8, 3.0])
SHARES = np.array([0.15, 0.25, 0.3, 0.2, 0.1])
#: Share of the second harmonic of a cogging torque.
SECOND_HARMONIC = 0.2


class MaxwellSlip:
    """Elastic elements side by side, each of which slides at a force of its own (Iwan 1966): rate-independent."""

    def __init__(self, values: Numbers, columns: int) -> None:
        self.limits = (values["force"] * SHARES)[:, None]
        self.stiffness = self.limits / (values["way"] * YIELD_WAYS)[:, None]
        self.forces = np.zeros((len(SHARES), columns))

    def moved(self, way: Array) -> Array:
        """The force on the coordinate after it moved a little further."""
        self.forces = np.clip(self.forces + self.stiffness * way, -self.limits, self.limits)
        total: Array = -self.forces.sum(axis=0)
        return total


def smooth(name: str, values: Numbers, q: Array, v: Array) -> Array | None:
    """The force of a law that is a function of place and speed; None if the law is none of these."""
    force: Array
    if name == "viscous_friction":
        force = -values["viscous"] * v
    elif name == "bias_force":
        force = np.full_like(q, -values["force"])
    elif name == "spring":
        force = -values["stiffness"] * (q - values["rest"])
    elif name == "cubic_spring":
        force = -values["stiffness"] * (q - values["rest"]) ** 3
    elif name == "quadratic_drag":
        force = -values["drag"] * v * np.abs(v)
    elif name == "asymmetric_friction":
        force = -np.where(v > 0.0, values["viscous_up"], values["viscous_down"]) * v
    elif name == "torque_ripple":
        angle = 2.0 * np.pi * q / values["period"] + values["phase"]
        force = -values["size"] * (np.sin(angle) + SECOND_HARMONIC * np.sin(2.0 * angle))
    elif name == "end_stop":
        force = _stop(values, q, v)
    else:
        return None
    return force


def _stop(values: Numbers, q: Array, v: Array) -> Array:
    """A buffer beyond one end of the way (Hunt and Crossley 1975); ``side`` is 1 for the upper end and -1 else."""
    depth = np.maximum(values["side"] * (q - values["end"]), 0.0)
    push = values["stiffness"] * depth * (1.0 + values["damping"] * values["side"] * v)
    force: Array = -values["side"] * np.maximum(push, 0.0)
    return force


def dry(name: str, values: Numbers, q: Array, v: Array, time: float, load: Array) -> tuple[Array, Array] | None:
    """Limits of the dry friction against upward and against downward motion; None if the law has none."""
    if name == "asymmetric_friction":
        return np.full_like(q, values["coulomb_up"]), np.full_like(q, values["coulomb_down"])
    level: Array
    if name == "stribeck_friction":
        level = values["stribeck"] / (1.0 + (v / values["speed"]) ** 2)
    elif name == "coulomb_friction":
        level = np.full_like(q, values["coulomb"])
    elif name == "warming_friction":
        level = np.full_like(q, values["coulomb"] * np.exp(-time / values["time"]))
    elif name == "position_dependent_friction":
        level = values["coulomb"] * (0.5 + 0.5 * np.sin(2.0 * np.pi * q / values["period"]))
    elif name == "load_dependent_friction":
        level = values["share"] * np.abs(load)
    else:
        return None
    return level, level


def coupling(name: str, values: Numbers, windup: Array, rate: Array) -> Array:
    """The effort that a soft or loose gear passes on from the motor to the load."""
    if name == "joint_compliance":
        passed: Array = values["stiffness"] * windup + values["damping"] * rate
        return passed
    half = 0.5 * values["gap"]
    depth = windup - np.clip(windup, -half, half)
    push = values["stiffness"] * depth + values["damping"] * rate * (depth != 0.0)
    # Teeth push and never pull.
    one_sided: Array = np.where(depth > 0.0, np.maximum(push, 0.0), np.minimum(push, 0.0))
    return one_sided
