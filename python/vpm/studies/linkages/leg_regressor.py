"""A leg's torques as a linear function of its seven masses and four moments of inertia."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from vpm.numbers import Array
from vpm.studies.linkages.leg_parameters import Cylinder, LegParameters, LegPart, Segment

if TYPE_CHECKING:
    from vpm.studies.linkages.leg import Leg


#: The parameters of D'Imperio (2016), Table 5.1: seven masses (kg), then four moments of inertia (kg m^2).
INERTIAL_NAMES = (
    "slider.mass",
    "upper.mass",
    "lower.mass",
    "hip_barrel.mass",
    "hip_rod.mass",
    "knee_barrel.mass",
    "knee_rod.mass",
    "upper.inertia",
    "lower.inertia",
    "hip_actuator.inertia",
    "knee_actuator.inertia",
)


def inertial_values(p: LegParameters) -> Array:
    """Masses and moments of inertia (11,) for the leg's regressor, in the order of `INERTIAL_NAMES`.

    A cylinder's barrel and rod turn together, so that only the sum of their moments about their centres is seen.
    """
    parts = (p.hip.barrel, p.hip.rod, p.knee.barrel, p.knee.rod)
    masses = [p.slider_mass, p.upper.mass, p.lower.mass, *(part.mass for part in parts)]
    turning = [parts[0].inertia + parts[1].inertia, parts[2].inertia + parts[3].inertia]
    return np.array([*masses, p.upper.inertia, p.lower.inertia, *turning])


def with_inertial_values(p: LegParameters, values: ArrayLike) -> LegParameters:
    """Leg of the same dimensions with other regressor parameters: masses and inertias."""
    slider, upper, lower, *parts, one, two, hip, knee = (float(x) for x in np.asarray(values, dtype=np.float64))

    def segment(old: Segment, mass: float, inertia: float) -> Segment:
        return replace(old, mass=mass, inertia=inertia)

    def cylinder(old: Cylinder, barrel: float, rod: float, inertia: float) -> Cylinder:
        share = barrel / (barrel + rod) if barrel + rod > 0.0 else 1.0
        return replace(
            old,
            barrel=LegPart(barrel, old.barrel.center, share * inertia),
            rod=LegPart(rod, old.rod.center, (1.0 - share) * inertia),
        )

    return replace(
        p,
        slider_mass=slider,
        upper=segment(p.upper, upper, one),
        lower=segment(p.lower, lower, two),
        hip=cylinder(p.hip, parts[0], parts[1], hip),
        knee=cylinder(p.knee, parts[2], parts[3], knee),
    )


def leg_regressor(leg: Leg, angles: ArrayLike, rates: ArrayLike, accelerations: ArrayLike) -> Array:
    """Derivative of the joint torques by the parameters of `INERTIAL_NAMES`.

    Torques are linear in masses and inertias while dimensions and centres of mass are known, so that the difference of
    the torques of two legs that differ by one unit of one parameter is the derivative.

    ``angles``, ``rates``, ``accelerations``: shape (2,) or (N, 2).
    Result: shape (2, 11) or (N, 2, 11).
    """
    # The core knows no leg without mass: the two segments weigh 1 kg in all of them, and nothing else weighs anything.
    base = np.zeros(len(INERTIAL_NAMES))
    base[1:3] = 1.0

    def torques(values: Array) -> Array:
        other = type(leg)(with_inertial_values(leg.parameters, values), leg.name)
        return other.torques(angles, rates, accelerations)

    zero = torques(base)
    return np.stack([torques(base + unit) - zero for unit in np.eye(base.size)], axis=-1)
