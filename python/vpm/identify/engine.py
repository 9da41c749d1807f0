"""The fit itself: starts, weights found on the way, descent, covariance; whatever is asked of it by `Fitting`."""

import warnings
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.special import ndtri

from vpm.errors import ExecutorError, IdentificationError
from vpm.identify.estimation import Estimate, blinded, limits, touching
from vpm.identify.identifiability import Combination, column_lengths, unseen_combinations
from vpm.identify.objective import Objective, noise_levels
from vpm.identify.parallel import worker_count
from vpm.identify.problem import Problem
from vpm.identify.settings import Fitting
from vpm.identify.solver import Box, Descent, Point, descend, sizes
from vpm.identify.statistics import record_groups, sandwich
from vpm.model import Model
from vpm.numbers import Array
from vpm.sending import Parcel
from vpm.tasks import Done, outcomes, until_interrupted

Progress = Callable[[int, float], None]

#: A start agrees with the best if its cost is within this share of it (and of rounding, beside where it began).
AGREEING, ROUNDING = 0.01, 1e-12
#: Rounds in which weights are found again, and the change of them that ends the rounds.
ROUNDS, SETTLED = 5, 0.02
#: Bounds further apart than this factor say nothing about where to start.
WIDE = 1e4
#: Largest change of a logarithm in one step.
FARTHEST = float(np.log(30.0))


@dataclass(frozen=True, kw_only=True)
class Found(Estimate):
    """An estimate of the engine, with first states behind the free parameters.

    Rows of the residual went into the fit with their ``weights``.
    """

    weights: Array
    states: Array
    states_std: Array
    noise: dict[str, float]
    costs: Array
    agreeing: int
    ended: str


def fit_problem(
    model: Model,
    data: Problem,
    free: Sequence[str],
    fitting: Fitting,
    *,
    tolerance: float,
    progress: Progress | None = None,
    begin: Array | None = None,
    executor: Executor | Callable[[], Executor] | None = None,
) -> Found:
    """Engine of a fit: free parameters, and first states if the problem has them.

    - ``tolerance``: relative change of parameters or cost at which to stop
    - ``begin``: shape (p,), parameters to begin with, in place of the starts of ``fitting``
    - ``executor``: descends from the starts, see `vpm.tasks.Tasks`; threads do if not given
    """
    bounds = limits(model, free, fitting.bounds)
    objective = Objective(model, data, free, bounds, fitting, progress)
    # Starts are compared under weights that are the same for all; losses and noise are found from the best.
    search = Objective(model, data, free, bounds, _plain(fitting), progress) if _weighs_later(fitting) else objective
    begun = starts(model, free, search, fitting) if begin is None else [search.coordinates(begin)]
    rough = 1e2 * tolerance if _weighs_later(fitting) else tolerance
    if len(begun) == 1:
        descents = [_descent(search, begun[0], fitting, rough)]
        interrupted = descents[0].interrupted
    elif executor is None:
        descents, interrupted = _search(search, begun, fitting, rough)
    else:
        descents, interrupted = _search_elsewhere(search, begun, fitting, rough, executor, progress)
    if interrupted and not descents:
        raise KeyboardInterrupt
    best = min(descents, key=lambda d: d.point.cost)
    if not np.isfinite(best.point.cost):
        raise IdentificationError(
            f"the simulation leaves the finite numbers from all of {len(descents)} starts; take more substeps, shorter "
            "pieces, or start values nearer to the truth"
        )
    highest = max(d.first_cost for d in descents if np.isfinite(d.first_cost))
    limit = (1.0 + AGREEING) * best.point.cost + ROUNDING * highest
    costs = np.array([d.point.cost for d in descents])
    point, ended = best.point, "interrupted" if interrupted else best.ended
    if _weighs_later(fitting):
        objective.count = search.count
        point, ended = _reweighed(objective, point, fitting, tolerance, ended)
    return _found(objective, point, free, costs, int(np.sum(costs <= limit)), ended)


def _weighs_later(fitting: Fitting) -> bool:
    return fitting.weighs_by_noise and fitting.noise != "given"


