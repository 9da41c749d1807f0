"""Designed motions for a discriminating experiment within limits: slow and fast ways, a chirp, a multisine."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from vpm.discrepancy.rivals.excitation_range import ExcitationRange
from vpm.excitation import Excitation, JointLimits, chirp, multisine, trapezoid
from vpm.numbers import Array

#: Longest experiment, s, and most samples of one.
LONGEST, MOST_SAMPLES = 60.0, 20000
#: Share of the range seen that is used, so that a controller's overshoot stays within it.
WITHIN = 0.9
#: Speeds of the trapezoids as shares of the largest one seen; the slow ones creep through the reversal.
SPEEDS = (1.0, 0.3, 0.05, 0.01)
#: Amplitudes of chirps and multisines as shares of half the range.
AMPLITUDES = (1.0, 0.3, 0.05)
#: Duration of a chirp and period of a multisine, s.
DURATION = 20.0


@dataclass(frozen=True)
class Motion:
    """Designed motion: an excitation, and the motion of all joints (n, joints) that it means."""

    excitation: Excitation
    parameters: Mapping[str, float | str]
    position: Array
    velocity: Array
    acceleration: Array

    @property
    def time_step(self) -> float:
        """Time step of a designed motion, s."""
        return self.excitation.time_step


def designs(seen: ExcitationRange) -> list[Callable[[], Motion]]:
    """Designed motions to choose from; each raises `ExcitationError` if it does not fit into the limits."""
    ways = [partial(_way, seen, share) for share in SPEEDS]
    waves = [partial(design, seen, share) for share in AMPLITUDES for design in (_chirp, _multisine)]
    return [*ways, *waves]


def _way(seen: ExcitationRange, share: float) -> Motion:
    """Designed motion back and forth at constant speed with rests; a slow one uses the time available."""
    speed = share * seen.speed
    middle, half = 0.5 * (seen.low + seen.high), 0.5 * WITHIN * (seen.high - seen.low)
    half = min(half, 0.05 * LONGEST * speed)
    limits = {seen.joint: JointLimits((seen.low, seen.high), speed, seen.acceleration)}
    points = {seen.joint: [middle - half, middle + half, middle - half, middle, middle + half, middle - half]}
    step = _step(seen, LONGEST)
    made = trapezoid(points, limits, time_step=step, dwell=0.5, unit=seen.unit)
    numbers = {"speed": speed, "amplitude": half, "offset": middle, "acceleration": seen.acceleration, "dwell": 0.5}
    motion = (made[f"{seen.joint}.{quantity}"] for quantity in ("position", "velocity", "acceleration"))
    return _motion(seen, made, numbers, *motion)


def _chirp(seen: ExcitationRange, share: float) -> Motion:
    middle, amplitude = 0.5 * (seen.low + seen.high), 0.5 * WITHIN * share * (seen.high - seen.low)
    fastest = _fastest(seen, amplitude)
    first = max(0.1 * fastest, 2.0 / DURATION)
    made = chirp(
        f"{seen.joint}.position",
        seen.unit,
        first=min(first, fastest),
        last=fastest,
        amplitude=amplitude,
        duration=DURATION,
        time_step=_step(seen, DURATION),
        mean=middle,
    )
    numbers = {"amplitude": amplitude, "offset": middle, "first": min(first, fastest), "last": fastest}
    return _from_position(seen, made, {**numbers, "duration": DURATION})


def _multisine(seen: ExcitationRange, share: float) -> Motion:
    middle, amplitude = 0.5 * (seen.low + seen.high), 0.5 * WITHIN * share * (seen.high - seen.low)
    fastest = max(_fastest(seen, amplitude), 3.0 / DURATION)
    made = multisine(
        f"{seen.joint}.position",
        seen.unit,
        band=(1.0 / DURATION, fastest),
        period=DURATION,
        time_step=_step(seen, DURATION),
        peak=amplitude,
        phases="schroeder",
    )
    shifted = Excitation(made.name, made.time, made.data + middle, made.channels, made.units, made.notes)
    return _from_position(
        seen, shifted, {"peak": amplitude, "offset": middle, "first": 1.0 / DURATION, "last": fastest}
    )


def _fastest(seen: ExcitationRange, amplitude: float) -> float:
    """Highest frequency in Hz of a designed sine within the speed and acceleration of the records."""
    return min(seen.speed / amplitude, float(np.sqrt(seen.acceleration / amplitude))) / (2.0 * np.pi)


def _step(seen: ExcitationRange, duration: float) -> float:
    """Time step of a designed motion: a multiple of that of the records, and a whole part of a second."""
    step = max(seen.time_step, duration / MOST_SAMPLES)
    return 1.0 / max(1, int(1.0 / step))


def _from_position(seen: ExcitationRange, made: Excitation, numbers: Mapping[str, float | str]) -> Motion:
    position = made[f"{seen.joint}.position"]
    velocity = np.gradient(position, made.time_step)
    return _motion(seen, made, numbers, position, velocity, np.gradient(velocity, made.time_step))


def _motion(
    seen: ExcitationRange,
    made: Excitation,
    numbers: Mapping[str, float | str],
    position: Array,
    velocity: Array,
    acceleration: Array,
) -> Motion:
    """Designed motion of all joints; those that are not excited stand still."""
    joints = list(seen.hold)
    place = joints.index(seen.joint)
    table = np.tile([seen.hold[name] for name in joints], (position.size, 1))
    rates, pushes = np.zeros_like(table), np.zeros_like(table)
    table[:, place], rates[:, place], pushes[:, place] = position, velocity, acceleration
    return Motion(made, numbers, table, rates, pushes)
