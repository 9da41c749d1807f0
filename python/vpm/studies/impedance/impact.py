"""A stop by a damper: balance of energy and of impulse.

A mass that a damper c stops along ``x = dl sin(omega t)`` loses ``E = c int (dx/dt)^2 dt = c dl^2 omega^2 dt / 2`` in
the time dt. A stop is a quarter of the sine, ``omega = pi / (2 dt)``; stop and rebound are half of it:

``E = (pi^2 / 8) c dl^2 / dt``, ``(pi^2 / 2) c dl^2 / dt``, and over the full cycle ``2 pi^2 c dl^2 / dt``.

D'Imperio (2016), eq 5.27, prints the factor of the full cycle and ``m v^2`` for the energy; it is ``m v^2 / 2``. Eq
5.28 is no energy but an impulse, ``int F dt = m g dt + m dv``.
"""

from dataclasses import dataclass

import numpy as np

from vpm.errors import IdentificationError
from vpm.narx.records import RecordLike
from vpm.results import Result
from vpm.studies.impedance.channels import columns

#: Farther from a quarter or half sine than this share, and the damping is worth a warning.
OFF = 0.1


def stop_factor(quarters: int) -> float:
    """Impact factor ``E dt / (c dl^2)`` of a sine over quarters of its cycle: pi^2/8 for 1, pi^2/2 for 2, 2 pi^2 for 4.

    Parameters
    ----------
    quarters : int
        Whole quarters, from 1.

    Raises
    ------
    IdentificationError
    """
    if quarters < 1 or int(quarters) != quarters:
        raise IdentificationError(f"quarters is {quarters}; give 1 for a stop, 2 for stop and rebound, 4 for a cycle")
    return (quarters * np.pi) ** 2 / 8.0


@dataclass(frozen=True, repr=False, eq=False)
class Stop(Result):
    """Damping from a stop of a mass by a damper: balance of energy.

    Attributes
    ----------
    damping : float
        N s/m.
    energy : float
        Lost in the damper, J.
    factor : float
        ``E dt / (c dl^2)``.
    roundness : float
        ``v dt / dl`` over that of the assumed sine: 1 where the stop is one.
    """

    damping: float
    energy: float
    factor: float
    roundness: float
    notes: tuple[str, ...] = ()


def stop_damping(
    mass: float,
    speed: float,
    stroke: float,
    duration: float,
    *,
    rebound_speed: float | None = None,
    stiffness: float = 0.0,
    gravity: float = 0.0,
) -> Stop:
    """Damping that takes the energy of a mass in an impact, or in impact and rebound.

    In a stop a spring beside the damper keeps ``k dl^2 / 2``, which counts as loss if `stiffness` is left at zero; in
    stop and rebound it gives it back. The motion is taken as a sine, which it is for small damping alone:
    `identify_decay` and `identify_landing` need no such assumption.

    Parameters
    ----------
    mass : float
        kg.
    speed : float
        On arrival, m/s.
    stroke : float
        dl, from arrival to standstill, m.
    duration : float
        dt, s: of the stop, or of stop and rebound together.
    rebound_speed : float, optional
        m/s, of the mass that leaves; without it the test is a stop.
    stiffness : float
        N/m.
    gravity : float
        Acceleration along the stroke, m/s^2.

    Raises
    ------
    IdentificationError
        A number is not positive, or no energy is left for the damper.
    """
    given = {"mass": mass, "speed": speed, "stroke": stroke, "duration": duration}
    for name, value in given.items():
        if not (np.isfinite(value) and value > 0.0):
            raise IdentificationError(f"{name} is {value}; give a positive number")
    for name, value in {"stiffness": stiffness, "rebound_speed": rebound_speed or 0.0}.items():
        if not (np.isfinite(value) and value >= 0.0):
            raise IdentificationError(f"{name} is {value}; give a number that is not negative")
    if rebound_speed is None:
        quarters, stored = 1, 0.5 * stiffness * stroke**2 - mass * gravity * stroke
    else:
        quarters, stored = 2, 0.5 * mass * rebound_speed**2
    arrived = 0.5 * mass * speed**2
    energy = arrived - stored
    if not energy > 0.0:
        raise IdentificationError(
            f"the mass arrives with {arrived:.4g} J and {stored:.4g} J are stored or kept, which leaves nothing for a "
            "damper; check mass, speeds and stiffness"
        )
    factor = stop_factor(quarters)
    roundness = speed * duration / (stroke * 0.5 * np.pi * quarters)
    notes: tuple[str, ...] = ()
    if abs(roundness - 1.0) > OFF:
        notes = (
            f"v dt / dl is {roundness:.2f} times that of the assumed sine, so that the damping is right within a "
            "factor of about that size; use identify_decay or identify_landing",
        )
    return Stop(energy * duration / (factor * stroke**2), energy, factor, roundness, notes)


@dataclass(frozen=True, repr=False, eq=False)
class ImpulseBalance(Result):
    """Impulse of a force against weight and momentum.

    Attributes
    ----------
    impulse : float
        ``int F dt``, N s.
    weight : float
        ``m g dt``, N s.
    momentum : float
        ``m (v_after - v_before)``, N s, positive with the force.
    duration : float
        s.
    """

    impulse: float
    weight: float
    momentum: float
    duration: float

    @property
    def gap(self) -> float:
        """Impulse error of an impact, ``int F dt - m g dt - m dv``, N s."""
        return self.impulse - self.weight - self.momentum

    @property
    def mean_force(self) -> float:
        """Mean force of an impact, ``int F dt / dt``, N."""
        return self.impulse / self.duration


def impulse_balance(
    record: RecordLike,
    force: str,
    mass: float,
    speed_before: float,
    speed_after: float = 0.0,
    *,
    gravity: float = 9.81,
) -> ImpulseBalance:
    """Impulse balance of an impact: ground force against weight and momentum.

    Parameters
    ----------
    record : Experiment or mapping of str to array-like, shape (N,)
        From before the impact to after it.
    force : str
        Channel, N, positive away from the ground.
    mass : float
        kg.
    speed_before, speed_after : float
        At the first and the last sample, m/s, positive away from the ground: a falling mass has a negative one.
    gravity : float
        m/s^2.

    Raises
    ------
    IdentificationError, ExperimentError
        A number or the record cannot be used.
    """
    if not (np.isfinite(mass) and mass > 0.0):
        raise IdentificationError(f"mass is {mass} kg; give a positive number")
    found = columns(record, (force,), 2)
    span = float(found.time[-1] - found.time[0])
    return ImpulseBalance(
        impulse=float(np.trapezoid(found.values[0], found.time)),
        weight=mass * gravity * span,
        momentum=mass * (speed_after - speed_before),
        duration=span,
    )
