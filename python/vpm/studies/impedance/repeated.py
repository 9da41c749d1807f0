"""Repeated tests: mean, spread, and Student's t; tables in the layout of D'Imperio (2016), table 5.2."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import ArrayLike

from vpm.errors import IdentificationError
from vpm.numbers import Array
from vpm.results import Result

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Estimate(Protocol):
    """A test's outcome: Loop, Landing, Decay."""

    @property
    def stiffness(self) -> float:
        """Stiffness that one repeated test shows, N/m."""

    @property
    def damping(self) -> float:
        """Damping that one repeated test shows, N s/m."""


@dataclass(frozen=True, repr=False, eq=False)
class Repeated(Result):
    """A quantity from tests that were repeated.

    Attributes
    ----------
    values : ndarray, shape (n,)
    std : float
        Of one test, with n - 1 degrees of freedom.
    interval : tuple of float
        Two-sided interval of the mean at `confidence`, ``mean -+ t std / sqrt(n)``; errors that all tests share, such
        as the gain of a load cell or a delay, are not in it.
    """

    name: str
    unit: str
    values: Array
    mean: float
    std: float
    interval: tuple[float, float]
    confidence: float

    @property
    def n(self) -> int:
        """Number of repeated tests."""
        return self.values.size

    @property
    def relative_std(self) -> float:
        """Relative deviation of repeated tests, ``std / |mean|``, the sigma of table 5.2."""
        return self.std / abs(self.mean)

    @property
    def half_width(self) -> float:
        """Half of the interval of the mean of repeated tests."""
        return 0.5 * (self.interval[1] - self.interval[0])

    def __str__(self) -> str:
        return (
            f"{self.name} {self.mean:.4g} +- {self.half_width:.2g} {self.unit} "
            f"({100.0 * self.confidence:g} %, n = {self.n}), std {100.0 * self.relative_std:.2g} %"
        )

    def _frame_columns(self) -> Mapping[str, object]:
        return {"test": np.arange(self.n), f"{self.name} [{self.unit}]": self.values}


def repeat(values: ArrayLike, name: str = "value", unit: str = "1", *, confidence: float = 0.95) -> Repeated:
    """Mean, standard deviation and interval of repeated tests.

    Parameters
    ----------
    values : array-like, shape (n,)
        One number for each test, independent and about normal.
    confidence : float
        Between 0 and 1.

    Raises
    ------
    IdentificationError
        Fewer than two tests, or a value that is no finite number.
    """
    from scipy.special import stdtrit

    given = np.asarray(values, dtype=np.float64)
    if given.ndim != 1 or given.size < 2:
        raise IdentificationError(
            f"{name} has {given.size} repetition{'' if given.size == 1 else 's'}, and an interval needs at least two; "
            "repeat the test"
        )
    if not np.isfinite(given).all():
        at = int(np.flatnonzero(~np.isfinite(given))[0])
        raise IdentificationError(f"{name} is {given[at]} in test {at}; leave out tests that failed")
    if not 0.0 < confidence < 1.0:
        raise IdentificationError(f"confidence is {confidence}; give a share between 0 and 1, such as 0.95")
    mean, std = float(given.mean()), float(given.std(ddof=1))
    half = float(stdtrit(given.size - 1, 0.5 + 0.5 * confidence)) * std / given.size**0.5
    return Repeated(name, unit, given, mean, std, (mean - half, mean + half), confidence)


@dataclass(frozen=True, repr=False, eq=False)
class RepeatedTests(Result):
    """One row of the table: a joint at one impedance in one kind of test.

    Attributes
    ----------
    joint, impedance, test : str
        Such as ``"hip"``, ``"low"``, ``"quasi-static"``.
    """

    joint: str
    impedance: str
    test: str
    stiffness: Repeated
    damping: Repeated

    def __str__(self) -> str:
        return f"{self.joint}, {self.impedance}, {self.test}: {self.stiffness}; {self.damping}"


def repeat_tests(
    joint: str, impedance: str, test: str, estimates: Iterable[Estimate], *, confidence: float = 0.95
) -> RepeatedTests:
    """Stiffness and damping of repeated tests.

    Raises
    ------
    IdentificationError
        Fewer than two tests.
    """
    tests = list(estimates)
    label = f"{joint}, {impedance}, {test}: "
    return RepeatedTests(
        joint,
        impedance,
        test,
        repeat([one.stiffness for one in tests], f"{label}stiffness", "N/m", confidence=confidence),
        repeat([one.damping for one in tests], f"{label}damping", "N s/m", confidence=confidence),
    )


@dataclass(frozen=True, repr=False, eq=False)
class ImpedanceTable(Result):
    """Rows of repeated tests; printing it gives the layout of D'Imperio (2016), table 5.2, with intervals."""

    rows: tuple[RepeatedTests, ...]

    def __str__(self) -> str:
        head = f"{'test':14s}{'joint':8s}{'impedance':11s}{'n':>3s}"
        for name in ("k N/m", "c N s/m"):
            head += f"{name:>12s}{'interval':>14s}{'sigma':>8s}"
        return "\n".join([head, *map(_line, self.rows)])

    def _headline(self) -> Mapping[str, object]:
        return {"rows": len(self.rows)}

    def _html_rows(self) -> Mapping[str, object]:
        return {f"{r.test}, {r.joint}, {r.impedance}": f"{_cells(r.stiffness)}; {_cells(r.damping)}" for r in self.rows}

    def _frame_columns(self) -> Mapping[str, object]:
        rows: Sequence[RepeatedTests] = self.rows
        table: dict[str, object] = {
            "test": [row.test for row in rows],
            "joint": [row.joint for row in rows],
            "impedance": [row.impedance for row in rows],
            "n": [row.stiffness.n for row in rows],
        }
        for name, unit in (("stiffness", "N_per_m"), ("damping", "Ns_per_m")):
            columns: list[Repeated] = [getattr(row, name) for row in rows]
            table |= {
                f"{name}_{unit}": [one.mean for one in columns],
                f"{name}_low_{unit}": [one.interval[0] for one in columns],
                f"{name}_high_{unit}": [one.interval[1] for one in columns],
                f"{name}_relative_std": [one.relative_std for one in columns],
            }
        return table

    def plot(self) -> Figure:
        """Draw stiffness and damping of every row with their intervals. Needs the extra ``plot``."""
        from vpm.studies.impedance.pictures import plot_impedances

        return plot_impedances(self.rows)


def _cells(one: Repeated) -> str:
    """Cells for repeated tests: mean, half of the interval and relative standard deviation."""
    return f"{one.mean:12.4g}{f'+- {one.half_width:.2g}':>14s}{100.0 * one.relative_std:6.2g} %"


def _line(row: RepeatedTests) -> str:
    """One row of the impedance table as text."""
    head = f"{row.test:14s}{row.joint:8s}{row.impedance:11s}{row.stiffness.n:3d}"
    return head + _cells(row.stiffness) + _cells(row.damping)
