"""Finite Fourier series as motions of joints: exact derivatives, and bounds that hold between samples."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vpm.excitation.excitation import Excitation
from vpm.excitation.limits import JointLimits
from vpm.numbers import Array

#: Points for every period of the highest harmonic where bounds are taken.
POINTS = 24


@dataclass(frozen=True, repr=False, eq=False)
class FourierTrajectory(Excitation):
    """Periodic motion of several joints, designed for the parameters of a model.

    ``v(t) = sum_l a_l cos(l w t) + b_l sin(l w t)``, its integral about the offset is the position (J. Swevers et al.,
    "Optimal robot excitation and identification", *IEEE Trans. Robotics and Automation* 13, 1997).
    """

    joints: tuple[str, ...]
    offset: Array  #: Shape (n,); position about which a joint moves, rad or m.
    #: Shape (n, harmonics); ``a`` and ``b``, rad/s or m/s.
    cosine: Array
    sine: Array
    fundamental: float  #: ``w / 2 pi``, Hz.
    parameters: tuple[str, ...]  #: Base parameters that the motion is for.
    criterion: str  #: What was made least, ``"condition"`` or ``"determinant"``.
    #: Condition number of the regressor: of its columns for a change by the uncertainty of each parameter, of its rows
    #: in shares of the effort limits.
    condition: float
    start_conditions: Array  #: Condition numbers of the random motions that the search began with.

    def at(self, time: Array) -> tuple[Array, Array, Array]:
        """Fourier motion at any times: position, velocity and acceleration, each of shape (N, n)."""
        return motion_at(np.asarray(time, dtype=np.float64), self.fundamental, self.offset, self.cosine, self.sine)

    def _headline(self) -> Mapping[str, object]:
        shown = {"joints": self.joints, "period": 1.0 / self.fundamental, "harmonics": self.cosine.shape[1]}
        return {**shown, "condition": self.condition, "samples": len(self)}


def motion_at(time: Array, fundamental: float, offset: Array, cosine: Array, sine: Array) -> tuple[Array, Array, Array]:
    """Motion of a Fourier series: position, velocity and acceleration, each of shape (N, n)."""
    rate = 2.0 * np.pi * fundamental * np.arange(1, cosine.shape[1] + 1)
    angle = np.outer(time, rate)
    c, s = np.cos(angle), np.sin(angle)
    position = offset + s @ (cosine / rate).T - c @ (sine / rate).T
    velocity = c @ cosine.T + s @ sine.T
    acceleration = c @ (sine * rate).T - s @ (cosine * rate).T
    return position, velocity, acceleration


def at_rest(cosine: Array, sine: Array) -> tuple[Array, Array]:
    """Nearest Fourier coefficients whose motion begins at rest: ``sum a = 0, sum l b = 0``."""
    lines = np.arange(1, cosine.shape[1] + 1)
    still = cosine - cosine.mean(axis=1, keepdims=True)
    return still, sine - np.outer(sine @ lines, lines) / float(lines @ lines)


def bound_grid(harmonics: int) -> tuple[int, float]:
    """Points of a Fourier period, and a factor that bounds the wave between them.

    ``1 / cos(pi n / M)`` for n harmonics on M points (H. Ehlich and K. Zeller, *Mathematische Zeitschrift* 86, 1964).
    """
    count = POINTS * harmonics
    return count, 1.0 / float(np.cos(np.pi * harmonics / count))


def within_limits(
    fundamental: float, offset: Array, cosine: Array, sine: Array, limits: list[JointLimits]
) -> tuple[Array, Array]:
    """Fourier coefficients, scaled joint by joint until the first limit of motion is touched."""
    count, factor = bound_grid(cosine.shape[1])
    time = np.arange(count) / (count * fundamental)
    position, velocity, acceleration = motion_at(time, fundamental, np.zeros_like(offset), cosine, sine)
    slack = (factor - 1.0) * np.max(np.abs(position), axis=0)
    up, down = np.max(position, axis=0) + slack, -np.min(position, axis=0) + slack
    speed, rate = (factor * np.max(np.abs(x), axis=0) for x in (velocity, acceleration))
    scales = [
        min(
            (limit.position[1] - offset[j]) / up[j],
            (offset[j] - limit.position[0]) / down[j],
            limit.speed / speed[j],
            limit.acceleration / rate[j],
        )
        for j, limit in enumerate(limits)
    ]
    scale = np.array(scales)[:, None]
    return cosine * scale, sine * scale
