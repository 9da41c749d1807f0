"""Bounded least squares on any problem, with honest uncertainty: the descent of fits without `Fitting`."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares, lsq_linear

from vpm.identify.identifiability import (
    RANK_TOLERANCE,
    Combination,
    above_rounding,
    column_lengths,
    unseen_combinations,
)
from vpm.identify.moments import AXES, PAIRS, Coordinates, real_bodies
from vpm.identify.problem import Problem, segments
from vpm.identify.solver import DAMPING, Box, Point, descend, sizes
from vpm.identify.statistics import information_root, robust_covariance
from vpm.model import Model
from vpm.numbers import Array

#: Evaluations after which a fit is ended as it stands.
MOST_EVALUATIONS = 40

#: Share of the sum of squares by which a step of a descent falls that decides nothing any more.
FLAT = 1e-4
#: Share by which the sum of squares may grow along a direction that the data cannot see.
UNCHANGED = 1e-9

#: Relative difference to a bound at which an estimate rests on it, and distance to one that is zero.
TOUCHING, NEAR_ZERO = 1e-6, 1e-12

#: Called after every evaluation with (evaluations so far, root mean square of the weighted residual).
Progress = Callable[[int, float], None]


@dataclass(frozen=True)
class Estimate:
    """Result of one least-squares run, as arrays over the free parameters."""

    names: tuple[str, ...]
    values: Array
    residual: Array
    jacobian: Array
    covariance: Array
    unseen: tuple[Combination, ...]
    at_bounds: tuple[str, ...]
    evaluations: int
    interrupted: bool = False

    @property
    def std(self) -> Array:
        """Standard deviation of each estimate; infinite where the data cannot see it."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def deviations(self) -> dict[str, float]:
        """Standard deviations of an estimate by dotted names."""
        return dict(zip(self.names, map(float, self.std), strict=True))

    def of(self, names: Collection[str]) -> Estimate:
        """Estimate of some of its parameters alone."""
        places = [place for place, name in enumerate(self.names) if name in names]
        return replace(
            self,
            names=tuple(self.names[place] for place in places),
            values=self.values[places],
            jacobian=self.jacobian[:, places],
            covariance=self.covariance[np.ix_(places, places)],
        )

    def on(self, model: Model, ties: Mapping[str, str] | None = None) -> Model:
        """Model at estimated values, and at those of what follows them by ``ties``."""
        values = dict(zip(self.names, map(float, self.values), strict=True))
        followers = {follower: values[leader] for follower, leader in (ties or {}).items() if leader in values}
        return model.with_parameters({**values, **followers})


def estimate(
    model: Model,
    data: Problem,
    free: Sequence[str],
    *,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    tolerance: float = 1e-8,
    linear_only: bool = False,
    progress: Progress | None = None,
    most_evaluations: int = MOST_EVALUATIONS,
    nearest: bool = False,
) -> Estimate:
    """Estimate ``free`` parameters of ``model``: the residual of ``data`` becomes least.

    A first step solves the problem as if it were linear (which on the inverse-dynamics regressor it mostly is); the
    trust-region reflective method of SciPy finishes where it is not. Moments of inertia move as those of real bodies
    do, see `vpm.identify.moments`.

    Parameters
    ----------
    model : Model
        Gives the structure, the start values and the bounds.
    free : sequence of str
        Dotted parameter names.
    bounds : mapping, optional
        Bounds that replace those of the model, by parameter.
    tolerance : float
        Relative change of parameters or of the sum of squares at which to stop.
    linear_only : bool
        Stop after the first step.
    most_evaluations : int
        Where to stop in any case.
    nearest : bool
        Leave what nothing shows where it was.

    Raises
    ------
    KeyboardInterrupt
        Ctrl-C before the start was evaluated; later it ends the fit with the best values until then.
    """
    columns = [model.index(name) for name in free]
    box = limits(model, free, bounds or {})

    def among(bodies: tuple[Coordinates, Array, Array]) -> Estimate:
        frame, *ends = bodies
        counter = _Counter(model, data, columns, progress, frame)
        found = _started(counter, (ends[0], ends[1]), tolerance, most_evaluations, linear_only, nearest)
        return replace(found, at_bounds=touching(free, found.values, *box, near=NEAR_ZERO))

    found = among(real_bodies(model, free, *box))
    inside = np.clip(found.values, *box)
    if np.allclose(found.values, inside, rtol=TOUCHING, atol=NEAR_ZERO):
        return replace(found, values=inside)
    if found.interrupted:
        return replace(standing(model, data, free), interrupted=True)
    return among(real_bodies(model, free, *box, inside=True))