def _plain(fitting: Fitting) -> Fitting:
    """Settings of the fit engine for plain least squares, with residuals over their channel's spread."""
    return replace(fitting, loss="squares", noise="spread", priors=False, noise_levels={})


def _search(
    objective: Objective, begun: Sequence[Array], fitting: Fitting, tolerance: float
) -> tuple[list[Descent], bool]:
    """Descents of the engine from all starts, on threads, and whether Ctrl-C ended them."""
    jobs = [partial(_descent, objective, x, fitting, tolerance) for x in begun]
    found, interrupted = until_interrupted(jobs, worker_count(fitting.workers or None))
    return [descent for descent in found if descent is not None], interrupted


def _search_elsewhere(
    objective: Objective,
    begun: Sequence[Array],
    fitting: Fitting,
    tolerance: float,
    executor: Executor | Callable[[], Executor],
    progress: Progress | None,
) -> tuple[list[Descent], bool]:
    """Descents of the engine from all starts by an executor; a start whose worker keeps dying is left out."""
    shared = Parcel.of(objective)

    def heard(ended: Sequence[Done[int]]) -> None:
        for descent, count in (done.value for done in ended if done.error is None):
            objective.count += count
            if progress is not None:
                progress(objective.count, float(np.sqrt(descent.point.cost / max(1, descent.point.raw[0].size))))

    jobs = [partial(_sent_descent, shared, x, fitting, tolerance) for x in begun]
    names = [f"start {number}" for number in range(1, len(jobs) + 1)]
    found, interrupted = outcomes(jobs, executor, heard=heard, names=names)
    kept = [done.value[0] for done in found if done is not None and done.error is None]
    errors = [done.error for done in found if done is not None and done.error is not None]
    for error in errors:
        if not kept or not isinstance(error, ExecutorError):
            raise error
        warnings.warn(f"{error}; the fit goes on with the other starts", RuntimeWarning, stacklevel=2)
    return kept, interrupted


def _sent_descent(shared: Parcel, x: Array, fitting: Fitting, tolerance: float) -> tuple[Descent, int]:
    """Descent of the engine on a copy of the objective, and how often it was evaluated."""
    objective: Objective = shared.open()
    before = objective.count
    return _descent(objective, x, fitting, tolerance), objective.count - before


def _descent(objective: Objective, x: Array, fitting: Fitting, tolerance: float) -> Descent:
    first = objective(np.clip(x, objective.low, objective.high))
    if not np.isfinite(first.cost):
        return Descent(first, first.cost, 1, "no machine")
    return onward(objective, first, objective.low, objective.high, fitting.most_evaluations, tolerance)


def onward(
    objective: Objective,
    first: Point,
    low: Array,
    high: Array,
    most_evaluations: int,
    tolerance: float,
    evaluate: Callable[[Array], Point] | None = None,
) -> Descent:
    """Descend with the engine from a point of ``objective``, or of ``evaluate``, with coordinate scales.

    ``evaluate``: gives the points in place of the objective.
    """
    p = len(objective.columns)
    lengths = column_lengths(first.jacobian)
    size = np.where(objective.log, 1.0, sizes(first.x[:p], first.cost, lengths[:p]))
    scale = np.concatenate([size, np.ones(first.x.size - p)])
    reach = np.concatenate([np.where(objective.log, FARTHEST, np.inf), np.full(first.x.size - p, np.inf)])
    box = Box(low, high, scale, reach)
    return descend(evaluate or objective, first, box, tolerance=tolerance, most_evaluations=most_evaluations)


def _reweighed(objective: Objective, point: Point, fitting: Fitting, tolerance: float, ended: str) -> tuple[Point, str]:
    """Fit of the engine with weights from the residual, again until they stay."""
    for _ in range(ROUNDS):
        before = dict(objective.noise)
        levels = noise_levels(objective.data.blocks, point.raw[0], robust=fitting.loss != "squares")
        objective.noise = dict(levels)
        point = objective.weigh(point.x, *point.raw)
        if before and all(abs(np.log(levels[c] / before[c])) < SETTLED for c in levels):
            break
        if ended == "interrupted":
            break
        descent = onward(objective, point, objective.low, objective.high, fitting.most_evaluations, tolerance)
        point, ended = descent.point, descent.ended
    return point, ended


