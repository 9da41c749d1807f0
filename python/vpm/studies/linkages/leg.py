"""The leg of HyQ: seven rigid bodies on a vertical slider, driven by two cylinders, its foot on the ground."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Literal, Self

import numpy as np
from numpy.typing import ArrayLike

from vpm._core import Leg as _Leg
from vpm.errors import ModelError, near_match, refused_as
from vpm.numbers import Array
from vpm.studies.linkages.arrays import rowwise
from vpm.studies.linkages.leg_parameters import Cylinder, HyqSet, LegParameters, LegPart, Segment
from vpm.studies.linkages.leg_regressor import leg_regressor
from vpm.studies.linkages.leg_results import LegReactions, LegStrokes, LegTerms, ShareMap

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Derivation = Literal["virtual_work", "lagrange", "newton_euler"]
ShareDefinition = Literal["sum_of_norms", "norm_of_absolute_sum", "root_of_squares", "torque"]

#: Limits of joint rates (rad/s) and accelerations (rad/s^2). D'Imperio 2016, section 2.4.2.
DUTIES = {"low": (2.5, 1.25), "medium": (5.0, 2.5), "high": (10.0, 5.0)}

#: Joint angles of the published averages: every 10 deg.
_FIRST = np.radians(np.arange(-40.0, 60.5, 10.0))
_SECOND = np.radians(np.arange(-140.0, -19.5, 10.0))


class Leg:
    """A leg of upper and lower part, slider and two cylinders, in the plane.

    Frame 0 has its origin on the ground below the hip, y up. The hip slides along x = 0, the foot along y = 0. The
    upper leg points along ``(sin q1, -cos q1)``, the lower leg along ``(sin(q1 + q2), -cos(q1 + q2))``, so that q2 < 0
    bends the knee. A cylinder force is positive when it extends. Source: D'Imperio 2016, section 2.4.2.

    Parameters
    ----------
    parameters : LegParameters, optional
        Default: the CAD column for HyQ with the public shank.

    Raises
    ------
    ModelError
        No leg has these parameters; the sentence names the one at fault.

    Examples
    --------
    >>> from vpm.studies.linkages import Leg
    >>> leg = Leg.hyq("plausible", shank=0.341)
    >>> leg.strokes([0.35, -1.4]).shape
    (2,)
    """

    def __init__(self, parameters: LegParameters | None = None, name: str = "leg") -> None:
        self.parameters = p = parameters or LegParameters.hyq()
        self.name = name
        places = [(c.base, c.base_angle, c.tip, c.tip_angle) for c in (p.hip.attachment, p.knee.attachment)]
        with refused_as(ModelError, name):
            self._core = _Leg(
                p.slider_mass, [_segment(p.upper), _segment(p.lower)], places, _parts(p.hip) + _parts(p.knee), p.gravity
            )

    @classmethod
    def hyq(cls, data: HyqSet = "table", *, shank: float = 0.341, thigh: float = 0.350) -> Self:
        """The leg of HyQ, with one of the published sets of parameters; see `LegParameters.hyq`."""
        return cls(LegParameters.hyq(data, shank=shank, thigh=thigh), f"HyQ leg, {data}")

    def __repr__(self) -> str:
        p = self.parameters
        return f"Leg({self.name!r}, thigh={p.upper.length:g} m, shank={p.lower.length:g} m)"

    def strokes(self, angles: ArrayLike) -> Array:
        """Lengths (m) of the leg's hip and knee cylinder at joint angles (rad), shape (2,) or (N, 2).

        Source: D'Imperio 2016, eqs 2.88 and 2.90.
        """
        return self._rows(self._core.strokes, angles)

    def levers(self, angles: ArrayLike) -> Array:
        """Lever arms ``ds1/dq1, ds2/dq2`` (m/rad) of the leg's cylinders at joint angles (rad), (2,) or (N, 2)."""
        return self._rows(self._core.levers, angles)

    def points(self, angles: ArrayLike) -> Array:
        """Points of the leg (m), (7, 2) or (N, 7, 2): hip, knee, foot, cylinder bases and tips."""
        return self._rows(self._core.points, angles)

    def stroke_table(
        self, first: tuple[float, float] | None = None, second: tuple[float, float] | None = None, count: int = 1001
    ) -> LegStrokes:
        """Strokes and lever arms of the leg over a range of each joint.

        Parameters
        ----------
        first, second : (float, float), optional
            Lowest and highest angle of hip and knee (rad); by default -50 to 70 deg and -140 to -20 deg.
        count : int
            Number of angles in each range.
        """
        ranges = [np.radians((-50.0, 70.0)) if first is None else first]
        ranges.append(np.radians((-140.0, -20.0)) if second is None else second)
        angles = np.stack([np.linspace(low, high, count) for low, high in ranges], axis=1)
        return LegStrokes(angles, self.strokes(angles), self.levers(angles))

    def terms(
        self, angles: ArrayLike, rates: ArrayLike, derivation: Literal["virtual_work", "lagrange"] = "virtual_work"
    ) -> LegTerms:
        """Mass matrix, velocity terms and weight of the leg at joint angles (rad) and rates (rad/s).

        Parameters
        ----------
        angles, rates : array_like, shape (2,) or (N, 2)
        derivation : {"virtual_work", "lagrange"}
            Jacobians of the bodies, or second derivatives of the energies.

        Returns
        -------
        LegTerms
            With N rows.
        """
        q, v = self._tables(angles, rates)
        with refused_as(ModelError, self.name):
            mass, velocity, gravity = self._core.terms(q, v, derivation)
        return LegTerms(q, v, mass, velocity, gravity)

    def reactions(self, angles: ArrayLike, rates: ArrayLike, accelerations: ArrayLike) -> LegReactions:
        """Every force in the leg, by the balances of force and moment on each of its bodies.

        Source: D'Imperio 2016, eqs 2.39 to 2.44, the moment arms of 2.41 corrected.

        Parameters
        ----------
        angles, rates, accelerations : array_like, shape (2,) or (N, 2)
            In rad, rad/s, rad/s^2.

        Returns
        -------
        LegReactions
            With N rows.

        Raises
        ------
        ModelError
            A cylinder is in line with its joint, so that forces are not determined.
        """
        q, v, a = self._tables(angles, rates, accelerations)
        rows = self._rows(self._core.reactions, q, v, a)
        pins, bearings = rows[:, 7:19].reshape(-1, 6, 2), rows[:, 19:].reshape(-1, 2, 2)
        return LegReactions(q, v, a, rows[:, :2], rows[:, 2:4], rows[:, 4], rows[:, 5:7], pins, bearings)

    def torques(
        self, angles: ArrayLike, rates: ArrayLike, accelerations: ArrayLike, derivation: Derivation = "virtual_work"
    ) -> Array:
        """Joint torques (N m) that a motion of the leg needs, by one of three derivations.

        Parameters
        ----------
        angles, rates, accelerations : array_like, shape (2,) or (N, 2)
            In rad, rad/s, rad/s^2.
        derivation : {"virtual_work", "lagrange", "newton_euler"}

        Returns
        -------
        ndarray, shape (2,) or (N, 2)
        """
        if derivation == "newton_euler":
            return self._rows(lambda q, v, a: self.reactions(q, v, a).torques, angles, rates, accelerations)
        return self._rows(lambda q, v, a: self.terms(q, v, derivation).torques(a), angles, rates, accelerations)

    def regressor(self, angles: ArrayLike, rates: ArrayLike, accelerations: ArrayLike) -> Array:
        """Derivative of the leg's joint torques by `INERTIAL_NAMES`, shape (2, 11) or (N, 2, 11).

        Torques are this times `inertial_values`. Source: D'Imperio 2016, section 5.1.1.
        """
        return leg_regressor(self, angles, rates, accelerations)

    def accelerations(self, angles: ArrayLike, rates: ArrayLike, torques: ArrayLike) -> Array:
        """Joint accelerations (rad/s^2) of the leg under joint torques (N m), shape (2,) or (N, 2)."""
        return self._rows(self._core.accelerations, angles, rates, torques)

    def cylinder_forces(self, angles: ArrayLike, torques: ArrayLike) -> Array:
        """Cylinder forces (N) of the leg that give joint torques (N m), ``F = tau / (ds/dq)``."""
        forces = self._rows(self._core.cylinder_forces, angles, torques)
        lost = np.argwhere(~np.isfinite(np.atleast_2d(forces)))
        if lost.size:
            row, joint = map(int, lost[0])
            at = np.degrees(np.atleast_2d(np.asarray(angles, dtype=float))[row])
            raise ModelError(
                f"{self.name}: the cylinder of the {('hip', 'knee')[joint]} has no lever at hip {at[0]:.4g} deg and "
                f"knee {at[1]:.4g} deg, so that no force gives its torque; move away from these angles"
            )
        return forces

    def joint_torques(self, angles: ArrayLike, forces: ArrayLike) -> Array:
        """Joint torques (N m) of the leg's cylinder forces (N), ``tau = F ds/dq``, shape (2,) or (N, 2)."""
        return np.asarray(self.levers(angles) * np.asarray(forces, dtype=float))

    def shares(
        self,
        duty: str | tuple[float, float] = "medium",
        *,
        first: ArrayLike | None = None,
        second: ArrayLike | None = None,
        samples: int = 6,
        definition: ShareDefinition = "sum_of_norms",
        progress: Callable[[int, int], None] | None = None,
    ) -> ShareMap:
        """Shares of inertia, velocity and weight in the leg's effort over the workspace: mu_M, mu_V, mu_G.

        Source: D'Imperio 2016, eq 2.109 and section 2.4.2. The printed ratio to the torque is unbounded where the
        torque passes through zero; the sum of norms is the reading that gives the published averages. The
        interpreter lock is released, and Ctrl-C stops the computation.

        Parameters
        ----------
        duty : {"low", "medium", "high"} or (float, float)
            Limits of joint rates (rad/s) and accelerations (rad/s^2).
        first, second : array_like, optional
            Joint angles (rad); by default every 10 deg in -40 to 60 and -140 to -20 deg.
        samples : int
            Equispaced values of each rate and acceleration, limits included. An odd number includes standstill, which
            makes mu_G 1 for any machine.
        definition : {"sum_of_norms", "norm_of_absolute_sum", "root_of_squares", "torque"}
            What the norm of one term is divided by: ``|M a| + |V| + |G|``; the norm of the componentwise sum of
            absolute values; ``sqrt(|M a|^2 + |V|^2 + |G|^2)``; ``|M a + V + G|``.
        progress : callable, optional
            Called with the number of rows of angles done and their total.

        Raises
        ------
        ModelError
            The duty or the definition is not known, or there are fewer than two samples.
        """
        if isinstance(duty, str) and duty not in DUTIES:
            raise ModelError(f'there is no duty "{duty}"; {near_match(duty, DUTIES)}')
        rate, acceleration = DUTIES[duty] if isinstance(duty, str) else duty
        one = _FIRST if first is None else np.asarray(first, dtype=float)
        two = _SECOND if second is None else np.asarray(second, dtype=float)
        maps = np.empty((one.size, two.size, 3))
        for row, angle in enumerate(one):
            table = np.stack([np.full_like(two, angle), two], axis=1)
            maps[row] = self._rows(lambda q: self._core.shares(q, rate, acceleration, samples, definition), table)
            if progress is not None:
                progress(row + 1, one.size)
        return ShareMap(one, two, maps[..., 0], maps[..., 1], maps[..., 2], rate, acceleration, samples, definition)

    @property
    def summary(self) -> tuple[str, ...]:
        """Sentences on the leg's cylinder ranges and shares of dynamics."""
        ranges = [
            f"{name} cylinder: {low:.6f} to {high:.6f} m"
            for name, (low, high) in zip(("hip", "knee"), self.stroke_table().range, strict=True)
        ]
        shares = []
        for duty in DUTIES:
            inertia, velocity, gravity = 100.0 * self.shares(duty).mean
            shares.append(f"{duty} dynamics: mu_M {inertia:.2f} %, mu_V {velocity:.2f} %, mu_G {gravity:.2f} %")
        return (*ranges, *shares)

    def plot(self) -> Figure:
        """Plot strokes and lever arms of the leg's cylinders over the angles; see `LegStrokes.plot`."""
        return self.stroke_table().plot()

    def _rows(self, question: Callable[..., Array], *tables: ArrayLike) -> Array:
        return rowwise(question, *tables, what=self.name)

    @staticmethod
    def _tables(*tables: ArrayLike) -> tuple[Array, ...]:
        arrays = (np.atleast_2d(np.asarray(table, dtype=float)) for table in tables)
        return tuple(np.array(array) for array in np.broadcast_arrays(*arrays))


def _segment(segment: Segment) -> tuple[float, ...]:
    return (segment.length, segment.mass, segment.inertia, *segment.center)


def _parts(cylinder: Cylinder) -> list[tuple[float, float, float]]:
    def numbers(part: LegPart) -> tuple[float, float, float]:
        return part.mass, part.center, part.inertia

    return [numbers(cylinder.barrel), numbers(cylinder.rod)]
