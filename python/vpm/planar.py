"""A flexible arm of one or two links in a plane, a thousand times faster than real time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vpm._core import Diverged
from vpm._core import PlanarArm as _PlanarArm
from vpm.errors import DivergedError, ModelError
from vpm.results import Result, Storable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]


@dataclass(frozen=True, repr=False, eq=False)
class FlexibleLink(Storable):
    """One link: a hub around its joint, an inextensible beam from the rim of the hub, a body at its tip.

    Attributes
    ----------
    length : float
        From the clamp to the tip (m).
    bending : float
        Bending stiffness EJ (N m^2).
    line_density : float
        Mass per length (kg/m).
    rotary_inertia : float
        Of the sections, per length (kg m); zero for an Euler-Bernoulli beam.
    damping : float
        Kelvin-Voigt: the bending moment is ``EJ (kappa + damping kappa_dot)`` (s).
    hub_radius, hub_mass, hub_inertia : float
        From the joint to the clamp (m); mass on the joint (kg); inertia about the joint (kg m^2).
    tip_mass, tip_inertia : float
        Of the body at the tip (kg, kg m^2); the hub of the next link counts by itself.
    """

    length: float
    bending: float
    line_density: float
    rotary_inertia: float = 0.0
    damping: float = 0.0
    hub_radius: float = 0.0
    hub_mass: float = 0.0
    hub_inertia: float = 0.0
    tip_mass: float = 0.0
    tip_inertia: float = 0.0

    @classmethod
    def strip(
        cls,
        length: float,
        width: float,
        height: float,
        *,
        young: float,
        density: float,
        damping: float = 0.0,
        hub_inertia: float = 0.0,
        tip_mass: float = 0.0,
        tip_inertia: float = 0.0,
    ) -> Self:
        """Link of rectangular section that bends along its height.

        Parameters
        ----------
        length, width, height : float
            In m.
        young : float
            In Pa.
        density : float
            In kg/m^3.
        damping, hub_inertia, tip_mass, tip_inertia : float
            As in the class.
        """
        area = width * height
        return cls(
            length,
            young * area * height**2 / 12.0,
            density * area,
            damping=damping,
            hub_inertia=hub_inertia,
            tip_mass=tip_mass,
            tip_inertia=tip_inertia,
        )


@dataclass(frozen=True, repr=False, eq=False)
class Gauge(Storable):
    """Where a strain is read: the strain of the surface is its distance from the neutral axis times the curvature.

    Attributes
    ----------
    link : int
        From 0.
    at : float
        From the clamp of the link (m).
    distance : float
        From the neutral axis, positive on the side that a positive curvature stretches (m).
    """

    link: int
    at: float
    distance: float


@dataclass(frozen=True, repr=False, eq=False)
class Swing(Storable):
    """Reference ``amplitude / 2 (1 - cos(2 pi t / period))``.

    Attributes
    ----------
    amplitude : float
        In rad.
    period : float
        In s.
    """

    amplitude: float
    period: float

    def angle(self, time: ArrayLike) -> Array:
        """Angle (rad) at times (s)."""
        return 0.5 * self.amplitude * (1.0 - np.cos(2.0 * np.pi * np.asarray(time, dtype=float) / self.period))


@dataclass(frozen=True, repr=False, eq=False)
class SampledReference(Storable):
    """Reference of all joints at equal distances in time, from zero on, with a cubic between two samples.

    Attributes
    ----------
    time_step : float
        In s.
    angles, rates : ndarray, shape (N, joints)
        In rad and rad/s.
    """

    time_step: float
    angles: Array
    rates: Array


@dataclass(frozen=True, repr=False, eq=False)
class PlanarRun(Result):
    """A motion of a `PlanarArm`, N rows over time.

    Attributes
    ----------
    time : ndarray, shape (N,)
        In s.
    tips : ndarray, shape (N, links, 3)
        Tip of each link: x, y (m) and angle (rad) in the fixed frame.
    angles, rates : ndarray, shape (N, links)
        Joint angles (rad) and rates (rad/s).
    reference : ndarray, shape (N, links)
        Where the joints should have been (rad).
    strains : ndarray, shape (N, gauges)
    states : ndarray, shape (N, 2 n)
        Coordinates and rates, for a next run to start from.
    gauges : tuple of Gauge
    step : float
        Of the integration (s).
    """

    time: Array
    tips: Array
    angles: Array
    rates: Array
    reference: Array
    strains: Array
    states: Array
    gauges: tuple[Gauge, ...]
    step: float

    @property
    def tip(self) -> Array:
        """Tip (m) of the last link, shape (N, 2)."""
        return self.tips[:, -1, :2]

    def _frame_columns(self) -> Mapping[str, object]:
        columns: dict[str, object] = {"time_s": self.time, "tip_x_m": self.tip[:, 0], "tip_y_m": self.tip[:, 1]}
        columns |= {f"angle{k + 1}_rad": self.angles[:, k] for k in range(self.angles.shape[1])}
        return columns | {f"strain{k + 1}": self.strains[:, k] for k in range(self.strains.shape[1])}

    def _headline(self) -> Mapping[str, object]:
        return {"duration_s": float(self.time[-1]), "samples": self.time.size, "step_s": self.step}

    def plot(self) -> Figure:
        """Path of the tip, joint angles with their references, strains.

        Returns
        -------
        matplotlib.figure.Figure
        """
        from vpm.plot.linkages import plot_planar_motion

        names = [f"link {gauge.link + 1} at {gauge.at:g} m" for gauge in self.gauges]
        return plot_planar_motion(self.time, self.angles, self.reference, self.tip, self.strains, names)


class PlanarArm:
    """One or two flexible links in a plane, with hubs, tip bodies and a proportional-derivative servo on each joint.

    The links are inextensible and geometrically exact at any deflection; the curvature of each is a polynomial of 2, 3
    or 4 coefficients. Sizes are fixed when the core is compiled and nothing is allocated while it runs, which makes it
    the fastest way to a planar arm: use it where a step has to fit a controller's period by a wide margin, or where
    thousands of runs are wanted. A model file with beams is the general way: three dimensions, other joints and
    trees, shear and extension, other drives and effects, identification and diagnosis.

    The arm starts straight along x, undeformed and at rest, if a run is not given a state to start from.

    Parameters
    ----------
    links : sequence of FlexibleLink
        One or two, from the base outward.
    gains : sequence of (float, float)
        For each joint: torque per angle error (N m/rad) and per rate error (N m s/rad); zeros leave a joint free.
    reference : Swing, sequence of Swing, or SampledReference
        Where the joints should be: one swing for all, one for each, or samples.
    gauges : sequence of Gauge
    gravity : (float, float)
        In m/s^2.
    coefficients : {2, 3, 4}
        Curvature coefficients per link. On a light, fast arm two follow the tip, three also the strains to some 1e-3,
        four to some 1e-4 of their size; see ``docs/performance.md``.
    points : int
        Gauss stations over each link, 2 to 40; coefficients + 1 is enough.
    order : {2, 4}
        Of the steps. Order 2 takes two evaluations of the equations of motion in each step and is the robust choice for
        short steps, such as a controller's period. Order 4 takes six, and allows steps of 10 ms where order 2 needs
        1 ms, if the reference is smooth.

    Raises
    ------
    ModelError
        No arm has these parameters, or the core has no arm of this size.

    Notes
    -----
    Source: Simo & Vu-Quoc 1986, "On the dynamics of flexible beams under large overall motions", J. Appl. Mech. 53,
    without shear and extension, discretised in the curvature. Steps of order 2: Rosenbrock method, Verwer, Spee, Blom &
    Hundsdorfer 1999. Steps of order 4: additive Runge-Kutta method, Kennedy & Carpenter 2003, used semi-implicitly as
    in Boscarino, Filbet & Russo 2016.

    Examples
    --------
    >>> from vpm.planar import FlexibleLink, Gauge, PlanarArm, Swing
    >>> link = FlexibleLink.strip(0.4, 0.015, 0.004, young=210e9, density=7850.0, damping=5e-4, hub_inertia=0.01)
    >>> arm = PlanarArm([link], [(100.0, 2.0)], Swing(amplitude=1.0, period=2.0), [Gauge(0, 0.02, 0.002)])
    >>> arm.run(2.0, samples=201, steps=5).strains.shape
    (201, 1)
    """

    def __init__(
        self,
        links: Sequence[FlexibleLink],
        gains: Sequence[tuple[float, float]],
        reference: Swing | Sequence[Swing] | SampledReference,
        gauges: Sequence[Gauge] = (),
        *,
        gravity: tuple[float, float] = (0.0, -9.81),
        coefficients: int = 4,
        points: int = 5,
        order: int = 2,
    ) -> None:
        self.links, self.gauges, self.coefficients = tuple(links), tuple(gauges), coefficients
        self.order = order
        self.reference = (reference,) * len(self.links) if isinstance(reference, Swing) else reference
        table = [_numbers(link) for link in self.links]
        try:
            self._core = _PlanarArm(np.reshape(table, (-1, 10)), gains, gravity, coefficients, points, order)
        except ValueError as error:
            raise ModelError(f"planar arm: {error}") from error

    def __repr__(self) -> str:
        lengths = ", ".join(f"{link.length:g} m" for link in self.links)
        return f"PlanarArm({lengths}, coefficients={self.coefficients}, order={self.order})"

    def run(self, duration: float, samples: int, steps: int, start: ArrayLike | None = None) -> PlanarRun:
        """Run the arm along its references.

        Parameters
        ----------
        duration : float
            In s.
        samples : int
            Rows of the result, from zero to the duration.
        steps : int
            Integration steps from one row to the next; the step is ``duration / (samples - 1) / steps``.
        start : array_like, optional
            A row of `PlanarRun.states`; by default straight, undeformed, at rest.

        Returns
        -------
        PlanarRun

        Raises
        ------
        ModelError
            Duration, samples, steps, gauges, reference or start do not fit.
        DivergedError
            The motion left the finite numbers; use a smaller step.
        """
        swing, table, time_step = None, None, 0.0
        if isinstance(self.reference, SampledReference):
            table = np.concatenate([self.reference.angles, self.reference.rates], axis=1)
            time_step = self.reference.time_step
        else:
            swing = [(each.amplitude, each.period) for each in self.reference]
        gauges = np.reshape([(gauge.link, gauge.at, gauge.distance) for gauge in self.gauges], (-1, 3))
        try:
            tips, angles, rates, strains, states = self._core.run(
                duration, samples, steps, gauges, swing, table, time_step, start
            )
        except Diverged as error:
            raise DivergedError(f"planar arm: {error}") from error
        except ValueError as error:
            raise ModelError(f"planar arm: {error}") from error
        time = np.linspace(0.0, duration, samples)
        step = duration / ((samples - 1) * steps)
        return PlanarRun(time, tips, angles, rates, self._reference_at(time), strains, states, self.gauges, step)

    def _reference_at(self, time: Array) -> Array:
        if not isinstance(self.reference, SampledReference):
            return np.stack([each.angle(time) for each in self.reference], axis=1)
        known = np.arange(len(self.reference.angles)) * self.reference.time_step
        return np.stack([np.interp(time, known, column) for column in self.reference.angles.T], axis=1)


def _numbers(link: FlexibleLink) -> tuple[float, ...]:
    return (
        link.length,
        link.bending,
        link.line_density,
        link.rotary_inertia,
        link.damping,
        link.hub_radius,
        link.hub_mass,
        link.hub_inertia,
        link.tip_mass,
        link.tip_inertia,
    )
