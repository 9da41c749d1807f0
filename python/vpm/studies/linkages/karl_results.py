"""What a KARL limb answers with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vpm.numbers import Array
from vpm.results import Result

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, repr=False, eq=False)
class KarlPoses(Result):
    """Configurations of the limb, one per row.

    Attributes
    ----------
    angles : ndarray, shape (N, 2)
        Joint angles q1, q2 (rad).
    strokes : ndarray, shape (N, 2)
        Strokes of the two actuators (m).
    end_points : ndarray, shape (N, 2)
        The end point C in the frame of the base (m).
    transmission : ndarray, shape (N, 2)
        Diagonal of Lambda: rad/m of each joint per stroke of its actuator.
    elbows : ndarray, shape (N, 2)
        The second joint B in the frame of the base (m).
    """

    angles: Array
    strokes: Array
    end_points: Array
    transmission: Array
    elbows: Array

    def __len__(self) -> int:
        """Number of configurations in KARL's result."""
        return len(self.angles)

    def _frame_columns(self) -> Mapping[str, object]:
        tables = {"q{}_rad": self.angles, "stroke{}_m": self.strokes, "lambda{}_rad_per_m": self.transmission}
        columns: dict[str, object] = {name.format(k + 1): table[:, k] for name, table in tables.items() for k in (0, 1)}
        return columns | {"tip_x_m": self.end_points[:, 0], "tip_y_m": self.end_points[:, 1]}

    def _headline(self) -> Mapping[str, object]:
        return {"configurations": len(self), "angles": self.angles}

    def plot(self) -> Figure:
        """Plot both bodies of KARL in every configuration."""
        from vpm.studies.linkages.pictures import plot_limbs

        return plot_limbs(self.elbows, self.end_points, [f"{q1:.0f}°, {q2:.0f}°" for q1, q2 in np.degrees(self.angles)])


@dataclass(frozen=True, repr=False, eq=False)
class KarlSingularities(Result):
    """Singular strokes of both actuators, one per row.

    Attributes
    ----------
    actuator : tuple of int
        0 or 1.
    kind : tuple of str
        ``"direct"``: axis, slider and anchor in line, the actuator cannot hold its joint. ``"inverse"``: the rod is
        perpendicular to the stroke, the joint cannot move the actuator.
    arrangement : tuple of str
        ``"extended"`` or ``"folded"`` at a direct singularity, ``"perpendicular"`` at an inverse one.
    where : tuple of str
        ``"boundary"``: two assembly modes (direct) or two strokes (inverse) meet and end there; ``"interior"``: both
        kinds meet in one configuration, so that branches cross.
    strokes, angles : ndarray, shape (N,)
        Of that actuator (m) and its joint (rad).
    """

    actuator: tuple[int, ...]
    kind: tuple[str, ...]
    arrangement: tuple[str, ...]
    where: tuple[str, ...]
    strokes: Array
    angles: Array

    def of(self, actuator: int, kind: str = "direct", arrangement: str | None = None) -> Array:
        """Singular strokes of one KARL actuator, of one kind and arrangement.

        Parameters
        ----------
        kind : {"direct", "inverse"}

        Returns
        -------
        ndarray, shape (K,)
            In m, the larger one first.
        """
        rows = zip(self.actuator, self.kind, self.arrangement, strict=True)
        keep = [a == actuator and k == kind and arrangement in {None, form} for a, k, form in rows]
        strokes: Array = self.strokes[np.array(keep, dtype=bool)]
        return strokes

    def _frame_columns(self) -> Mapping[str, object]:
        names = {"actuator": self.actuator, "kind": self.kind, "arrangement": self.arrangement, "where": self.where}
        return {**names, "stroke_m": self.strokes, "angle_rad": self.angles}

    def _headline(self) -> Mapping[str, object]:
        return {"direct": self.kind.count("direct"), "inverse": self.kind.count("inverse"), "strokes": self.strokes}


@dataclass(frozen=True, repr=False, eq=False)
class KarlWorkspace(Result):
    """The end point over a grid of strokes, in one assembly mode; NaN where the limb cannot be assembled.

    Attributes
    ----------
    first, second : ndarray, shape (N,) and (M,)
        Strokes of the two actuators (m).
    mode : int
        Row of `Karl.direct`, 0 to 3.
    angles, end_points, transmission : ndarray, shape (N, M, 2)
        As in `KarlPoses`.
    """

    first: Array
    second: Array
    mode: int
    angles: Array
    end_points: Array
    transmission: Array
    singularities: KarlSingularities

    @property
    def share(self) -> float:
        """Share of KARL's grid that can be assembled."""
        return float(np.isfinite(self.end_points[..., 0]).mean())

    def _frame_columns(self) -> Mapping[str, object]:
        one, two = np.meshgrid(self.first, self.second, indexing="ij")
        columns: dict[str, object] = {"stroke1_m": one.ravel(), "stroke2_m": two.ravel()}
        tables = {"q{}_rad": self.angles, "lambda{}_rad_per_m": self.transmission, "tip{}_m": self.end_points}
        return columns | {name.format(k + 1): table[..., k].ravel() for name, table in tables.items() for k in (0, 1)}

    def _headline(self) -> Mapping[str, object]:
        return {"mode": self.mode, "grid": f"{self.first.size} x {self.second.size}", "assembled": self.share}

    def plot(self) -> Figure:
        """Plot KARL's workspace: reach, joint angles and transmission up to the singular strokes."""
        from vpm.studies.linkages.pictures import plot_stroke_workspace

        singular = [self.singularities.of(actuator) for actuator in (0, 1)]
        return plot_stroke_workspace(
            (self.first, self.second), self.angles, self.end_points, self.transmission, singular
        )
