"""What a climb found: each level with its fit and its error in validation, and where more detail stops to pay."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from vpm.model import Model
from vpm.results import Result, Storable

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, repr=False, eq=False)
class Level(Storable):
    """One level of detail of a climb, with its error and its parameters.

    Attributes
    ----------
    states : int
        Length of the state.
    freed : tuple of str
        Parameters that the data see first at this level; they were fitted alone before all were.
    values, std : dict of str to float
        All fitted parameters, SI, with standard deviations that hold for residuals whose neighbours are alike.
    errors : dict of str to float
        Share of each measured channel that is left on validation records.
    score : float
        By how many standard deviations it predicts validation records better than the best level below; infinite for
        the first.
    pays : bool
        Whether that is sure and more than a trifle.
    """

    name: str
    states: int
    freed: tuple[str, ...]
    values: dict[str, float]
    std: dict[str, float]
    errors: dict[str, float]
    score: float
    pays: bool

    @property
    def error(self) -> float:
        """Result of a level: root mean square of the channels' errors."""
        return math.sqrt(sum(error**2 for error in self.errors.values()) / len(self.errors))

    def __str__(self) -> str:
        sure = "" if self.score == float("inf") else f", {self.score:+.1f} standard deviations"
        freed = f"; new: {', '.join(self.freed)}" if self.freed else ""
        mark = "*" if self.pays else " "
        return f"{mark} {self.name:26s} {self.states:3d} states  error {100 * self.error:6.2f} %{sure}{freed}"


@dataclass(frozen=True, repr=False, eq=False)
class Climb(Result):
    """Errors and parameters of a model at growing levels of detail.

    Attributes
    ----------
    levels : tuple of Level
        Simplest first, as far as it went.
    top : str
        The level at which more detail stops to pay.
    left : tuple of str
        Finer levels that were not tried any more.
    mode : str
        Mode of simulation that was compared.
    model : Model
        The model of that level, with its fitted parameters.
    """

    levels: tuple[Level, ...]
    top: str
    left: tuple[str, ...]
    mode: str
    model: Model

    @property
    def chosen(self) -> Level:
        """Result of a climb: the level at which more detail stops to pay."""
        return next(level for level in self.levels if level.name == self.top)

    @property
    def drifts(self) -> dict[str, float]:
        """Result of a climb: parameter changes from first to chosen level, in standard deviations.

        What drifts by many took over physics that the lower levels did not have.
        """
        known = self.levels[: self.levels.index(self.chosen) + 1]
        found = {}
        for name, value in self.chosen.values.items():
            first = next(level for level in known if name in level.values)
            std = self.chosen.std[name]
            if first is not self.chosen and 0.0 < std < float("inf"):
                found[name] = (value - first.values[name]) / std
        return found

    @property
    def verdict(self) -> str:
        """Result of a climb in one sentence: how far detail pays."""
        if self.levels[-1].name == self.top:
            end = f"the finest level that the model has; it leaves {100 * self.chosen.error:.2f} %"
        else:
            end = f"which leaves {100 * self.chosen.error:.2f} %; more detail buys nothing that validation data show"
        return f"detail pays up to {self.top}, {end}"

    def __str__(self) -> str:
        """Text of a climb's result: levels and verdict."""
        lines = [
            f"levels on validation data, {self.mode} (* pays):",
            *(f"  {level}" for level in self.levels),
            self.verdict,
        ]
        drifts = {name: drift for name, drift in self.drifts.items() if abs(drift) > 3.0}
        if drifts:
            told = ", ".join(f"{name} by {drift:+.0f}" for name, drift in drifts.items())
            lines.append(f"moved by many standard deviations since their first level: {told}")
        return "\n".join(lines)

    def _headline(self) -> Mapping[str, object]:
        return {"top": self.top, "error": self.chosen.error, "levels": len(self.levels)}

    def _frame_columns(self) -> Mapping[str, object]:
        return {
            "level": [level.name for level in self.levels],
            "states": [level.states for level in self.levels],
            "error": [level.error for level in self.levels],
            "score": [level.score for level in self.levels],
            "pays": [level.pays for level in self.levels],
        }

    def plot(self) -> Figure:
        """Plot a climb's result: error against level, and the parameters at each. Needs the extra ``plot``."""
        from vpm.plot import plot_climb

        return plot_climb(self.levels, self.top)