def _started(
    counter: _Counter, box: tuple[Array, Array], tolerance: float, most: int, linear_only: bool, nearest: bool
) -> Estimate:
    """Estimate from the values of the model, in a box of coordinates."""
    model, data, free = counter.model, counter.data, counter.names
    frame, (low, high) = counter.frame, box
    first = start = np.clip(frame.at(model.theta[counter.columns]), low, high)
    interrupted = False
    try:
        if counter.columns:
            start = _linear_step(counter, start, low, high)
            if not linear_only:
                start = _refine(counter, start, low, high, tolerance, most, descends=not nearest)
        start = _nearest(counter, start, first, low, high) if nearest else start
        residual, jacobian = counter(start)
        # Derivatives may leave all bounds where the motion itself does not; the best with derivatives stands then.
        if counter.best is not None and not np.all(np.isfinite(residual)):
            start, (residual, jacobian) = counter.best
    except KeyboardInterrupt:
        if counter.best is None:
            raise
        start, (residual, jacobian) = counter.best
        interrupted = True
    values, jacobian = frame.parameters(start), frame.by_parameters(jacobian)
    unseen = unseen_combinations(jacobian, free)
    covariance = _covariance(data, residual, jacobian, unseen, free)
    return Estimate(tuple(free), values, residual, jacobian, covariance, unseen, (), counter.count, interrupted)


def standing(model: Model, data: Problem, free: Sequence[str]) -> Estimate:
    """Estimate of ``free`` parameters at the values they have: residual, derivatives and uncertainty, nothing moved."""
    columns = [model.index(name) for name in free]
    residual, jacobian = data.evaluate(model, model.theta, columns)
    jacobian = above_rounding(jacobian, model, columns)
    unseen = unseen_combinations(jacobian, free)
    covariance = _covariance(data, residual, jacobian, unseen, free)
    return Estimate(tuple(free), model.theta[columns], residual, jacobian, covariance, unseen, (), 1)


def beside_stated(found: Estimate, model: Model, data: Problem) -> Estimate:
    """Estimate with deviations that the records and what the model states make together, as values that weigh both.

    Where neither tells anything deviations stay infinite.
    """
    return replace(found, covariance=_with_stated(found.names, model, data, found.residual, found.jacobian))


def beside_held(found: Estimate, model: Model, data: Problem, held: Sequence[str]) -> Estimate:
    """Estimate with parameters ``held`` beside it, and deviations from what the model file states.

    What was held is as sure as the records and the stated uncertainties of all parameters make it together. Its error
    moves the estimates along, which were fitted as if it were known.
    """
    names, first = [*found.names, *held], len(found.names)
    columns = [model.index(name) for name in names]
    residual, jacobian = data.evaluate(model, model.theta, columns)
    lengths = column_lengths(jacobian := above_rounding(jacobian, model, columns))
    covariance = _with_stated(names, model, data, residual, jacobian)
    blind = np.flatnonzero(~np.isfinite(np.diag(covariance)))
    own, others = np.split(jacobian / lengths, [first], axis=1)
    along = -np.linalg.lstsq(own, others, rcond=None)[0] * lengths[first:] / lengths[:first, None]
    known = np.where(np.isfinite(covariance), covariance, 0.0)[first:, first:]
    covariance = np.block(
        [[found.covariance + along @ known @ along.T, along @ known], [known @ along.T, covariance[first:, first:]]]
    )
    covariance[blind, blind] = np.inf
    return replace(found, names=tuple(names), values=model.theta[columns], jacobian=jacobian, covariance=covariance)


