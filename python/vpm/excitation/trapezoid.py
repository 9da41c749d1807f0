"""Point-to-point motions with trapezoidal velocity profiles, several joints in step."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from vpm.errors import ExcitationError
from vpm.excitation.excitation import Excitation, check_positive
from vpm.excitation.limits import JointLimits
from vpm.numbers import Array


class Move(NamedTuple):
    """One move in closed form: rise, cruise, fall."""

    start: float
    distance: float
    ramp: float
    duration: float

    def at(self, time: Array) -> tuple[Array, Array, Array]:
        """Position, velocity and acceleration of a trapezoid; at rest before and after."""
        t = np.clip(time, 0.0, self.duration)
        speed = self.distance / (self.duration - self.ramp) if self.duration > 0.0 else 0.0
        rate = speed / self.ramp if self.ramp > 0.0 else 0.0
        left = self.duration - t
        first, last = t < self.ramp, left <= self.ramp
        position = np.where(
            first & ~last,
            0.5 * rate * t**2,
            np.where(last, self.distance - 0.5 * rate * left**2, speed * (t - 0.5 * self.ramp)),
        )
        velocity = np.where(first & ~last, rate * t, np.where(last, rate * left, speed))
        inside = (time >= 0.0) & (time < self.duration)
        acceleration = np.where(inside & first & ~last, rate, np.where(inside & last, -rate, 0.0))
        return self.start + position, velocity, acceleration


def trapezoid(
    points: Mapping[str, Sequence[float]],
    limits: Mapping[str, JointLimits],
    *,
    time_step: float,
    dwell: float = 0.0,
    unit: str | Mapping[str, str] = "rad",
) -> Excitation:
    """Motion through points, at rest in each, with trapezoidal velocities within limits.

    Of every move the joint that needs longest sets the time, and the others are slowed to arrive with it (L. Biagiotti
    and C. Melchiorri, *Trajectory Planning for Automatic Machines and Robots*, 2008, section 3.2). Constant speeds show
    friction, ramps show inertia, and dwells show gravity.

    Parameters
    ----------
    points : mapping of str to sequence of float
        Positions of each joint, as many for all; rad or m.
    limits : mapping of str to JointLimits
        Speed and acceleration of each joint count, and its range for the points.
    time_step : float
        s.
    dwell : float
        Rest at every point, s.
    unit : str or mapping of str to str
        SI unit of the positions, ``rad`` or ``m``.

    Returns
    -------
    Excitation
        Channels ``J.position``, ``J.velocity`` and ``J.acceleration``.

    Raises
    ------
    ExcitationError
        A joint has no limits or another count of points, a point is out of range, or a number is not positive.
    """
    check_positive(time_step, "time step")
    if not (np.isfinite(dwell) and dwell >= 0.0):
        raise ExcitationError(f"a dwell of {dwell:g} s is none; give at least 0")
    joints = tuple(points)
    count = _check(points, limits)
    legs = [[_move(points[j][k], points[j][k + 1], limits[j]) for j in joints] for k in range(count - 1)]
    durations = [max(move.duration for move in leg) for leg in legs]
    starts = dwell + np.concatenate([[0.0], np.cumsum(np.array(durations) + dwell)])
    samples = int(np.ceil(starts[-1] / time_step - 1e-9)) + 1
    time = np.asarray(time_step * np.arange(samples), dtype=np.float64)
    if time.size < 10:
        raise ExcitationError(
            f"the motion takes {starts[-1]:g} s, {time.size} samples of {time_step:g} s; shorten them"
        )
    data = np.zeros((time.size, 3 * len(joints)))
    for column, joint in enumerate(joints):
        data[:, 3 * column] = points[joint][0]
        for leg, duration, start in zip(legs, durations, starts[:-1], strict=True):
            since = time - start
            rows = since >= -1e-9 * time_step
            move = leg[column]
            slower = duration / move.duration if move.duration > 0.0 else 1.0
            stretched = Move(move.start, move.distance, move.ramp * slower, move.duration * slower)
            data[rows, 3 * column : 3 * column + 3] = np.column_stack(stretched.at(since[rows]))
    base = {joint: unit if isinstance(unit, str) else unit.get(joint, "rad") for joint in joints}
    return Excitation(
        "trapezoid",
        time,
        data,
        tuple(f"{joint}.{quantity}" for joint in joints for quantity in ("position", "velocity", "acceleration")),
        tuple(f"{base[joint]}{per}" for joint in joints for per in ("", "/s", "/s^2")),
        (f"{count - 1} moves in {time[-1]:.6g} s, at rest for {dwell:g} s at each point.",),
    )


def _move(start: float, end: float, limits: JointLimits) -> Move:
    """Fastest trapezoid: a ramp to the top speed, or a triangle where that is not reached."""
    distance = abs(end - start)
    if distance == 0.0:
        return Move(start, 0.0, 0.0, 0.0)
    ramp = limits.speed / limits.acceleration
    if distance <= limits.speed * ramp:
        ramp = float(np.sqrt(distance / limits.acceleration))
        return Move(start, end - start, ramp, 2.0 * ramp)
    return Move(start, end - start, ramp, distance / limits.speed + ramp)


def _check(points: Mapping[str, Sequence[float]], limits: Mapping[str, JointLimits]) -> int:
    if not points:
        raise ExcitationError("there is no joint to move; give points for at least one")
    counts = {joint: len(values) for joint, values in points.items()}
    count = max(counts.values())
    for joint, values in points.items():
        if joint not in limits:
            raise ExcitationError(f'the joint "{joint}" has no limits; give its range, speed and acceleration')
        if counts[joint] != count or count < 2:
            raise ExcitationError(f'the joint "{joint}" has {counts[joint]} points; give every joint {max(2, count)}')
        low, high = limits[joint].position
        for value in values:
            if not low <= value <= high:
                raise ExcitationError(
                    f'the point {value:g} of the joint "{joint}" is outside of its range {low:g} ... {high:g}; move it'
                )
    return count
