"""Intervals that do not take the problem for linear, or the residual for normal: profiles and block bootstrap."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from vpm.errors import IdentificationError
from vpm.experiment import Experiment, as_records
from vpm.identify.engine import onward
from vpm.identify.estimation import limits
from vpm.identify.first_states import BegunAnywhere, first_state_derivative
from vpm.identify.inverse_dynamics import InverseDynamicsProblem
from vpm.identify.objective import Objective
from vpm.identify.parallel import in_order, worker_count
from vpm.identify.problem import Block, tied, untied
from vpm.identify.settings import Fitting
from vpm.identify.solver import Point
from vpm.identify.statistics import correlation_length
from vpm.numbers import NORMAL_95, Array
from vpm.results import Result

if TYPE_CHECKING:
    from vpm.identify.fit_result import Fit


#: Relative error of an interval's half width, and steps towards it.
SHARP, MOST_STEPS = 0.01, 12
#: Records from which on whole records are drawn instead of pieces of them.
MANY_RECORDS = 8
#: Pieces are so many correlation lengths long.
LENGTHS = 3


@dataclass(frozen=True, repr=False, eq=False)
class Profile(Result):
    """Interval of one parameter, all others fitted anew along the way.

    Attributes
    ----------
    value, low, high : float
        Estimate and 95 % interval, SI; infinite where the data set no end.
    values, costs : ndarray, shape (k,)
        Where the profile was evaluated and the least sum of losses there.
    limit : float
        Sum of losses at the ends of the interval.
    """

    name: str
    unit: str
    value: float
    low: float
    high: float
    values: Array
    costs: Array
    limit: float

    def _headline(self) -> Mapping[str, object]:
        return {"name": self.name, "value": self.value, "low": self.low, "high": self.high, "unit": self.unit}

    def _frame_columns(self) -> Mapping[str, object]:
        return {"value": self.values, "cost": self.costs}


@dataclass(frozen=True, repr=False, eq=False)
class Bootstrap(Result):
    """Estimates from records drawn anew.

    Attributes
    ----------
    values : ndarray, shape (replicates, p)
        SI.
    drawn : str
        What was drawn: whole records, or pieces of so many samples.
    """

    _samples = ("values",)

    names: tuple[str, ...]
    units: tuple[str, ...]
    values: Array
    drawn: str

    @property
    def std(self) -> Array:
        """Standard deviation of each parameter by the bootstrap intervals, shape (p,)."""
        return np.asarray(np.std(self.values, axis=0, ddof=1))

    @property
    def intervals(self) -> Array:
        """95 % intervals, shape (p, 2): quantiles."""
        return np.asarray(np.quantile(self.values, [0.025, 0.975], axis=0).T)

    def to_dict(self) -> dict[str, Any]:
        """As of any result; intervals in the place of the replicates."""
        return {**super().to_dict(), "replicates": len(self.values), "intervals": self.intervals.tolist()}

    def _headline(self) -> Mapping[str, object]:
        return {"replicates": len(self.values), "drawn": self.drawn, "names": ", ".join(self.names)}

    def _frame_columns(self) -> Mapping[str, object]:
        return dict(zip(self.names, self.values.T, strict=True))


def profile_intervals(
    fit: Fit,
    experiments: Experiment | Sequence[Experiment],
    names: Sequence[str] | None = None,
    *,
    cutoff: float | None = None,
) -> tuple[Profile, ...]:
    """95 % intervals by profile likelihood.

    The parameter is held beside its estimate, all others are fitted again, and the interval ends where the sum of
    losses has grown by what its standard deviation says it should: 1.96 squared times the noise, times the ratio of the
    robust to the textbook variance, since neighbouring residuals resemble each other (J. Kent, *Biometrika* 69, 1982).
    For a linear problem this is the interval of the fit.

    Parameters
    ----------
    fit : Fit
        From the same experiments.
    names : sequence of str, optional
        By default all that were free.
    cutoff : float, optional
        As for the fit.

    Raises
    ------
    IdentificationError
        A name was not free, or the data cannot see it.
    """
    wanted = tuple(fit.names if names is None else names)
    for name in wanted:
        _ = fit[name]  # an error for names that were not free
        if not np.isfinite(fit.std[fit.names.index(name)]):
            raise IdentificationError(f"the data of this fit cannot see {name}, so it has no profile; leave it out")
    objective, at = _again(fit, experiments, cutoff)
    bread = np.asarray(np.linalg.pinv(at.jacobian.T @ at.jacobian, hermitian=True), dtype=np.float64)
    workers = worker_count((fit.fitting or Fitting()).workers or None)
    jobs = [partial(_profile, fit, objective, at, bread, fit.names.index(name)) for name in wanted]
    return tuple(in_order(jobs, workers))


def _profile(fit: Fit, objective: Objective, at: Point, bread: Array, place: int) -> Profile:
    """Profile likelihood of one parameter: both ends of its interval, and the costs on the way."""
    slope = objective.slopes(at.x)[place]
    spread = float(fit.std[place] / slope)
    growth = NORMAL_95**2 * spread**2 / bread[place, place]
    points: list[tuple[float, float]] = [(float(at.x[place]), at.cost)]
    ends = [_end(objective, at, bread, place, sign * NORMAL_95 * spread, growth, points) for sign in (-1.0, 1.0)]
    points.sort()
    coordinates = np.array([x for x, _ in points])
    values = np.exp(coordinates) if objective.log[place] else coordinates
    low, high = (np.exp(end) if objective.log[place] else end for end in ends)
    costs = np.array([cost for _, cost in points])
    name, unit = fit.names[place], fit.units[place]
    return Profile(name, unit, float(fit.values[place]), float(low), float(high), values, costs, at.cost + growth)


def _end(
    objective: Objective,
    at: Point,
    bread: Array,
    place: int,
    offset: float,
    growth: float,
    points: list[tuple[float, float]],
) -> float:
    low, high = float(objective.low[place]), float(objective.high[place])
    for _ in range(MOST_STEPS):
        held = float(np.clip(at.x[place] + offset, low, high))
        cost = _conditional(objective, at, bread, place, held).cost
        points.append((held, cost))
        reached = np.sqrt(max(cost - at.cost, 0.0) / growth)
        if abs(reached - 1.0) < SHARP:
            return held
        if reached < 1.0 and held in {low, high}:
            return held
        offset *= float(np.clip(1.0 / max(reached, 1e-3), 0.3, 3.0))
    return held if reached > 0.5 else float(np.sign(offset) * np.inf)


def _conditional(objective: Objective, at: Point, bread: Array, place: int, held: float) -> Point:
    """Least cost with one coordinate held, for a profile interval."""
    x = at.x + bread[:, place] / bread[place, place] * (held - at.x[place])
    x[place] = held
    low, high = objective.low.copy(), objective.high.copy()
    low[place] = high[place] = held
    first = objective(np.clip(x, low, high))
    if not np.isfinite(first.cost):
        return first
    return onward(objective, first, low, high, 15, 1e-5).point


def bootstrap(
    fit: Fit,
    experiments: Experiment | Sequence[Experiment],
    *,
    replicates: int = 200,
    seed: int = 0,
    piece: int | None = None,
    refit: bool = False,
    cutoff: float | None = None,
) -> Bootstrap:
    """Intervals from records drawn anew: whole ones if there are many, else pieces longer than their correlation.

    Pieces of one record are drawn around its end (D. Politis and J. Romano, in *Exploring the Limits of Bootstrap*,
    Wiley 1992), all channels together. By default each replicate is one Gauss-Newton step from the estimate, which is
    as good to first order as a fit (D. Andrews, *Econometrica* 70, 2002) and needs no simulation.

    Parameters
    ----------
    fit : Fit
        From the same experiments.
    piece : int, optional
        Samples of a piece; by default three correlation lengths of the residual.
    refit : bool
        Fit each replicate to the end, by simulation.
    cutoff : float, optional
        As for the fit.
    """
    if replicates < 2:
        raise IdentificationError(f"{replicates} replicates have no spread; give at least 2, better 200")
    objective, at = _again(fit, experiments, cutoff)
    blocks, random = objective.data.blocks, np.random.default_rng(seed)
    records = list(dict.fromkeys(block.experiment for block in blocks))
    length = _piece(at.residual, blocks) if piece is None else piece
    weights = [_drawn(blocks, records, length, len(at.residual), random) for _ in range(replicates)]
    jobs = [partial(_replicate, objective, at, w, refit) for w in weights]
    workers = worker_count((fit.fitting or Fitting()).workers or None) if refit else 1
    values = np.array(in_order(jobs, workers))
    whole = len(records) >= MANY_RECORDS
    drawn = f"{len(records)} whole records" if whole else f"pieces of {length} samples"
    return Bootstrap(fit.names, fit.units, values, drawn)


def _piece(residual: Array, blocks: Sequence[Block]) -> int:
    lengths = [correlation_length(residual[b.samples]) for b in blocks]
    shortest = min(b.samples.stop - b.samples.start for b in blocks)
    return int(min(max(1, shortest // 5), max(LENGTHS * max(lengths), round(shortest ** (1 / 3)))))


def _drawn(
    blocks: Sequence[Block], records: Sequence[str], length: int, rows: int, random: np.random.Generator
) -> Array:
    """Weights of block-bootstrap intervals: how often each row of the residual is drawn."""
    weights = np.ones(rows)
    whole = random.multinomial(len(records), np.full(len(records), 1.0 / len(records)))
    for place, record in enumerate(records):
        mine = [b for b in blocks if b.experiment == record]
        count = mine[0].samples.stop - mine[0].samples.start
        if len(records) >= MANY_RECORDS:
            times = np.full(count, float(whole[place]))
        else:
            begun = random.integers(0, count, size=max(1, round(count / length)))
            times = np.zeros(count)
            np.add.at(times, (begun[:, None] + np.arange(length)).ravel() % count, 1.0)
        for block in mine:
            weights[block.samples] = times[: block.samples.stop - block.samples.start]
    return weights


def _replicate(objective: Objective, at: Point, weights: Array, refit: bool) -> Array:
    root = np.sqrt(weights)
    step = np.linalg.lstsq(at.jacobian * root[:, None], -at.residual * root, rcond=1e-12)[0]
    x = np.clip(at.x + step, objective.low, objective.high)
    if refit:

        def weighted(coordinates: Array) -> Point:
            point = objective(coordinates)
            if not np.isfinite(point.cost):
                return point
            r, slopes = point.residual * root, point.jacobian * root[:, None]
            return Point(coordinates, float(r @ r), r, slopes, point.raw)

        x = onward(objective, weighted(x), objective.low, objective.high, 15, 1e-5, weighted).point.x
    return objective.parameters(x)


def _again(fit: Fit, experiments: Experiment | Sequence[Experiment], cutoff: float | None) -> tuple[Objective, Point]:
    """Objective of an earlier fit and the point where it ended, for its intervals."""
    from vpm.identify.comparison import comparison

    records = as_records(experiments)
    if tuple(e.name for e in records) != fit.experiments:
        raise IdentificationError(
            f"the fit is of {', '.join(fit.experiments)}, not of {', '.join(e.name for e in records)}; pass its records"
        )
    fitting = fit.fitting or Fitting()
    begun = fit.model.with_parameters(dict(zip(fit.names, map(float, fit.start), strict=True)))
    one = replace(fitting, workers=1)  # threads go to parameters and replicates instead
    data = comparison(
        begun, records, fit.mode, cutoff=cutoff, setup=fit.setup, ties=fit.ties, fitting=one, free=fit.names
    )
    plain = untied(data)
    if fit.departures.size and isinstance(plain, BegunAnywhere):
        plain = plain.begun(fit.departures)
        plain = plain.beside(first_state_derivative(fit.model, plain))
        data = tied(plain, fit.ties)
    if fit.expected.size and isinstance(plain, InverseDynamicsProblem):
        data = tied(plain.less(fit.expected), fit.ties)
    objective = Objective(begun, data, fit.names, limits(begun, fit.names, fitting.bounds), fitting)
    objective.noise = dict(fit.noise)
    states = np.array(list(fit.states.values())) / objective.sizes if fit.states else None
    return objective, objective(objective.coordinates(fit.values, states))
