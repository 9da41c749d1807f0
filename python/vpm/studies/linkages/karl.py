"""KARL: strokes to joint angles and back, transmission, singular strokes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from vpm._core import Karl as _Karl
from vpm.errors import ModelError, refused_as
from vpm.numbers import Array
from vpm.results import Storable
from vpm.studies.linkages.arrays import rowwise
from vpm.studies.linkages.karl_results import KarlPoses, KarlSingularities, KarlWorkspace

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Pair = tuple[float, float]

#: Below this share of a rod's length, a slope of the constraint counts as zero.
_ZERO_SLOPE = 1e-9

(_MEDIAL, _DISTAL, _DIRECTION, _SLIDERS, _GROUND, _ANCHOR, _RODS) = _Karl.prototype()


@dataclass(frozen=True, repr=False, eq=False)
class KarlGeometry(Storable):
    """Dimensions of the limb; the defaults are those of the prototype.

    Frame 0 has its origin at the first joint A. Frame 1 turns with the medial body, its x axis from A to the second
    joint B. Frame 2 has its origin at B and turns with the distal body. Source: D'Imperio 2016, section 2.4.1.

    Attributes
    ----------
    medial, distal : float
        Lengths from A to B and from B to the end point C (m).
    stroke_direction : float
        Angle of both strokes in frame 1 (rad).
    sliders : ((float, float), (float, float))
        Both sliders at stroke zero, in frame 1 (m).
    ground_anchor : (float, float)
        The fixed end of the first rod, in frame 0 (m).
    distal_anchor : (float, float)
        The end of the second rod on the distal body, in frame 2 (m).
    rods : (float, float)
        Lengths of the rods (m).
    """

    medial: float = _MEDIAL
    distal: float = _DISTAL
    stroke_direction: float = _DIRECTION
    sliders: tuple[Pair, Pair] = ((_SLIDERS[0][0], _SLIDERS[0][1]), (_SLIDERS[1][0], _SLIDERS[1][1]))
    ground_anchor: Pair = (_GROUND[0], _GROUND[1])
    distal_anchor: Pair = (_ANCHOR[0], _ANCHOR[1])
    rods: Pair = (_RODS[0], _RODS[1])


class Karl:
    """The limb of two joints whose two linear actuators both sit on its first body.

    Parameters
    ----------
    geometry : KarlGeometry, optional
        Default: the prototype.

    Raises
    ------
    ModelError
        No limb has these dimensions; the sentence names the one at fault.

    Examples
    --------
    >>> from vpm.studies.linkages import Karl
    >>> karl = Karl()
    >>> len(karl.direct((0.20, 0.18)))
    4
    """

    def __init__(self, geometry: KarlGeometry | None = None, name: str = "KARL") -> None:
        self.geometry = geometry or KarlGeometry()
        self.name = name
        g = self.geometry
        with refused_as(ModelError, name):
            self._core = _Karl(
                g.medial, g.distal, g.stroke_direction, g.sliders, g.ground_anchor, g.distal_anchor, g.rods
            )

    def __repr__(self) -> str:
        g = self.geometry
        return f"Karl({self.name!r}, medial={g.medial:.6g} m, distal={g.distal:.6g} m, rods={g.rods} m)"

    def direct(self, strokes: ArrayLike) -> KarlPoses:
        """All four assembly modes of KARL at two strokes (m). Source: D'Imperio 2016, eqs 2.61 to 2.71.

        Parameters
        ----------
        strokes : array_like, shape (2,)

        Returns
        -------
        KarlPoses
            Four rows: both angles of joint 1, for each of them both angles of joint 2.

        Raises
        ------
        ModelError
            The rods are too long or too short for these strokes.
        """
        pair = self._pair(strokes)
        with refused_as(ModelError, self.name):
            angles = self._core.direct(pair)
        return self._poses(angles, np.tile(pair, (4, 1)))

    def inverse(self, target: ArrayLike) -> KarlPoses:
        """All eight configurations of KARL that put the end point C at a target (m).

        Parameters
        ----------
        target : array_like, shape (2,)
            In the frame of the base.

        Returns
        -------
        KarlPoses
            Eight rows: for both elbows (q2 positive first) both strokes of each actuator.

        Raises
        ------
        ModelError
            The target is out of reach, or an elbow there cannot be driven by any stroke.
        """
        pair = self._pair(target)
        with refused_as(ModelError, self.name):
            rows = self._core.inverse(pair)
        return self._poses(rows[:, :2], rows[:, 2:])

    def end_point(self, angles: ArrayLike) -> Array:
        """End point C (m) of KARL at joint angles (rad). Source: D'Imperio 2016, eq 2.72.

        Parameters
        ----------
        angles : array_like, shape (2,) or (N, 2)

        Returns
        -------
        ndarray, of the same shape
        """
        return self._rows(self._core.end_point, angles)

    def transmission(self, angles: ArrayLike, strokes: ArrayLike) -> Array:
        """Diagonal of KARL's Lambda (rad/m), infinite at a direct singularity: ``q_dot = Lambda stroke_dot``.

        Source: D'Imperio 2016, eqs 2.82 to 2.84.

        Parameters
        ----------
        angles, strokes : array_like, shape (2,) or (N, 2)
            Of assembled configurations.

        Returns
        -------
        ndarray, of the same shape
        """
        return self._rows(self._core.transmission, angles, strokes)

    def determinants(self, angles: ArrayLike, strokes: ArrayLike) -> Array:
        """Determinants of KARL's Psi and Omega (m^2), zero at a direct singularity. Source: D'Imperio 2016, 2.77, 2.79.

        Parameters
        ----------
        angles, strokes : array_like, shape (2,) or (N, 2)

        Returns
        -------
        ndarray, of the same shape
        """
        return self._rows(self._core.determinants, angles, strokes)

    def torques(self, angles: ArrayLike, strokes: ArrayLike, forces: ArrayLike) -> Array:
        """Joint torques (N m) of KARL's actuator forces (N, positive along the stroke): ``tau = Lambda^-T F``.

        Parameters
        ----------
        angles, strokes, forces : array_like, shape (2,) or (N, 2)

        Returns
        -------
        ndarray, of the same shape
        """
        return self._rows(self._core.torques, angles, strokes, forces)

    def forces(self, angles: ArrayLike, strokes: ArrayLike, torques: ArrayLike) -> Array:
        """Actuator forces (N) of KARL that balance joint torques (N m): ``F = Lambda^T tau``.

        Parameters
        ----------
        angles, strokes, torques : array_like, shape (2,) or (N, 2)

        Returns
        -------
        ndarray, of the same shape
        """
        return np.asarray(self.transmission(angles, strokes) * np.asarray(torques, dtype=float))

    def singularities(self) -> KarlSingularities:
        """All singular strokes of both KARL actuators, direct ones and inverse ones.

        A direct singularity is a zero of the derivative of the constraint by the angle, an inverse one by the stroke.
        The second derivative by the same variable never vanishes there, so the other variable turns back: a boundary,
        unless both first derivatives vanish.
        """
        rows: list[tuple[int, str, str, float, float]] = []
        for actuator in (0, 1):
            for stroke, angle, extended in self._core.alignments(actuator):
                rows.append((actuator, "direct", "extended" if extended else "folded", stroke, angle))
            for stroke, angle in self._core.perpendiculars(actuator):
                rows.append((actuator, "inverse", "perpendicular", stroke, angle))
        # Rods too short to reach their sliders leave none at all.
        actuators, kinds, forms, strokes, angles = zip(*rows, strict=True) if rows else ((),) * 5
        where = tuple(self._where(*row) for row in rows)
        return KarlSingularities(actuators, kinds, forms, where, np.array(strokes), np.array(angles))

    def span(self, actuator: int = 0, mode: int = 1) -> float:
        """Turn of a KARL joint (rad) between its two singular strokes on the positive side, in one mode.

        Parameters
        ----------
        actuator : {0, 1}
        mode : {1, -1}
            1 for the first of the two angles that `direct` gives.
        """
        return self._core.span(actuator, float(mode))

    def resultant(self, actuator: int, stroke: float) -> Array:
        """Resultant of KARL in s = sin q, coefficients (5,), lowest power first; its zeros are assembly modes.

        Source: D'Imperio 2016, eq 2.66. Its degree is 2.

        Parameters
        ----------
        actuator : {0, 1}
        stroke : float
            In m.
        """
        return np.array(self._core.resultant(actuator, stroke))

    def workspace(
        self, first: ArrayLike | None = None, second: ArrayLike | None = None, mode: int = 0
    ) -> KarlWorkspace:
        """Workspace of KARL: the end point over a grid of strokes.

        Parameters
        ----------
        first, second : array_like, shape (N,) and (M,), optional
            Strokes of the actuators (m); by default 81 between the two least positive singular ones of each.
        mode : {0, 1, 2, 3}
            Row of `direct`. The prototype is built in mode 0, |q1| < 90 deg and q2 > 0.
        """
        one, two = self._strokes(0, first), self._strokes(1, second)
        if mode not in range(4):
            raise ModelError(f"{self.name} has the assembly modes 0 to 3, not {mode}; choose one of them")
        angles = np.full((one.size, two.size, 2), np.nan)
        for i, stroke1 in enumerate(one):
            for j, stroke2 in enumerate(two):
                try:
                    angles[i, j] = self._core.direct((stroke1, stroke2))[mode]
                except ValueError:  # cannot be assembled: stays empty
                    continue
        strokes = np.stack(np.meshgrid(one, two, indexing="ij"), axis=-1)
        flat = angles.reshape(-1, 2)
        transmission = self.transmission(flat, strokes.reshape(-1, 2)).reshape(angles.shape)
        tips = self.end_point(flat).reshape(angles.shape)
        return KarlWorkspace(one, two, mode, angles, tips, transmission, self.singularities())

    @property
    def summary(self) -> tuple[str, ...]:
        """Sentences on KARL's singular strokes, and on what some strokes only can be assembled."""
        s = self.singularities()
        apart = (
            f"actuator {number + 1}: no stroke assembles it; its rod is too short"
            for number in (0, 1)
            if not s.of(number).size
        )
        rows = zip(s.actuator, s.kind, s.arrangement, s.where, s.strokes, s.angles, strict=True)
        singular = (
            f"actuator {actuator + 1}: {kind} singularity at {stroke:+.6f} m, {arrangement}, "
            f"joint at {np.degrees(angle):.3f} deg, {where}"
            for actuator, kind, arrangement, where, stroke, angle in rows
        )
        return (*apart, *singular)

    def plot(self) -> Figure:
        """Plot KARL's reach, joint angles and transmission; see `KarlWorkspace.plot`."""
        return self.workspace().plot()

    def _strokes(self, actuator: int, given: ArrayLike | None) -> Array:
        if given is not None:
            return np.atleast_1d(np.asarray(given, dtype=float))
        singular = np.sort(self.singularities().of(actuator))
        low_high = singular[singular > 0.0][:2]
        if low_high.size < 2:
            raise ModelError(
                f"{self.name}: actuator {actuator + 1} has {low_high.size} positive singular strokes, but two are "
                "needed for a range between them; give the strokes"
            )
        inset = 1e-3 * (low_high[1] - low_high[0])
        return np.linspace(low_high[0] + inset, low_high[1] - inset, 81)

    def _where(self, actuator: int, kind: str, _form: str, stroke: float, angle: float) -> str:
        angles, strokes = np.zeros((1, 2)), np.zeros((1, 2))
        angles[0, actuator], strokes[0, actuator] = angle, stroke
        other = self._core.stroke_slopes if kind == "direct" else self._core.determinants
        scale = self.geometry.rods[actuator] ** (1 if kind == "direct" else 2)
        return "boundary" if abs(other(angles, strokes)[0, actuator]) > _ZERO_SLOPE * scale else "interior"

    def _poses(self, angles: Array, strokes: Array) -> KarlPoses:
        g = self.geometry
        elbows = g.medial * np.stack([np.cos(angles[:, 0]), np.sin(angles[:, 0])], axis=1)
        return KarlPoses(
            angles, strokes, self._core.end_point(angles), self._core.transmission(angles, strokes), elbows
        )

    def _pair(self, numbers: ArrayLike) -> Pair:
        array = np.asarray(numbers, dtype=float)
        if array.shape != (2,):
            raise ModelError(f"{self.name}: needs two numbers, got the shape {array.shape}; give one row")
        return float(array[0]), float(array[1])

    def _rows(self, question: Callable[..., Array], *tables: ArrayLike) -> Array:
        return rowwise(question, *tables, what=self.name)