def _with_stated(names: Sequence[str], model: Model, data: Problem, residual: Array, jacobian: Array) -> Array:
    """Covariance of an estimation from the records and the uncertainties that the model states, infinite of neither."""
    lengths = column_lengths(jacobian)
    told = information_root(jacobian / lengths, residual, segments(data)) * lengths
    rows = np.vstack([told, np.diag([1.0 / (model.parameters[name].uncertainty or np.inf) for name in names])])
    scales = column_lengths(rows)
    spread = np.linalg.pinv(rows / scales) / scales[:, None]
    return blinded(spread @ spread.T, unseen_combinations(rows, names), names)


class _Counter:
    """Evaluates the problem at given values of the free parameters; remembers the last points and the best.

    A step is tried by its residual alone: derivatives, which take many times as long, are for those that are taken.
    """

    def __init__(
        self,
        model: Model,
        data: Problem,
        columns: list[int],
        progress: Progress | None,
        frame: Coordinates,
    ) -> None:
        self.model, self.data, self.columns, self.progress, self.frame = model, data, columns, progress, frame
        self.theta = model.theta.copy()
        self.count = 0
        self._tried: tuple[Array, Array] | None = None
        self._whole: tuple[Array, tuple[Array, Array]] | None = None
        self.best: tuple[Array, tuple[Array, Array]] | None = None
        self._least = np.inf

    def __call__(self, x: Array) -> tuple[Array, Array]:
        if self._whole is not None and np.array_equal(x, self._whole[0]):
            return self._whole[1]
        residual, slopes = self._evaluate(x, self.columns)
        if self._tried is None or not np.array_equal(x, self._tried[0]):
            self._count(residual)
        self._whole = x.copy(), (residual, slopes)
        if (cost := float(residual @ residual)) < self._least:
            self._least, self.best = cost, self._whole
        return residual, slopes

    @property
    def names(self) -> list[str]:
        return [self.model.parameter_names[column] for column in self.columns]

    def residual(self, x: Array) -> Array:
        if self._tried is not None and np.array_equal(x, self._tried[0]):
            return self._tried[1]
        if self._whole is not None and np.array_equal(x, self._whole[0]):
            return self._whole[1][0]
        residual, _ = self._evaluate(x, [])
        self._count(residual)
        self._tried = x.copy(), residual
        return residual

    def jacobian(self, x: Array) -> Array:
        return self(x)[1]

    def cost(self, x: Array) -> float:
        residual = self.residual(x)
        return float(residual @ residual) if np.all(np.isfinite(residual)) else np.inf

    def point(self, x: Array) -> Point:
        residual, slopes = self(x)
        usable = np.all(np.isfinite(residual)) and np.all(np.isfinite(slopes))
        return Point(x, float(residual @ residual) if usable else np.inf, residual, slopes, (residual, slopes))

    def _count(self, residual: Array) -> None:
        self.count += 1
        if self.progress is not None:
            self.progress(self.count, float(np.sqrt(np.mean(residual**2))))

    def _evaluate(self, x: Array, columns: list[int]) -> tuple[Array, Array]:
        """Evaluate for an estimation; infinite where the values make no machine."""
        theta = self.theta.copy()
        theta[self.columns] = self.frame.parameters(x)
        try:
            residual, jacobian = self.data.evaluate(self.model, theta, columns)
            return residual, self.frame.by_coordinates(above_rounding(jacobian, self.model, columns))
        except ValueError:
            if self.count == 0:  # the start itself: an error of the input, not of a step
                raise
            rows = self.data.blocks[-1].samples.stop
            return np.full(rows, np.inf), np.zeros((rows, len(columns)))