def starts(model: Model, free: Sequence[str], objective: Objective, fitting: Fitting) -> list[Array]:
    """Start coordinates of the engine: the model's own values, then a Latin hypercube.

    Around the model's value with its uncertainty if it has one, evenly between bounds that are not wide apart (of a
    positive parameter, evenly in its logarithm), else within a factor `Fitting.spread`.
    (M. McKay, R. Beckman, W. Conover, *Technometrics* 21, 1979.)
    """
    own = objective.coordinates(model.theta[objective.columns])
    random = np.random.default_rng(fitting.seed)
    count = fitting.starts - 1
    drawn = [own]
    if count == 0:
        return drawn
    places = [(random.permutation(count) + random.random(count)) / count for _ in free]
    columns = [
        _spread(u, own[k], objective, k, model.parameters[name].uncertainty, fitting)
        for k, (name, u) in enumerate(zip(free, places, strict=True))
    ]
    return drawn + [np.concatenate([row, objective.first]) for row in np.array(columns).T]


def _spread(u: Array, own: float, objective: Objective, k: int, uncertainty: float | None, fitting: Fitting) -> Array:
    low, high, log = objective.low[k], objective.high[k], bool(objective.log[k])
    value = float(np.exp(own)) if log else own
    if uncertainty is not None and np.isfinite(uncertainty):
        deviation = uncertainty / value if log else uncertainty
        return np.asarray(np.clip(own + deviation * ndtri(u), low, high))
    if (
        np.isfinite(low)
        and np.isfinite(high)
        and (high - low < np.log(WIDE) if log else abs(value) * WIDE > high - low)
    ):
        return np.asarray(low + u * (high - low))
    factor = np.log(fitting.spread) * ndtri(u)
    drawn = own + factor if log else own * np.exp(factor) if own else factor * 0.0
    return np.asarray(np.clip(drawn, low, high))


def _found(objective: Objective, point: Point, free: Sequence[str], costs: Array, agreeing: int, ended: str) -> Found:
    p, states = len(free), objective.shooting
    labels = [*free, *(states.labels if states else ())]
    slopes = objective.slopes(point.x)
    every = unseen_combinations(point.jacobian / slopes, labels)
    unseen = tuple(c for c in every if any(name in free for name in c.names))
    covariance = _covariance(objective, point, labels, every)
    std = np.sqrt(np.diag(covariance))
    residual, jacobian = point.raw
    values = objective.parameters(point.x)
    return Found(
        tuple(free),
        values,
        residual,
        jacobian[:, :p] / slopes[:p],
        covariance[:p, :p],
        unseen,
        touching(free, values, *objective.box),
        objective.count,
        ended == "interrupted",
        weights=_weights(point),
        states=point.x[p:] * objective.sizes,
        states_std=std[p:],
        noise=dict(objective.noise),
        costs=costs,
        agreeing=agreeing,
        ended=ended,
    )


def _weights(point: Point) -> Array:
    """Weights of a residual's rows in the engine by loss and noise; 1 where a row moves with nothing."""
    before = np.linalg.norm(point.raw[1], axis=1)
    after = np.linalg.norm(point.jacobian[: len(before)], axis=1)
    return np.where(before > 0.0, after / np.where(before > 0.0, before, 1.0), 1.0)


def _covariance(objective: Objective, point: Point, labels: Sequence[str], unseen: Sequence[Combination]) -> Array:
    """Covariance of parameters and first states in the engine: sandwich over records, with priors."""
    rows, told = len(point.residual), objective.data.blocks[-1].samples.stop
    data = rows - objective.priors
    expected = point.residual.copy()
    expected[data:] = 1.0  # a prior is off by its own standard deviation, whatever it happens to be off by
    groups = record_groups(objective.data.blocks)
    covariance = sandwich(point.jacobian, expected, groups, range(told, rows))
    slopes = objective.slopes(point.x)
    covariance *= np.outer(slopes, slopes)
    return blinded(covariance, unseen, labels)
