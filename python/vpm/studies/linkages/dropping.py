"""Up to which motion a term of a leg's dynamics may be left out: the shares of dynamics, read the other way round."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike

from vpm.errors import ModelError
from vpm.numbers import Array
from vpm.results import Result
from vpm.studies.linkages.leg import Leg

if TYPE_CHECKING:
    from matplotlib.figure import Figure


#: Values of each rate and acceleration: an odd number has standstill and zero acceleration among them, where a term
#: that is left out weighs most against the others.
SAMPLES = 7
#: Rates or accelerations between which a limit is looked for, and how many: a tenth from one to the next.
LEAST, MOST, STEPS = 1e-2, 1e3, 121


@dataclass(frozen=True, repr=False, eq=False)
class DropLimit(Result):
    """How fast a leg may move when a term of its dynamics is left out.

    Attributes
    ----------
    term : {"velocity", "inertia"}
    tolerance : float
        Largest share of the effort, ``|X| / (|M a| + |V| + |G|)``, that may be missing.
    limit : float
        Largest rate (rad/s) for the velocity terms, or acceleration (rad/s^2) for the inertia terms, up to which no
        more is missing anywhere in the workspace; infinite where there is no such limit.
    first, second : ndarray, shape (R,) and (C,)
        Joint angles, rad.
    limits : ndarray, shape (R, C)
        The same in each configuration.
    other : float
        Limit of the other kind of motion: accelerations (rad/s^2) for the velocity terms, rates (rad/s) for the
        inertia terms.
    """

    term: str
    tolerance: float
    limit: float
    first: Array
    second: Array
    limits: Array
    other: float

    @property
    def unit(self) -> str:
        """Unit of the motion limit for dropping a term, rad/s or rad/s^2."""
        return "rad/s" if self.term == "velocity" else "rad/s^2"

    def share_of_workspace(self, motion: float) -> float:
        """Share of the workspace in which a term may be dropped up to this rate or acceleration."""
        return float(np.mean(self.limits >= motion))

    def __str__(self) -> str:
        """Sentence on dropping a term."""
        return (
            f"the {self.term} terms may be left out up to {self.limit:.3g} {self.unit} with at most "
            f"{100 * self.tolerance:g} % of the effort missing anywhere; up to {2 * self.limit:.3g} {self.unit} in "
            f"{100 * self.share_of_workspace(2 * self.limit):.0f} % of the workspace"
        )

    def _headline(self) -> Mapping[str, object]:
        return {"term": self.term, "tolerance": self.tolerance, "limit": self.limit}

    def _frame_columns(self) -> Mapping[str, object]:
        one, two = np.meshgrid(self.first, self.second, indexing="ij")
        return {"q1_rad": one.ravel(), "q2_rad": two.ravel(), "limit": self.limits.ravel()}

    def plot(self) -> Figure:
        """Map of the limits for dropping a term over the joint angles. Needs the extra ``plot``."""
        from vpm.studies.linkages.pictures import plot_shares

        worst = np.clip(self.limit / self.limits, 0.0, 1.0)
        title = f"{100 * self.tolerance:g} % of the effort is missing at {self.limit:.3g} {self.unit} where this is 1"
        return plot_shares(self.first, self.second, {f"lowest limit / limit, {self.term} terms": worst}, title)


def drop_limit(
    leg: Leg,
    term: Literal["velocity", "inertia"],
    tolerance: float,
    *,
    other: float = 0.0,
    first: ArrayLike | None = None,
    second: ArrayLike | None = None,
) -> DropLimit:
    """Limit of the motion up to which dropping a term of a leg's dynamics is allowed.

    The share of a term grows with the motion that makes it, all else the same: the velocity terms with the square of
    the rates, the inertia terms with the accelerations. So each configuration has one limit.

    Parameters
    ----------
    term : {"velocity", "inertia"}
    tolerance : float
        Largest share of the effort that may be missing, between 0 and 1.
    other : float
        Limit of the other kind of motion, rad/s^2 or rad/s. What else moves makes the missing share smaller: 0 is the
        worst case.
    first, second : array_like, optional
        Joint angles (rad); by default those of `Leg.shares`.

    Raises
    ------
    ModelError
        The term is weight or unknown, or a number is out of its range.

    Notes
    -----
    Source of the shares: D'Imperio 2016, eq 2.109 and section 2.4.2, with the sum of norms; see `Leg.shares`.
    """
    if term not in ("velocity", "inertia"):
        raise ModelError(f'a term "{term}" cannot be left out; choose "velocity" or "inertia"')
    if not 0.0 < tolerance < 1.0:
        raise ModelError(f"a tolerance of {tolerance:g} is not possible; give a share between 0 and 1")
    if not 0.0 <= other < np.inf:
        raise ModelError(f"a limit of {other:g} for the other motion is not possible; give zero or more")

    # Largest motions that are looked at, all configurations at once; between two the share is as good as linear.
    motions = np.geomspace(LEAST, MOST, STEPS)
    missing = []
    for motion in motions:
        duty = (motion, other) if term == "velocity" else (other, motion)
        shares = leg.shares(duty, first=first, second=second, samples=SAMPLES)
        missing.append(shares.velocity if term == "velocity" else shares.inertia)
    limits = _crossings(np.log(motions), np.array(missing), tolerance)
    return DropLimit(term, tolerance, float(limits.min()), shares.first, shares.second, limits, other)


def _crossings(places: Array, values: Array, level: float) -> Array:
    """Crossings of growing columns with a level, beyond which no term is dropped; infinite without one.

    A column that begins above the level crosses it where it begins.
    """
    above = values >= level
    row = np.argmax(above, axis=0)
    reached = np.take_along_axis(values, row[None], axis=0)[0]
    before = np.take_along_axis(values, np.maximum(row - 1, 0)[None], axis=0)[0]
    rise = np.where(reached > before, reached - before, 1.0)
    share = np.where(row > 0, (level - before) / rise, 1.0)
    start = places[np.maximum(row - 1, 0)]
    crossed = np.exp(start + share * (places[row] - start))
    return np.where(above.any(axis=0), crossed, np.inf)