def _linear_step(counter: _Counter, start: Array, low: Array, high: Array) -> Array:
    """Bounded linear step of an estimation, if it is better than the start."""
    residual, jacobian = counter(start)
    moving = low < high  # a rod's two moments are equal: their difference is zero
    jacobian = jacobian[:, moving]
    lengths = column_lengths(jacobian)
    if not (np.all(np.isfinite(residual)) and np.all(np.isfinite(lengths)) and np.any(moving)):
        return start
    orthogonal, square = np.linalg.qr(jacobian / lengths)
    left, values, directions = np.linalg.svd(square, full_matrices=False)
    # Along what nothing shows there is no reason to move, but to make way at a bound: a quotient of two roundings would
    # lead to 1e14.
    least = RANK_TOLERANCE * values[0]
    blind = values < least
    square = np.maximum(values, least)[:, None] * directions
    bounds = ((low - start)[moving] * lengths, (high - start)[moving] * lengths)
    # By active sets, which end: the reflective method may halve its steps for ever.
    target = np.where(blind, 0.0, -left.T @ (orthogonal.T @ residual))
    step = lsq_linear(square, target, bounds, method="bvls", tol=1e-14)
    candidate = start.copy()
    candidate[moving] += step.x / lengths
    candidate = np.clip(candidate, low, high)
    better = np.sum(counter.residual(candidate) ** 2) <= np.sum(residual**2)
    return candidate if better else start


def _nearest(counter: _Counter, found: Array, start: Array, low: Array, high: Array) -> Array:
    """Estimated values moved back to the start along unidentifiable directions.

    Parameters stay where they were if that makes a machine, else the coordinates do.
    """
    residual, jacobian = counter(found)
    if not found.size or not np.all(np.isfinite(jacobian)):
        return found
    for frame in dict.fromkeys((counter.frame, Coordinates())):
        slopes = frame.by_parameters(jacobian)
        lengths = column_lengths(slopes)
        _, values, directions = np.linalg.svd(np.linalg.qr(slopes / lengths, mode="r"))
        blind = directions[values < RANK_TOLERANCE * max(float(values[0]), 1e-300)]
        if not blind.size:
            return found
        astray = blind.T @ (blind @ (lengths * frame.parameters(found - start))) / lengths
        nearer = np.asarray(np.clip(found - frame.at(astray), low, high))
        if np.sum(counter.residual(nearer) ** 2) <= (1.0 + UNCHANGED) * np.sum(residual**2):
            return nearer
    return found


def _refine(
    counter: _Counter, start: Array, low: Array, high: Array, tolerance: float, most: int, *, descends: bool = False
) -> Array:
    residual, jacobian = counter(start)
    if not np.all(np.isfinite(residual)):
        return start
    lengths = column_lengths(jacobian)
    if not np.all(np.isfinite(lengths)):  # a motion that parts from its way ever faster leads nowhere
        return start
    gradient = (jacobian / lengths).T @ residual
    interior = (start > low) & (start < high)
    # Nothing left to gain along any free direction: the problem was linear and the first step ended it.
    if np.all(np.abs(gradient[interior]) <= 1e-9 * np.sqrt(residual @ residual)):
        return start
    if descends and unseen_combinations(jacobian, counter.names):
        return _descended(counter, start, low, high, most)
    moving = low < high

    def whole(part: Array) -> Array:
        x = start.copy()
        x[moving] = part
        return x

    def residual_of(part: Array) -> Array:
        return counter.residual(whole(part))

    def slopes_of(part: Array) -> Array:
        return counter.jacobian(whole(part))[:, moving]

    inside = _strictly_inside(start[moving], low[moving], high[moving])
    if not np.all(np.isfinite(residual_of(inside))):  # a bound that the simulation does not bear, such as no friction
        return start
    result = least_squares(
        residual_of,
        inside,
        jac=slopes_of,
        bounds=(low[moving], high[moving]),
        method="trf",
        x_scale=1.0 / lengths[moving],
        max_nfev=most,
        xtol=tolerance,
        ftol=tolerance,
        gtol=1e-12,
    )
    solution = whole(np.asarray(result.x))
    return solution if np.sum(counter.residual(solution) ** 2) <= np.sum(residual**2) else start


