"""What a leg answers with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from vpm.numbers import Array
from vpm.results import Result

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, repr=False, eq=False)
class LegTerms(Result):
    """The terms of ``tau = M a + V + G`` in N states. Source: D'Imperio 2016, eqs 2.104 to 2.107, signs corrected.

    Attributes
    ----------
    angles, rates : ndarray, shape (N, 2)
        Joint angles (rad) and rates (rad/s).
    mass_matrix : ndarray, shape (N, 2, 2)
        M (kg m^2).
    velocity, gravity : ndarray, shape (N, 2)
        V and G (N m).
    """

    angles: Array
    rates: Array
    mass_matrix: Array
    velocity: Array
    gravity: Array

    def torques(self, accelerations: ArrayLike) -> Array:
        """Torque result of a leg (N, 2) in N m for joint accelerations (2,) or (N, 2) in rad/s^2."""
        a = np.broadcast_to(np.asarray(accelerations, dtype=float), self.velocity.shape)
        inertia: Array = np.einsum("nij,nj->ni", self.mass_matrix, a)
        return inertia + self.velocity + self.gravity

    def _frame_columns(self) -> Mapping[str, object]:
        columns: dict[str, object] = {}
        tables = {"q{}_rad": self.angles, "v{}_rad_per_s": self.rates, "V{}_Nm": self.velocity, "G{}_Nm": self.gravity}
        for name, table in tables.items():
            columns |= {name.format(k + 1): table[:, k] for k in (0, 1)}
        return columns | {f"M{i + 1}{j + 1}": self.mass_matrix[:, i, j] for i in (0, 1) for j in (0, 1)}

    def _headline(self) -> Mapping[str, object]:
        return {"states": len(self.angles), "mass_matrix": self.mass_matrix}


@dataclass(frozen=True, repr=False, eq=False)
class LegReactions(Result):
    """Every force that holds the leg together, by the balances of its seven bodies. No friction.

    Attributes
    ----------
    angles, rates, accelerations : ndarray, shape (N, 2)
    torques : ndarray, shape (N, 2)
        Joint torques to which the cylinders are equivalent (N m).
    cylinder_forces : ndarray, shape (N, 2)
        Hip and knee, positive when extending (N).
    ground : ndarray, shape (N,)
        Upward on the foot (N).
    guide : ndarray, shape (N, 2)
        On the slider: force along x (N), moment (N m).
    pins : ndarray, shape (N, 6, 2)
        At hip, knee, and the ends H1, H2, K1, K2 of the cylinders (N).
    bearings : ndarray, shape (N, 2, 2)
        Of each barrel on its rod: force across (N), moment (N m).
    """

    angles: Array
    rates: Array
    accelerations: Array
    torques: Array
    cylinder_forces: Array
    ground: Array
    guide: Array
    pins: Array
    bearings: Array

    def _frame_columns(self) -> Mapping[str, object]:
        columns: dict[str, object] = {f"q{k + 1}_rad": self.angles[:, k] for k in (0, 1)}
        columns |= {f"torque{k + 1}_Nm": self.torques[:, k] for k in (0, 1)}
        columns |= {f"cylinder{k + 1}_N": self.cylinder_forces[:, k] for k in (0, 1)}
        return columns | {"ground_N": self.ground}

    def _headline(self) -> Mapping[str, object]:
        return {"states": len(self.angles), "cylinder_forces": self.cylinder_forces, "ground": self.ground}


@dataclass(frozen=True, repr=False, eq=False)
class LegStrokes(Result):
    """Lengths and lever arms of the cylinders over the ranges of their joints.

    Attributes
    ----------
    angles : ndarray, shape (N, 2)
        Hip and knee angle (rad), each over its own range.
    strokes : ndarray, shape (N, 2)
        Lengths of hip and knee cylinder (m).
    levers : ndarray, shape (N, 2)
        ``d stroke / d angle`` (m/rad).
    """

    angles: Array
    strokes: Array
    levers: Array

    @property
    def range(self) -> Array:
        """Range of a leg's cylinder lengths (m), shape (2, 2), one cylinder per row."""
        return np.stack([self.strokes.min(axis=0), self.strokes.max(axis=0)], axis=1)

    def _frame_columns(self) -> Mapping[str, object]:
        tables = {"angle{}_rad": self.angles, "stroke{}_m": self.strokes, "lever{}_m": self.levers}
        return {name.format(k + 1): table[:, k] for name, table in tables.items() for k in (0, 1)}

    def _headline(self) -> Mapping[str, object]:
        (hip, knee) = self.range
        return {"hip_m": tuple(map(float, hip)), "knee_m": tuple(map(float, knee))}

    def plot(self) -> Figure:
        """Plot a leg's strokes above, lever arms below, over the angles."""
        from vpm.studies.linkages.pictures import plot_strokes

        return plot_strokes(self.angles, self.strokes, self.levers, ("hip", "knee"))


@dataclass(frozen=True, repr=False, eq=False)
class ShareMap(Result):
    """Shares of inertia, velocity and weight in the effort over a workspace.

    Each number is the largest share over all sampled motions in that configuration. Source: D'Imperio 2016, eq 2.109.

    Attributes
    ----------
    first, second : ndarray, shape (R,) and (C,)
        Joint angles (rad).
    inertia, velocity, gravity : ndarray, shape (R, C)
        mu_M, mu_V, mu_G (fractions).
    rate, acceleration : float
        Limits of the sampled motions (rad/s, rad/s^2).
    samples : int
        Equispaced values of each rate and acceleration.
    definition : str
        What a share is relative to; see `Leg.shares`.
    """

    first: Array
    second: Array
    inertia: Array
    velocity: Array
    gravity: Array
    rate: float
    acceleration: float
    samples: int
    definition: str

    @property
    def mean(self) -> Array:
        """Mean results (3,) of a leg's mu_M, mu_V, mu_G over the workspace."""
        return np.array([table.mean() for table in (self.inertia, self.velocity, self.gravity)])

    def _frame_columns(self) -> Mapping[str, object]:
        one, two = np.meshgrid(self.first, self.second, indexing="ij")
        return {
            "q1_rad": one.ravel(),
            "q2_rad": two.ravel(),
            "mu_M": self.inertia.ravel(),
            "mu_V": self.velocity.ravel(),
            "mu_G": self.gravity.ravel(),
        }

    def _headline(self) -> Mapping[str, object]:
        shares = dict(zip(("mu_M", "mu_V", "mu_G"), map(float, self.mean), strict=True))
        return {"rate": self.rate, "acceleration": self.acceleration, **shares}

    def plot(self) -> Figure:
        """Plot three maps of a leg's shares over the joint angles, each with its average."""
        from vpm.studies.linkages.pictures import plot_shares

        maps = {"μ_M, inertia": self.inertia, "μ_V, velocity": self.velocity, "μ_G, weight": self.gravity}
        return plot_shares(self.first, self.second, maps, f"up to {self.rate:g} rad/s, {self.acceleration:g} rad/s²")
