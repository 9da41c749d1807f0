"""Fits of structures to the residual that a tracker leaves, and their evidence."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import lsq_linear

from vpm.errors import VpmError
from vpm.numbers import Array
from vpm.ranking.model_structure import Structure
from vpm.ranking.noise_model import NoiseModel, Parts, white_noise
from vpm.ranking.posterior import log_volume
from vpm.ranking.settings import FAINT, LONGEST, MOVE, NEARER, RETREAT, TRIALS, TRIALS_BY_SECANTS, Settings
from vpm.ranking.tracked_records import NOTHING, By, TrackedRecords, Tracker

#: Residuals and derivatives that no record has; their squares are still numbers.
RUNAWAY = 1e100
#: What rounding leaves of the diagonal of scaled normal equations.
ROUNDED = 1e-12
#: Weight of borders that a step has to keep beside what it wants to reach, and deviations of priors short of them.
FIRM, HAIR = 1e6, 1e-6
#: Deviations of its prior by which a parameter is moved to see whether derivatives tell what that does, and the share
#: of the change that they may be wrong by.
SEEN, WRONG = 0.01, 0.1
#: What is raised of structures that the records contradict, that cannot be computed, or whose bodies are not real.
ASTRAY = (ValueError, ArithmeticError)


@dataclass(frozen=True, eq=False)
class Followed:
    """Residual that a tracker leaves under a structure, with derivatives for a fit."""

    structure: Structure
    tracker: Tracker
    names: tuple[str, ...]  #: Unknown parameters by which there are derivatives.
    residual: Array  #: Shape (N, m).
    jacobian: Array  #: Shape (N, m, len(names)).
    few: Tracker | None = None  #: Tracker of fewer steps, of which the derivatives are and with which a fit goes on.
    offset: Array | float = 0.0  #: What its steps leave less.

    @property
    def coarse(self) -> Followed:
        """What the tracker of fewer steps leaves, with its derivatives."""
        return replace(
            self, tracker=self.few or self.tracker, residual=self.residual - self.offset, few=None, offset=0.0
        )

    @property
    def fine(self) -> Followed:
        """What is left, from which a fit goes on by the steps of its own tracker."""
        return replace(self, few=None, offset=0.0)


@dataclass(frozen=True, eq=False)
class Fitted:
    """Fit of a structure under a tracker: its most probable values."""

    structure: Structure
    tracker: Tracker
    residual: Array  #: Shape (N, m).
    cost: float  #: See `Fitter.cost`, under the view of the fit.
    ended: bool = False  #: Whether all its derivatives, worked out anew under that view, lead nowhere any more.


@dataclass(frozen=True, eq=False)
class View:
    """View for a fit: the noise model of residuals, and derivatives that are taken as known."""

    noise: NoiseModel
    #: Each of shape (n,); prediction errors by a unit of parameters, where a fit begins.
    known: Mapping[str, Array] = field(default_factory=dict)

    def errors(self, followed: Followed, parts: Parts) -> tuple[Array, Array]:
        """Prediction errors (n,) for a fit, and their change by deviations of the priors (n, k)."""
        errors = self.noise.whitened(followed.residual, parts)
        fresh = dict(zip(followed.names, self.noise.whitened(followed.jacobian, parts).T, strict=True))
        slopes = np.empty((len(errors), len(followed.structure.priors)))
        for place, (name, slope) in enumerate(zip(followed.structure.priors, followed.structure.slopes, strict=True)):
            slopes[:, place] = (fresh[name] if name in fresh else self.known[name]) * slope
        return errors, slopes

    def weighted(self, errors: Array, slopes: Array) -> tuple[Array, Array]:
        """Weighted prediction errors for a fit, by square roots of their weights."""
        return in_roots(errors, slopes, self.noise.roots(errors))


class Fitter:
    """Fits structures to the residual of a tracker on the stretches for training.

    Derivatives come from as few steps of the integrator as will do: they only show the way, and cost most. So do
    residuals on the way, with what more steps leave more where they were last taken (N. Alexandrov and R. Lewis,
    *Optimization and Engineering* 2, 2001).
    """

    def __init__(self, tracked: TrackedRecords, settings: Settings) -> None:
        self.tracked, self.settings = tracked, settings

    def fitted(
        self,
        structure: Structure,
        tracker: Tracker,
        view: View,
        goal: float = math.inf,
        residual: Array | None = None,
        *,
        rough: bool = False,
    ) -> Fitted:
        """Fit by bounded Gauss-Newton steps under a view; the first ``residual`` may be known.

        A ``rough`` one trusts few steps of the integrator to its end where these change little, as `Fitted.tracker`
        then tells. A fit gives up where several times the gain that a step predicts would not bring the `cost` below a
        goal. Derivatives cost many times what residuals do, so that secants correct them from step to step. Where a
        step by these leads nowhere, they are worked out anew.

        Raises
        ------
        VpmError
            The structure runs away from the records where it begins.
        """
        names = tuple(name for name in structure.priors if name not in view.known)
        now = self.followed(structure.at(structure.standard), tracker, names, residual)
        return self._descended(now, view, goal, rough=rough)[0]

    def _by_steps_that_do(self, now: Followed) -> Followed:
        """Where a fit is, to go on by few steps if these change what is left by less than an effect has to.

        Twice as many may do where the tracker's own are of order four, which cost more.
        """
        if now.few is None:
            return now
        model, several = now.structure.model, [now.few]
        if self.tracked.setup.method(model, drawn=True) == "additive":
            steps = max(self.tracked.stepping(model, now.few, record.dt)[1] for record in self.tracked.records)
            several.append(replace(now.few, fewest=2 * steps))
        for few in several:
            with contextlib.suppress(*ASTRAY):
                offset = now.offset if few is now.few else now.residual - self._pass(now.structure, few)[0]
                if self._is_little(offset, now.residual):
                    return replace(now, few=few, offset=offset)
        return now.fine

    def _is_little(self, change: Array | float, residual: Array) -> bool:
        """Whether a change of the residual of a fit is less than an effect has to make, in each channel."""
        changes = np.broadcast_to(change, residual.shape)
        powers = (sum(np.sum(one[part] ** 2, axis=0) for part in self.tracked.parts) for one in (changes, residual))
        return bool(np.all(next(powers) < self.settings.worth * next(powers)))

    def moved(self, start: Followed, view: View, anew: bool = False) -> tuple[Fitted, Array]:
        """Fit from a start with known derivatives, near the end of another fit: secants update them.

        With ``anew`` they are worked out again where these lead nowhere.

        Returns
        -------
        fitted : Fitted
        slopes : ndarray, shape (n, k)
            Change of the prediction errors by deviations of the priors, by the last secant.
        """
        return self._descended(start, view, fresh=False, anew=anew)

    def _descended(
        self,
        start: Followed,
        view: View,
        goal: float = math.inf,
        *,
        fresh: bool = True,
        anew: bool = True,
        rough: bool = False,
    ) -> tuple[Fitted, Array]:
        """Gauss-Newton descent of a fit from known derivatives, updated by secants or computed ``anew``.

        Few steps of the integrator show the way where they do as well; where they led up, those of the tracker do.
        """
        now = self._by_steps_that_do(start)
        told, before = now, self.cost(start.structure, start.residual, view.noise)
        errors, slopes = view.errors(now, self.tracked.parts)
        tolerance = self._tolerance(view, errors, slopes) if now.structure.priors else math.inf
        ended = False
        for _ in range(self.settings.iterations if now.structure.priors else 0):
            move, gain = self._step(now.structure, view, errors, slopes)
            hopeful = before - self.settings.patience * gain <= goal
            step, trials = (move, errors, slopes @ move), TRIALS if fresh else TRIALS_BY_SECANTS
            better = self._better(now, view.noise, step, before, trials) if hopeful and gain >= tolerance else None
            if better is None and hopeful:
                better = self._pulled(now, view, (errors, slopes), before)
            slow = better is None or before - better[2] < tolerance
            if better is not None:
                move = now.structure.way_to(better[0])
                now, last, before = replace(now, structure=better[0], residual=better[1]), errors, better[2]
                errors = view.noise.whitened(now.residual, self.tracked.parts)
                slopes = by_secant(slopes, errors - last, move)
            if slow and (fresh or not anew):
                ended = fresh and hopeful and not view.known
                break
            fresh = slow
            if fresh:
                if (exact := now if rough else self._exact(now, told, view)) is None:
                    return self._descended(told.fine, view, goal, fresh=False, anew=anew)
                now = self._anew(exact, rough=rough)
                now = self._by_steps_that_do(now) if start.few else now.fine
                told, before = now, self.cost(now.structure, now.residual, view.noise)
                errors, slopes = view.errors(now, self.tracked.parts)
                tolerance = self._tolerance(view, errors, slopes)
        if rough and now.few is not None and now.structure is not start.structure:
            return Fitted(now.structure, now.few, now.residual, before), slopes
        if (exact := self._exact(now, told, view)) is None:
            if not ended:
                return self._descended(told.fine, view, goal, fresh=False, anew=anew)
            exact = told  # what few steps gained was next to nothing
        before = self.cost(exact.structure, exact.residual, view.noise)
        return Fitted(exact.structure, exact.tracker, exact.residual, before, ended), slopes

    def _anew(self, now: Followed, *, rough: bool) -> Followed:
        """Where a fit has come to, with derivatives worked out anew; a rough one keeps what more steps leave more."""
        if not rough or now.few is None:
            return self.followed(now.structure, now.tracker, now.names, now.residual)
        return replace(now, jacobian=self.followed(now.structure, now.tracker.coarse, now.names).jacobian)

    def _exact(self, now: Followed, told: Followed, view: View) -> Followed | None:
        """What a fit came to by few steps since it was told exactly, by those of its own tracker; None if worse."""
        if now.few is None or now.structure is told.structure:
            return now
        with contextlib.suppress(*ASTRAY):
            residual, _ = self._pass(now.structure, now.tracker)
            after, before = (
                self.cost(*one, view.noise) for one in ((now.structure, residual), (told.structure, told.residual))
            )
            return replace(now, residual=residual) if after <= before else None
        return None

    def finished(self, found: Fitted, view: View) -> Fitted:
        """Fit continued with all derivatives until nothing is gained.

        Raises
        ------
        VpmError
            A rough one runs away from the records by the steps of its own tracker.
        """
        if not found.tracker.fine:
            found = self.unfitted(found.structure, Tracker(found.tracker.band), view)
        for _ in range(self.settings.turns):
            if found.ended:
                break
            more = self.fitted(found.structure, found.tracker, view, residual=found.residual)
            if found.cost - more.cost < self.settings.tolerance:
                break
            found = more
        return found

    def followed(
        self, structure: Structure, tracker: Tracker, names: Sequence[str], residual: Array | None = None
    ) -> Followed:
        """Residual of a tracker with derivatives by some parameters, for a fit.

        Derivatives are by as few integration steps as these are stable with.

        - ``residual``: of the tracker itself, where it is known

        Raises
        ------
        VpmError
            The structure runs away from the records.
        """
        by = [structure.place(name) for name in names], structure.moves(names)
        if not tracker.fine:
            return Followed(structure, tracker, tuple(names), *self._pass(structure, tracker, by))
        if residual is None:
            residual, _ = self._pass(structure, tracker)
        fewest, *more = self._few_steps(structure, tracker)
        with contextlib.suppress(*ASTRAY):  # contacts may be too stiff for few steps
            left, jacobian = self._pass(structure, fewest, by)
            if not self._is_unstable(structure, tracker, by, residual, jacobian):
                return Followed(structure, tracker, tuple(names), residual, jacobian, fewest, residual - left)
        for short in more:
            with contextlib.suppress(*ASTRAY):
                left, jacobian = self._pass(structure, short, by)
                if self._tells(structure, tracker, by, residual, jacobian):
                    return Followed(structure, tracker, tuple(names), residual, jacobian)
        return Followed(structure, tracker, tuple(names), residual, self._pass(structure, tracker, by)[1])

    def _few_steps(self, structure: Structure, tracker: Tracker) -> list[Tracker]:
        """Trackers of a fit with the fewest integration steps, and with as short ones as compare structures."""
        fewest = tracker.coarse
        short = replace(fewest, fewest=max(math.ceil(record.dt / LONGEST) for record in self.tracked.records))
        same = all(
            self.tracked.stepping(structure.model, fewest, record.dt)
            == self.tracked.stepping(structure.model, short, record.dt)
            for record in self.tracked.records
        )
        return [fewest] if same else [fewest, short]

    def unfitted(self, structure: Structure, tracker: Tracker, view: View | None = None) -> Fitted:
        """Structure as it is in the place of a fit, with its cost under a view or under white noise of its own.

        Raises
        ------
        VpmError
            The structure runs away from the records.
        """
        residual, _ = self._pass(structure, tracker)
        noise = white_noise(residual, self.tracked.parts) if view is None else view.noise
        cost = self.cost(structure, residual, noise)
        return Fitted(structure, tracker, residual, cost)

    def noise_of(self, structure: Structure, tracker: Tracker) -> NoiseModel:
        """White noise model for the start of a fit: root mean square residual of each channel.

        Raises
        ------
        VpmError
            The structure runs away from the records.
        """
        residual, _ = self._pass(structure.at(structure.standard), tracker)
        return white_noise(residual, self.tracked.parts)

    def log_density(self, fitted: Fitted, noise: NoiseModel) -> Array:
        """Log-density of each fitted sample under a noise model (n,)."""
        return noise.log_density(noise.whitened(fitted.residual, self.tracked.parts))

    def evidence(self, fitted: Fitted, noise: NoiseModel) -> float:
        """Evidence of a fit: log-density of the records under a structure and a noise model, nats.

        Law: Laplace's method about the most probable values (D. MacKay, *Neural Computation* 4, 1992).
        """
        structure = fitted.structure
        followed = self.followed(structure, fitted.tracker, tuple(structure.priors), fitted.residual)
        errors, slopes = View(noise).errors(followed, self.tracked.parts)
        informed = np.repeat(np.sqrt(noise.information()), len(errors) // fitted.residual.shape[1])
        known = slopes * informed[:, None]
        z = structure.standard
        likely = float(np.sum(noise.log_density(errors)))
        return likely - 0.5 * float(z @ z) - 0.5 * log_volume(known)

    def cost(self, structure: Structure, residual: Array, noise: NoiseModel) -> float:
        """Cost of a fit: negative log-posterior density but for a constant."""
        errors = noise.whitened(residual, self.tracked.parts)
        return noise.cost(errors) + 0.5 * float(structure.standard @ structure.standard)

    def _step(self, structure: Structure, view: View, errors: Array, slopes: Array) -> tuple[Array, float]:
        """Bounded Gauss-Newton step of a fit, and its predicted gain in nats."""
        move = bounded_step(structure, *view.weighted(errors, slopes), self.settings.reach)
        gain = view.noise.cost(errors) - view.noise.cost(errors + slopes @ move)
        return move, gain + likelier(structure, move)

    def _tolerance(self, view: View, errors: Array, slopes: Array) -> float:
        """Gain of a step, nats, below which a fit ends: what chance makes of it.

        No more than what each step of a fit, in the mean, has to gain to make an effect worth it.
        """
        channels, settings = len(view.noise.tails), self.settings
        often = counted_too_often(*view.weighted(errors, slopes), channels, settings.pieces)
        most = settings.needed(len(errors) // channels) / (settings.turns * settings.iterations)
        return max(settings.tolerance, min(settings.tolerance * often, most))

    def _better(
        self, now: Followed, noise: NoiseModel, step: tuple[Array, Array, Array], before: float, trials: int
    ) -> tuple[Structure, Array, float] | None:
        """Whole step, or its best share, if that improves the fit, with residual and cost; it needs no derivatives.

        Along a step errors are a parabola, given by their values and slope where it begins and by their values at its
        end. Where that is no parabola, the next one ends where the last one was best, if it then still promises a gain.
        Where the model runs away from the records, a small share of the step is tried.
        """
        move, errors, along = step
        share = 1.0
        for trial in range(trials):
            tried = now.structure.moved(share * move)
            try:
                residual = self._by_few_steps(tried, now)
            except ASTRAY:
                share *= RETREAT
                continue
            after = self.cost(tried, residual, noise)
            if after < before:
                return tried, residual, after
            if trial == trials - 1:
                break
            bent = (noise.whitened(residual, self.tracked.parts) - errors - share * along) / share**2
            costs = [(noise.cost(errors + part * along + part**2 * bent), part) for part in share * NEARER]
            least, share = min(costs)
            if trial and noise.cost(errors) - least < self.settings.tolerance:
                break
        return None

    def _pulled(
        self, now: Followed, view: View, linear: tuple[Array, Array], before: float
    ) -> tuple[Structure, Array, float] | None:
        """Step of a fit to likelier values that the errors do not tell from its own, if it is worth a pass.

        Where only ratios of parameters show, as of a drive and of all that it moves, one false derivative else keeps
        all of them far from what is known.
        """
        weighted, slopes = view.weighted(*linear)
        variance = float(np.mean(weighted**2))
        move = bounded_step(now.structure, np.zeros_like(weighted), slopes, self.settings.reach, variance)
        if likelier(now.structure, move) < self.settings.tolerance:
            return None
        tried = now.structure.moved(move)
        with contextlib.suppress(*ASTRAY):
            residual = self._by_few_steps(tried, now)
            after = self.cost(tried, residual, view.noise)
            return (tried, residual, after) if after < before else None
        return None

    def _by_few_steps(self, structure: Structure, near: Followed) -> Array:
        """Residual of a structure near another one in a fit, by few steps if these stand for its tracker there."""
        return self._pass(structure, near.few or near.tracker)[0] + near.offset

    def _pass(self, structure: Structure, tracker: Tracker, by: By = NOTHING) -> tuple[Array, Array]:
        columns, moves = by
        theta = structure.theta if moves is None else structure.with_room(columns, moves)
        residual, jacobian = self.tracked.follow(structure.model, theta, tracker, *by)
        if self._is_unstable(structure, tracker, by, residual, jacobian):
            residual, jacobian = self.tracked.follow(structure.model, structure.theta, tracker, by[0])
        if not all(np.max(np.abs(numbers), initial=0.0) < RUNAWAY for numbers in (residual, jacobian)):
            raise VpmError(f"{structure.model.name} runs away from the records")
        return residual, jacobian

    def _tells(self, structure: Structure, tracker: Tracker, by: By, residual: Array, jacobian: Array) -> bool:
        """Whether derivatives of a fit tell how a move by the parameter that moves the model farthest changes it."""
        columns, moves = by
        if moves is None or not columns:
            return True
        channel, number, _ = self._farthest(moves, jacobian)
        move = moves[number] * SEEN / MOVE
        change = (self._moved_by(structure, tracker, columns[number], move) - residual)[:, channel]
        missed = change - move * jacobian[:, channel, number]
        return bool(np.sum(missed**2) < WRONG**2 * np.sum(change**2))

    def _is_unstable(self, structure: Structure, tracker: Tracker, by: By, residual: Array, jacobian: Array) -> bool:
        """Whether derivatives of a fit move the model farther than the records move, and a tracker moves it less.

        Steps that pass a sharp bend of dry friction are stable. Derivatives that take their matrices as constant are
        not, and grow there from step to step without end. So do exact ones of few steps where a stop meets oil.
        """
        columns, moves = by
        if moves is None or not columns:
            return False
        channel, number, way = self._farthest(moves, jacobian)
        if way <= 1.0:
            return False
        with contextlib.suppress(*ASTRAY):
            moved = self._moved_by(structure, tracker, columns[number], moves[number])
            return bool(np.max(np.abs(moved - residual)[:, channel]) / MOVE <= self.tracked.farthest[channel])
        return False

    def _farthest(self, moves: Array, jacobian: Array) -> tuple[int, int, float]:
        """Channel and derivative of a fit that one deviation moves farthest, and how far as a share of the records."""
        ways = np.max(np.abs(jacobian), axis=0) * moves / MOVE / self.tracked.farthest[:, None]
        channel, number = map(int, np.unravel_index(np.argmax(ways), ways.shape))
        return channel, number, float(ways[channel, number])

    def _moved_by(self, structure: Structure, tracker: Tracker, column: int, move: float) -> Array:
        """Residual (N, m) of a fit with one parameter moved.

        Raises
        ------
        VpmError
            The structure runs away from the records.
        """
        theta = structure.theta.copy()
        theta[column] += move
        return self.tracked.follow(structure.model, theta, tracker)[0]


def in_roots(errors: Array, slopes: Array, roots: Array) -> tuple[Array, Array]:
    """Errors (n,) and derivatives (n, k) of a fit, weighted by square roots."""
    return errors * roots, slopes * roots[:, None]


def counted_too_often(errors: Array, slopes: Array, channels: int, pieces: int) -> float:
    """How many times too often samples count in a fit whose errors (n,) last longer than a sample.

    - ``slopes`` (n, k): by deviations of the priors, channel by channel as the errors

    Law: how much the slope of the cost differs between pieces of the records, and how much it would if errors were
    independent (K.-Y. Liang and S. Zeger, *Biometrika* 73, 1986).
    """
    scale, count = max(float(np.mean(errors**2)), 1e-300), slopes.shape[1]
    with np.errstate(over="ignore", invalid="ignore"):  # of records that leave next to no error
        by_sample = np.sum((slopes * errors[:, None]).reshape(channels, -1, count), axis=0) / scale
        sums = np.stack([np.sum(piece, axis=0) for piece in np.array_split(by_sample, pieces)])
        information, spread = slopes.T @ slopes / scale, pieces * np.cov(sums, rowvar=False).reshape(count, count)
        sizes = 1.0 / np.sqrt(np.diag(information) + 1.0)
        even = np.outer(sizes, sizes)
        known = information * even + np.diag(sizes**2 + ROUNDED)
        expected, seen = (float(np.trace(np.linalg.solve(known, one * even))) for one in (information, spread))
        often = seen / max(expected, 1e-300)
    return often if np.isfinite(often) else 1.0


def by_secant(slopes: Array, change: Array, move: Array) -> Array:
    """Secant update of a fit's derivatives (n, k) from a move (k,) and the change of the errors (n,).

    Law: C. Broyden, *Mathematics of Computation* 19, 1965.
    """
    missed = (change - slopes @ move) / max(float(move @ move), 1e-300)
    return np.asarray(slopes + np.outer(missed, move))


def likelier(structure: Structure, move: Array) -> float:
    """By how much the priors make a structure likelier that was moved, nats.

    Where a size grows, its place goes less far than the step of a fit says, see `Structure.moved`.
    """
    before, after = structure.standard, structure.moved(move).standard
    return 0.5 * (float(before @ before) - float(after @ after))


def free_step(errors: Array, slopes: Array, standard: Array) -> Array:
    """Most probable step of a fit without bounds (k,), in deviations of the priors from their ``standard`` values.

    Nothing is known of what further columns of the ``slopes`` stand for.
    """
    return free_step_by(slopes.T @ slopes, slopes.T @ errors, standard)


def free_step_by(products: Array, pull: Array, standard: Array) -> Array:
    """Most probable step of a fit (k,) by products of its derivatives (k, k), and of these with the errors (k,)."""
    known, unknown = len(standard), len(pull) - len(standard)
    z = np.append(standard, np.zeros(unknown))
    weights = np.where(np.arange(len(z)) < known, 1.0, 1e-9 * np.diag(products) + 1e-300)
    return -np.linalg.solve(products + np.diag(weights), pull + weights * z)


def bordered(products: Array, cross: Array, further: Array) -> Array:
    """Products of derivatives in a fit (k + q, k + q), from those without the last ones (k, k) and with these."""
    return np.block([[products, cross], [cross.T, further]])


def bounded_step(
    structure: Structure, errors: Array, slopes: Array, reach: float, variance: float | None = None
) -> Array:
    """Gauss-Newton step of a fit in deviations of the priors, within bounds and what bodies can have.

    Errors have the ``variance`` that is given, or else their own. Where a moment of inertia that records show would
    leave those of its body behind, they come along: else it stops at what they allow.
    """
    scale = max(float(np.mean(errors**2)) if variance is None else variance, 1e-300)
    with np.errstate(over="ignore", invalid="ignore"):
        products, slope = slopes.T @ slopes / scale, slopes.T @ errors / scale
    return bounded_step_by(structure, products, slope, reach)


def bounded_step_by(structure: Structure, products: Array, slope: Array, reach: float) -> Array:
    """Bounded step of a fit by products of its derivatives (k, k), and of these with the errors (k,), by variance."""
    z = structure.standard
    far = np.isin(np.arange(len(z)), structure.anywhere)
    known = np.where(far, FAINT, 1.0)
    normal = products + np.diag(known)
    if not np.all(np.isfinite(normal)):  # as of a joint that stands, of which nothing is left to explain
        raise VpmError(f"{structure.model.name}: the records leave no error that a step could be measured by")
    sizes = 1.0 / np.sqrt(np.diag(normal))
    root = np.linalg.cholesky(normal * np.outer(sizes, sizes) + ROUNDED * np.eye(len(z))).T
    pull = -(slope + known * z) * sizes
    target = np.linalg.solve(root.T, pull)
    low = np.where(far, -np.inf, np.minimum(np.maximum(structure.ends[:, 0] - z, -reach), -1e-12)) / sizes
    high = np.where(far, np.inf, np.maximum(np.minimum(structure.ends[:, 1] - z, reach), 1e-12)) / sizes
    room, changes = structure.room
    rows, held = changes * sizes, np.zeros(len(room), dtype=bool)
    while True:
        heavy = FIRM * np.max(np.abs(target), initial=1.0) / np.linalg.norm(rows[held], axis=1)
        matrix = np.vstack([heavy[:, None] * rows[held], root])
        wanted = np.concatenate([heavy * (HAIR * np.linalg.norm(changes[held], axis=1) - room[held]), target])
        move = np.asarray(lsq_linear(matrix, wanted, (low, high), method="bvls").x * sizes)
        short = ~held & np.any(rows != 0.0, axis=1) & (room + changes @ move < 0.0)
        if not np.any(short):
            return move
        held |= short