def _descended(counter: _Counter, start: Array, low: Array, high: Array, most: int) -> Array:
    """Refine an estimate by a damped descent: what nothing shows stays, where a trust region wanders along it.

    Steps begin as those of most probable values, for noise as large as the residual and parameters as uncertain as
    they are stated. What the residual hardly shows may else leave what makes a machine, and no step comes back.
    """
    first = counter.point(start)
    lengths = column_lengths(first.jacobian)
    stated = (counter.model.parameters[name].uncertainty for name in counter.names)
    spread = counter.frame.spread(np.array([np.inf if one is None or not one > 0.0 else one for one in stated]))
    prior = first.cost / len(first.residual) / (spread * lengths) ** 2
    box = Box(low, high, sizes(start, first.cost, lengths), damping=np.where(np.isfinite(spread), prior / DAMPING, 1.0))
    found = descend(counter.point, first, box, tolerance=FLAT, most_evaluations=most, cost=counter.cost)
    if found.interrupted:
        raise KeyboardInterrupt
    return found.point.x


def _strictly_inside(x: Array, low: Array, high: Array) -> Array:
    """Estimation start strictly inside the bounds, as SciPy needs it."""
    width = np.where(np.isfinite(high - low), high - low, np.maximum(1.0, np.abs(x)))
    return np.clip(x, np.where(np.isfinite(low), low + 1e-9 * width, low), high - 1e-9 * np.minimum(width, 1e300))


def touching(names: Sequence[str], values: Array, low: Array, high: Array, near: float = 1e-300) -> tuple[str, ...]:
    """Names of estimates that rest on a bound, or are as ``near`` to one that is zero."""
    at = np.isclose(values, low, rtol=TOUCHING, atol=near) | np.isclose(values, high, rtol=TOUCHING, atol=near)
    return tuple(name for name, rests in zip(names, at, strict=True) if rests)


def limits(model: Model, free: Sequence[str], replaced: Mapping[str, tuple[float, float]]) -> tuple[Array, Array]:
    """Limits of each estimated parameter: as replaced, or of the model."""
    pairs = [replaced.get(n, _range(model, n, free)) for n in free]
    return np.array([p[0] for p in pairs], dtype=float), np.array([p[1] for p in pairs], dtype=float)


def _range(model: Model, name: str, free: Sequence[str]) -> tuple[float, float]:
    """Bounds for estimation from the model file; for a single principal inertia what the others allow.

    No principal moment of a body exceeds the sum of the other two, nor is it less than their difference.
    """
    parameter = model.parameters[name]
    body, _, axis = name.rpartition(".inertia.")
    names = [f"{body}.inertia.{other}" for other in AXES if other != axis]
    products = [f"{body}.inertia.{pair}" for pair in PAIRS]
    alone = axis in AXES and not any(n in free for n in (*names, *products))
    if not alone or any(model.parameters[n].value for n in products):
        return parameter.minimum, parameter.maximum
    first, second = (model.parameters[n].value for n in names)
    if first + second == 0.0:
        return parameter.minimum, parameter.maximum
    return max(parameter.minimum, abs(first - second)), min(parameter.maximum, first + second)


def _covariance(
    data: Problem, residual: Array, jacobian: Array, unseen: tuple[Combination, ...], free: Sequence[str]
) -> Array:
    """Robust covariance of an estimation; infinite for parameters in unidentifiable combinations."""
    lengths = column_lengths(jacobian)
    covariance = robust_covariance(jacobian / lengths, residual, segments(data)) / np.outer(lengths, lengths)
    return blinded(covariance, unseen, free)


def blinded(covariance: Array, unseen: Sequence[Combination], names: Sequence[str]) -> Array:
    """Covariance of an estimation with infinite variance for names in unidentifiable combinations."""
    covariance = covariance.copy()
    blind = [i for i, name in enumerate(names) if any(name in combination.names for combination in unseen)]
    covariance[blind, :] = 0.0
    covariance[:, blind] = 0.0
    covariance[blind, blind] = np.inf
    return covariance
