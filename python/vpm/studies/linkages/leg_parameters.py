"""Dimensions and masses of a leg, and the published sets of HyQ."""

from dataclasses import dataclass, replace
from typing import Literal, Self

from vpm._core import hyq_parameters
from vpm.errors import ModelError, refused_as
from vpm.results import Storable

HyqSet = Literal["table", "identified", "plausible"]


@dataclass(frozen=True, repr=False, eq=False)
class Segment(Storable):
    """Upper or lower segment of a leg.

    Attributes
    ----------
    length : float
        Between its axes, or to the foot (m).
    mass, inertia : float
        In kg, and about the centre of mass normal to the plane (kg m^2).
    center : (float, float)
        Centre of mass from the upper axis: along the leg, and ahead of it (m).
    """

    length: float
    mass: float
    inertia: float
    center: tuple[float, float]


@dataclass(frozen=True, repr=False, eq=False)
class Attachment(Storable):
    """How a cylinder sits around a joint.

    Attributes
    ----------
    base, tip : float
        Distances of its ends from the joint's axis (m).
    base_angle : float
        At the hip above the forward horizontal, at the knee ahead of the line to the hip (rad).
    tip_angle : float
        Behind the axis of the leg that the tip sits on (rad).
    """

    base: float
    base_angle: float
    tip: float
    tip_angle: float


@dataclass(frozen=True, repr=False, eq=False)
class LegPart(Storable):
    """Barrel or rod of a cylinder.

    Attributes
    ----------
    mass, inertia : float
        In kg, and about the centre of mass (kg m^2).
    center : float
        Centre of mass from its own end, toward the other one (m).
    """

    mass: float
    center: float
    inertia: float


@dataclass(frozen=True, repr=False, eq=False)
class Cylinder(Storable):
    """A hydraulic cylinder of the leg: where it sits, and what it weighs."""

    attachment: Attachment
    barrel: LegPart
    rod: LegPart


@dataclass(frozen=True, repr=False, eq=False)
class LegParameters(Storable):
    """Everything a leg is made of.

    Attributes
    ----------
    slider_mass : float
        Of the slider, at the hip axis (kg).
    gravity : float
        Downward (m/s^2).
    """

    slider_mass: float
    upper: Segment
    lower: Segment
    hip: Cylinder
    knee: Cylinder
    gravity: float = 9.81

    @classmethod
    def hyq(cls, data: HyqSet = "table", *, shank: float = 0.341, thigh: float = 0.350) -> Self:
        """Parameters of the leg of HyQ.

        Geometry: "HyQ-Robot: Standard definition for joint angles and kinematic parameters", V4.0, 2017. Masses:
        D'Imperio 2016, Table 5.1. Centres of mass are not published and are assumptions.

        Parameters
        ----------
        data : {"table", "identified", "plausible"}
            The CAD column of the table, its identified column, or the CAD masses with inertias of slender bodies (those
            of the table are too small for motion in the plane by one order).
        shank : float
            From knee to foot (m); 0.341 is public, 0.375 meets the published shares of dynamics.
        thigh : float
            From hip to knee (m).
        """
        with refused_as(ModelError):
            slider, bodies, places, parts, gravity = hyq_parameters(data, shank)
        upper, lower = (Segment(length, mass, inertia, (x, y)) for length, mass, inertia, x, y in bodies)
        hip, knee = (
            Cylinder(Attachment(*place), LegPart(*parts[2 * k]), LegPart(*parts[2 * k + 1]))
            for k, place in enumerate(places)
        )
        return cls(slider, replace(upper, length=thigh), lower, hip, knee, gravity)
