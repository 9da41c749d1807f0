"""What a simplification found: all models that were tried, those nothing beats, and the one to take."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from vpm.budget import BudgetReport
from vpm.model import Model
from vpm.results import Result, Storable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Rungs that are printed.
PRINTED = 20


@dataclass(frozen=True, repr=False, eq=False)
class Rung(Storable):
    """One simplified model, with one way to step it.

    Attributes
    ----------
    removed : tuple of str
        What was made simpler, such as ``without coulomb_friction at elbow`` or ``upper as bezier(3)``.
    substeps : int
        In one period of the controller.
    states : int
        Length of its state.
    error : float
        Largest relative error over the channels, on the records to judge on.
    worst : str
        Channel of that error.
    loss : float
        What it lost against the full model.
    seconds : float
        Typical time of a period (median), s: what the rungs are ranked by.
    slowest : float
        Its 99.9 % quantile, s: what has to fit the period.
    errors : tuple of (str, float)
        Relative error of each channel.
    """

    removed: tuple[str, ...]
    integrator: str
    substeps: int
    states: int
    error: float
    worst: str
    loss: float
    seconds: float
    slowest: float
    errors: tuple[tuple[str, float], ...] = ()

    @property
    def stepping(self) -> str:
        """Integrator and steps in a period of a model on the Pareto front."""
        return self.integrator if self.substeps == 1 else f"{self.integrator} x {self.substeps}"

    def timed(self, seconds: float, slowest: float) -> Rung:
        """Model of the Pareto front with other step times."""
        return replace(self, seconds=seconds, slowest=slowest)

    def __str__(self) -> str:
        return (
            f"{1e6 * self.seconds:8.3g} us  error {100 * self.error:7.2f} %  {self.stepping:22s} "
            f"{self.states:3d} states  {', '.join(self.removed) or 'the full model'}"
        )


@dataclass(frozen=True, repr=False, eq=False)
class Ladder(Result):
    """All rungs that were tried and the one to take.

    Attributes
    ----------
    rungs : tuple of Rung
        Cheapest first; the full model is among them.
    chosen : Rung
        The cheapest one within the tolerance.
    holds : bool
        Whether it also fits its share of the period.
    rate : float
        Hz.
    share : float
        Share of the period that a step may take.
    mode, against : str
        What was simulated, and whether data or the full model are the reference.
    dearest : tuple of (str, float)
        What the step of the full model would lose without each place, s, the largest first.
    model : Model
        The chosen model, its parameters fitted again.
    budget : BudgetReport
        Of the chosen model: what its times are taken from.
    cut : int
        Reduced models that were not fitted, because by a coarse timing something quicker loses next to nothing.
    """

    rungs: tuple[Rung, ...]
    chosen: Rung
    holds: bool
    rate: float
    tolerance: float
    share: float
    mode: str
    against: str
    dearest: tuple[tuple[str, float], ...]
    model: Model
    budget: BudgetReport
    cut: int

    @property
    def front(self) -> tuple[Rung, ...]:
        """Pareto front: models that no other one beats in time and error at once, cheapest first."""
        return tuple(self.rungs[place] for place in pareto([(r.seconds, r.error) for r in self.rungs]))

    @property
    def full(self) -> Rung:
        """Most accurate way to step the full model, beside the Pareto front."""
        return min((r for r in self.rungs if not r.removed), key=lambda r: (r.error, r.seconds))

    @property
    def compromise(self) -> Rung | None:
        """Most accurate model of the Pareto front that fits the period; None where none does."""
        fitting = [r for r in self.rungs if r.slowest * self.rate <= self.share]
        return min(fitting, key=lambda r: (r.error, r.seconds), default=None)

    @property
    def verdict(self) -> str:
        """Sentence on the Pareto front: whether the budget holds, or what is the best that fits."""
        taken = f"{100 * self.chosen.slowest * self.rate:.3g} % of the period at p99.9, {100 * self.share:g} % allowed"
        if self.holds:
            gain = self.full.seconds / self.chosen.seconds
            times = "" if abs(gain - 1.0) < 0.05 else f"{gain:.3g} times "
            return f"it holds {self.rate:g} Hz ({taken}) and is {times}as fast as the full model"
        breaks = f"; most of the full model's step goes to {self.dearest[0][0]}" if self.dearest else ""
        other = self.compromise
        if other is None:
            return f"it does not hold {self.rate:g} Hz ({taken}), and nothing that was tried does{breaks}"
        return (
            f"it does not hold {self.rate:g} Hz ({taken}){breaks}; the best that does loses {100 * other.loss:.3g} % "
            f"({other.worst}): {', '.join(other.removed) or 'the full model'}, {other.stepping}"
        )

    def __str__(self) -> str:
        """Text of the Pareto front: the choice, the verdict, and its models."""
        chosen = self.chosen
        within = [r for r in self.rungs if r.loss <= self.tolerance and r.seconds < chosen.seconds]
        alike = ", the most exact of those that a clock cannot tell apart" if within else ""
        cut = f" ({self.cut} models were cut after coarse timing)" if self.cut else ""
        lines = [
            f"cheapest within {100 * self.tolerance:g} %: {', '.join(chosen.removed) or 'the full model'}; "
            f"{chosen.stepping}; error {100 * chosen.error:.2f} % of {chosen.worst} (loss {100 * chosen.loss:.2f} %), "
            f"{1e6 * chosen.seconds:.3g} us a step{alike}",
            self.verdict,
            f"{len(self.rungs)} ways were tried in {self.mode} against the {self.against}{cut}; nothing beats these:",
        ]
        return "\n".join(lines + [f"  {rung}" for rung in self.front[:PRINTED]])

    def _headline(self) -> Mapping[str, object]:
        return {"simpler": self.chosen.removed, "integrator": self.chosen.stepping, "holds": self.holds}

    def _frame_columns(self) -> Mapping[str, object]:
        names = ("integrator", "substeps", "states", "error", "worst", "loss", "seconds", "slowest")
        return {
            "simpler": [", ".join(r.removed) for r in self.rungs],
            **{name: [getattr(r, name) for r in self.rungs] for name in names},
            **{f"error[{c}]": [dict(r.errors)[c] for r in self.rungs] for c, _ in self.chosen.errors},
        }

    def plot(self) -> Figure:
        """Error against step time, with the front and the allowed share. Needs the extra ``plot``."""
        from vpm.plot import plot_ladder

        seconds, errors = [r.seconds for r in self.rungs], [r.error for r in self.rungs]
        front = pareto(list(zip(seconds, errors, strict=True)))
        return plot_ladder(
            seconds,
            errors,
            self.rungs.index(self.chosen),
            front,
            self.share / self.rate,
            self.chosen.error - self.chosen.loss + self.tolerance,
        )


def pareto(points: Sequence[tuple[float, float]]) -> list[int]:
    """Places of the points that no other one beats in both numbers, by the first number."""
    found: list[int] = []
    for place in sorted(range(len(points)), key=lambda k: points[k]):
        if not found or points[place][1] < points[found[-1]][1]:
            found.append(place)
    return found
