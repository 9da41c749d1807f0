"""An element from records beside what is known of it."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vpm.errors import DivergedError
from vpm.narx.maxwell import MaxwellNarx
from vpm.narx.maxwell_records import Samples
from vpm.narx.maxwell_recursion import POWER_NAMES
from vpm.numbers import Array
from vpm.results import Result

#: A free run beyond so many times the largest measured force counts as diverged.
FAR = 1e3


@dataclass(frozen=True, repr=False, eq=False)
class MaxwellFit(Result):
    """An element from records, with what is known of its coefficients.

    Attributes
    ----------
    element : MaxwellNarx
        The better of both on the training records.
    staged : MaxwellNarx
        From windows at rest, maps through them, then k1 and c1.
    refined : bool
        Whether `element` is the refined one.
    staged_rmse, refined_rmse : float
        Of free runs over all training records, N; infinite where one diverges or tau is none that records show, NaN
        without refinement.
    k0_std, s0_std : ndarray, shape (10,)
        Standard errors of the element's coefficients; zero where a term is not used, NaN where nothing is known because
        a given element was kept.
    drive_range, length_range : tuple of two floats
        Of the training records, beyond which the maps are guesses.
    evaluations : int
        Of the refinement.
    notes : tuple of str
        What was chosen and why, and what the records cannot tell.
    """

    element: MaxwellNarx
    staged: MaxwellNarx
    refined: bool
    staged_rmse: float
    refined_rmse: float
    k0_std: Array
    s0_std: Array
    k1_std: float
    c1_std: float
    drive_range: tuple[float, float]
    length_range: tuple[float, float]
    evaluations: int
    notes: tuple[str, ...]

    def _headline(self) -> Mapping[str, object]:
        return {
            "element": self.element,
            "refined": self.refined,
            "staged_rmse": self.staged_rmse,
            "refined_rmse": self.refined_rmse,
        }

    @property
    def coefficients(self) -> tuple[tuple[str, float, float], ...]:
        """Name, value and standard error of each: both maps in the order of `MaxwellNarx`, k1, c1."""
        e = self.element
        names = [f"{of}[{power}]" for of in ("k0", "s0") for power in POWER_NAMES] + ["k1", "c1"]
        values = [*map(float, e.k0), *map(float, e.s0), e.k1, e.c1]
        std = [*map(float, self.k0_std), *map(float, self.s0_std), self.k1_std, self.c1_std]
        return tuple(zip(names, values, std, strict=True))

    def _frame_columns(self) -> Mapping[str, object]:
        names, values, std = zip(*self.coefficients, strict=True)
        return {"coefficient": names, "value": values, "std": std}


def training_rmse(element: MaxwellNarx, samples: list[Samples]) -> float:
    """Training result: root mean square force error of free runs, N; infinite where one diverges."""
    total, count = 0.0, 0
    # Of all records: at some pose the force may be zero.
    bound = FAR * max(float(np.abs(one.force).max()) for one in samples) or np.inf
    for one in samples:
        try:
            run = element.simulate_free_run(one.length, (one.force[0], one.force[1]), one.drive, limit=bound)
        except DivergedError:
            return float("inf")
        total += float(np.sum((run - one.force)[2:] ** 2))
        count += one.force.size - 2
    return float(np.sqrt(total / count))


def unrefined(
    element: MaxwellNarx, samples: list[Samples], std: tuple[Array, Array, float, float], notes: tuple[str, ...]
) -> MaxwellFit:
    """Result of a Maxwell fit as it is, with standard errors of k0, s0, k1 and c1."""
    drive, length = (np.concatenate([getattr(one, name) for one in samples]) for name in ("drive", "length"))
    ranges = [(float(x.min()), float(x.max())) for x in (drive, length)]
    rmse = training_rmse(element, samples)
    return MaxwellFit(element, element, False, rmse, float("nan"), *std, ranges[0], ranges[1], 0, notes)
