"""What a fit found: the values, how sure they are, and what to know before they are trusted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import ndtri, stdtrit

from vpm.errors import IdentificationError
from vpm.identify.estimation import Estimate
from vpm.identify.identifiability import Combination
from vpm.identify.problem import Problem, gaps
from vpm.identify.settings import Fitting
from vpm.identify.whiteness import Whiteness
from vpm.model import Model
from vpm.numbers import Array
from vpm.results import Result
from vpm.simulate import Setup

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, repr=False, eq=False)
class Fit(Result):
    """Result of a fit: identified parameters with their deviations.

    Attributes
    ----------
    mode : str
        Mode of comparison the residual came from.
    start, values, std : ndarray, shape (p,)
        Before, after, and one standard deviation (robust against autocorrelated and unequal residuals).
    correlation : ndarray, shape (p, p)
    before, after : dict
        ``{channel: (root mean square, share of the measured signal, unit)}`` on the fitted data.
    unidentifiable : tuple of Combination
        Combinations of parameters that the data cannot see; they stayed where they were.
    at_bounds : tuple of str
        Estimates that rest on a bound: widen it or question the model.
    model : Model
        The model with the identified values.
    warnings : tuple of str
        What to know before the numbers are trusted, one sentence each: residuals that repeat with the motion, estimates
        that contradict the model file, rest on a bound, are still at their start, not identifiable, or collinear; too
        few samples; constant channels; a fit that Ctrl-C ended.
    whiteness : tuple of Whiteness
        What is left of each channel of each record, and how much of that the motion explains.
    freedom : ndarray, shape (p,), or float
        Degrees of freedom of Student's t in the intervals: fewer than samples, because neighbours resemble each other,
        and fewer still where a few moments of the records decide.
    noise : dict
        ``{channel: standard deviation}`` that residuals were divided by, SI; empty where it was the signal's spread.
    states, states_std : dict
        Fitted first states, ``{"record, 0 s: axis.position": value}``, and their standard deviations, SI.
    offsets, offsets_std : dict
        What the channels of `Fitting.offsets` read too much in each record, ``{"record: gauge.strain": value}``, and
        their standard deviations, SI. `before` and `after` do not count them.
    costs : ndarray, shape (starts,)
        Sum of squares that each start reached, the model's own values first.
    agreeing : int
        Starts that came within 1 % of the least sum of squares.
    evaluations : int
        Simulations of all records with derivatives.
    ended : str
        ``"converged"``, ``"evaluations"`` or ``"interrupted"``; empty for a fit without `Fitting`.
    first_states : str
        ``"unknown"`` where nobody measured them, as those of joints without an encoder in an inverse-dynamics residual,
        or where those that the log suggests contradict the rest of it: the fit leaves them open. ``"unsettled"`` where
        it did not find them. Empty where they hold or are fitted.
    departures : ndarray, shape (records, states)
        By how much unknown first states are likeliest to differ from those that the log suggests; in a balance of
        effort those of coordinates, then rates, from a rest. Empty where none are unknown.
    expected : ndarray, shape (n,)
        The inverse-dynamics residual of the model's own simulation, which was taken off. Empty where no
        simulation stays by the records: intervals then know nothing of what filters do where friction turns round.
    setup, fitting, ties
        How it was done, for `profile_intervals` and `bootstrap`.
    """

    mode: str
    experiments: tuple[str, ...]
    names: tuple[str, ...]
    units: tuple[str, ...]
    start: Array
    values: Array
    std: Array
    correlation: Array
    before: dict[str, tuple[float, float, str]]
    after: dict[str, tuple[float, float, str]]
    unidentifiable: tuple[Combination, ...]
    at_bounds: tuple[str, ...]
    model: Model
    warnings: tuple[str, ...] = ()
    whiteness: tuple[Whiteness, ...] = ()
    freedom: Array | float = np.inf
    noise: dict[str, float] = field(default_factory=dict)
    states: dict[str, float] = field(default_factory=dict)
    states_std: dict[str, float] = field(default_factory=dict)
    offsets: dict[str, float] = field(default_factory=dict)
    offsets_std: dict[str, float] = field(default_factory=dict)
    costs: Array = field(default_factory=lambda: np.zeros(0))
    agreeing: int = 1
    evaluations: int = 0
    ended: str = ""
    first_states: str = ""
    departures: Array = field(default_factory=lambda: np.zeros((0, 0)))
    expected: Array = field(default_factory=lambda: np.zeros(0))
    setup: Setup | None = None
    fitting: Fitting | None = None
    ties: dict[str, str] = field(default_factory=dict)

    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C ended the fit; the values are the best until then."""
        return self.ended == "interrupted"

    @property
    def intervals(self) -> Array:
        """95 % intervals of a fit, shape (p, 2)."""
        known = np.isfinite(self.freedom)
        half = np.where(known, stdtrit(np.where(known, self.freedom, 1.0), 0.975), ndtri(0.975)) * self.std
        return np.column_stack([self.values - half, self.values + half])

    def __getitem__(self, name: str) -> float:
        """Fitted value of one parameter, SI."""
        if name not in self.names:
            raise IdentificationError(f"'{name}' was not free in this fit; free were {', '.join(self.names)}")
        return float(self.values[self.names.index(name)])

    def _headline(self) -> Mapping[str, object]:
        worst = max((share for _, share, _ in self.after.values()), default=0.0)
        values = dict(zip(self.names, map(float, self.values), strict=True))
        return {"mode": self.mode, **values, "residual": f"{100.0 * worst:.2f} %"}

    def _html_rows(self) -> Mapping[str, object]:
        rows = zip(self.names, self.values, self.std, self.units, strict=True)
        values = {name: f"{value:.6g} ± {std:.2g} {unit}" for name, value, std, unit in rows}
        return {**values, **{f"warning {i}": sentence for i, sentence in enumerate(self.warnings, 1)}}

    def _frame_columns(self) -> Mapping[str, object]:
        return {
            "name": list(self.names),
            "start": self.start,
            "value": self.values,
            "std": self.std,
            "unit": list(self.units),
        }

    def plot(self) -> Figure:
        """Plot fitted values with their intervals, relative to the start. Needs the extra ``plot``."""
        from vpm.plot import plot_parameters

        return plot_parameters(self.names, self.values, self.std, self.start, self.units)


def fit_of(
    model: Model,
    data: Problem,
    result: Estimate,
    before: Array,
    experiments: Sequence[str],
    ties: Mapping[str, str] | None = None,
) -> Fit:
    """Fit result of an estimate, with names, units and records.

    - ``before``: residual of the model that the fit is to be compared with
    - ``ties``: parameters that take the value of another
    """
    values = dict(zip(result.names, map(float, result.values), strict=True))
    shared = {follower: values.get(leader, model.parameters[leader].value) for follower, leader in (ties or {}).items()}
    fitted = model.with_parameters({**values, **shared})
    seen = np.isfinite(result.std)
    std = np.where(seen & (result.std > 0.0), result.std, 1.0)
    correlation = np.where(np.outer(seen, seen), result.covariance / np.outer(std, std), 0.0)
    np.fill_diagonal(correlation, 1.0)
    return Fit(
        data.mode,
        tuple(experiments),
        result.names,
        tuple(model.parameters[name].unit for name in result.names),
        model.theta[[model.index(name) for name in result.names]],
        result.values,
        result.std,
        correlation,
        gaps(data, before),
        gaps(data, result.residual),
        result.unseen,
        result.at_bounds,
        fitted,
    )
