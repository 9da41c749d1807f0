"""What a fit makes small: residuals in units of their noise, through a loss, with what is known of the parameters."""

from collections.abc import Callable, Mapping, Sequence
from threading import Lock

import numpy as np

from vpm.identify.problem import Block, Problem, untied
from vpm.identify.settings import Fitting
from vpm.identify.shooting import ShootingProblem
from vpm.identify.solver import Point
from vpm.model import Model
from vpm.numbers import Array

#: Median of absolute values of a normal variable, in standard deviations.
NORMAL_MEDIAN = 0.6744897501960817
#: Least noise of a channel, as a share of its spread: what noise-free data are taken to have.
LEAST_NOISE = 1e-9
#: Residuals beyond this come from a simulation that left its machine.
HUGE = 1e100


class Objective:
    """Residuals of a problem at coordinates: parameters or their logarithms, then first states in units of their size.

    - ``model``: values at which parameters that are not free stay, and what is known of the others
    - ``bounds``: least and largest parameters
    - ``progress``: told the number of evaluations and the root mean square of the weighted residual; from any thread
    """

    def __init__(
        self,
        model: Model,
        data: Problem,
        free: Sequence[str],
        bounds: tuple[Array, Array],
        fitting: Fitting,
        progress: Callable[[int, float], None] | None = None,
    ) -> None:
        self.model, self.data, self.fitting = model, data, fitting
        self.columns = [model.index(name) for name in free]
        self._progress, self._lock = progress, Lock()
        self.count = 0
        self.box = low, high = bounds
        values = model.theta[self.columns]
        self.log = (values > 0.0) & (low >= 0.0) & fitting.log
        shooting = untied(data)
        self.shooting = shooting if isinstance(shooting, ShootingProblem) else None
        first = self.shooting.first_states if self.shooting else np.zeros(0)
        self.sizes = self.shooting.state_sizes if self.shooting else np.zeros(0)
        self.first = first / self.sizes if first.size else first
        endless = np.full(first.size, np.inf)
        with np.errstate(divide="ignore"):
            self.low = np.concatenate([np.where(self.log, np.log(np.maximum(low, 0.0)), low), -endless])
            self.high = np.concatenate([np.where(self.log, np.log(np.maximum(high, 0.0)), high), endless])
        known = [model.parameters[name].uncertainty or np.inf for name in free]
        prior = np.array(known) if fitting.priors else np.full(len(free), np.inf)
        self._prior = np.flatnonzero(np.isfinite(prior))
        self._prior_mean, self._prior_std = values[self._prior], prior[self._prior]
        self.noise: dict[str, float] = dict(fitting.noise_levels)

    def __getstate__(self) -> dict[str, object]:
        """State of an objective for other processes, without the function that is told of progress."""
        return {**vars(self), "_progress": None}

    @property
    def priors(self) -> int:
        """Number of prior rows at the end of an objective's weighted residual."""
        return len(self._prior)

    def coordinates(self, theta: Array, states: Array | None = None) -> Array:
        """Coordinates of an objective: free parameters (p,) and first states in units of their size."""
        safe = np.where(self.log, theta, 1.0)
        return np.concatenate([np.where(self.log, np.log(safe), theta), self.first if states is None else states])

    def parameters(self, x: Array) -> Array:
        """Free parameters at an objective's coordinates."""
        mine = x[: len(self.columns)]
        return np.where(self.log, np.exp(np.where(self.log, mine, 0.0)), mine)

    def slopes(self, x: Array) -> Array:
        """Derivative of each parameter and first state by its coordinate in the objective."""
        return np.concatenate([np.where(self.log, self.parameters(x), 1.0), self.sizes])

    def __call__(self, x: Array) -> Point:
        """Evaluate the objective: simulate and weigh; infinite where no machine exists or it diverges."""
        theta = self.model.theta.copy()
        theta[self.columns] = self.parameters(x)
        given = {"unknown": x[len(self.columns) :] * self.sizes} if self.shooting else {}
        try:
            residual, jacobian = self.data.evaluate(self.model, theta, self.columns, **given)
        except ValueError:  # of the core: values that make no machine; the model's own were simulated before
            return Point(x, np.inf, np.zeros(0), np.zeros((0, x.size)), (np.zeros(0), np.zeros((0, x.size))))
        if not max(np.max(np.abs(residual)), np.max(np.abs(jacobian), initial=0.0)) < HUGE:  # nor NaN
            return Point(x, np.inf, np.zeros(0), np.zeros((0, x.size)), (np.zeros(0), np.zeros((0, x.size))))
        point = self.weigh(x, residual, jacobian * self.slopes(x))
        with self._lock:
            self.count += 1
            if self._progress is not None:
                self._progress(self.count, float(np.sqrt(point.cost / max(1, residual.size))))
        return point

    def weigh(self, x: Array, residual: Array, jacobian: Array) -> Point:
        """Point of the objective from a residual and its derivative, with the present weights."""
        factors = self._factors(residual.size)
        r, slopes = residual * factors, jacobian * factors[:, None]
        compared = self.data.blocks[-1].samples.stop
        cost = float(r[compared:] @ r[compared:])
        losses, weights = losses_and_weights(r[:compared], self.fitting.loss, self.fitting.loss_scale)
        cost += float(losses.sum())
        if self.fitting.loss != "squares":
            root = np.sqrt(weights)
            r[:compared] *= root
            slopes[:compared] *= root[:, None]
        if self.priors:
            off = (self.parameters(x)[self._prior] - self._prior_mean) / self._prior_std
            rows = np.zeros((self.priors, x.size))
            rows[np.arange(self.priors), self._prior] = self.slopes(x)[self._prior] / self._prior_std
            r, slopes, cost = np.concatenate([r, off]), np.concatenate([slopes, rows]), cost + float(off @ off)
        return Point(x, cost, r, slopes, (residual, jacobian))

    def _factors(self, rows: int) -> Array:
        factors = np.ones(rows)
        if not self.noise:
            return factors
        by_channel = {b.channel: 1.0 / (self.noise[b.channel] * b.weight) for b in self.data.blocks}
        for block in self.data.blocks:
            factors[block.samples] = by_channel[block.channel]
        if self.shooting is not None and self.shooting.gap_rows:
            typical = float(np.exp(np.mean(np.log(list(by_channel.values())))))
            mine = [by_channel.get(channel, typical) for channel in self.shooting.gap_channels]
            factors[rows - self.shooting.gap_rows :] = np.tile(mine, self.shooting.gap_rows // len(mine))
        return factors


def losses_and_weights(residual: Array, loss: str, scale: float) -> tuple[Array, Array]:
    """Loss of each residual in the objective, in units of noise, and its weight.

    - ``residual``: shape (n,)
    - ``loss``: one of "squares", "huber", "soft_l1"
    - ``scale``: residual beyond which the loss grows more slowly than the square
    """
    if loss == "squares":
        return residual**2, np.ones_like(residual)
    if loss == "huber":
        size = np.abs(residual)
        outer = size > scale
        weights = np.where(outer, scale / np.maximum(size, scale), 1.0)
        return np.where(outer, 2.0 * scale * size - scale**2, residual**2), weights
    root = np.sqrt(1.0 + (residual / scale) ** 2)
    return 2.0 * scale**2 * (root - 1.0), 1.0 / root


def noise_levels(blocks: Sequence[Block], residual: Array, *, robust: bool) -> Mapping[str, float]:
    """Noise deviation of each channel in the objective, in its unit; ``robust`` by the median.

    ``residual``: weighted as the blocks say.
    """
    levels = {}
    for channel in dict.fromkeys(block.channel for block in blocks):
        mine = [block for block in blocks if block.channel == channel]
        values = np.concatenate([residual[b.samples][b.moving > 0.0] / b.weight for b in mine])
        size = float(np.median(np.abs(values))) / NORMAL_MEDIAN if robust else float(np.sqrt(np.mean(values**2)))
        levels[channel] = max(size, LEAST_NOISE / min(b.weight for b in mine))
    return levels
