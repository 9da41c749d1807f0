"""Structure in a residual that noise does not have: a test that needs no candidate effect."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vpm.discrepancy.noise.noise_floor import white_level
from vpm.discrepancy.noise.noise_spectrum import noise_shapes
from vpm.discrepancy.settings import ABOVE_WHITE, DRIFTING, GROWING, NEW, THINNED
from vpm.identify import InverseDynamicsProblem, gaps
from vpm.model import Model
from vpm.numbers import Array


@dataclass(frozen=True)
class Structure:
    """Structure of a residual: tests against white noise, the effort and validation records."""

    above_white: float  #: Ratio of the residual to its white part, on the records where that is smaller.
    #: Rank correlation of its size with that of the effort, in standard deviations: noise of sensors and drives does
    #: not depend on the effort.
    growing: float
    new: float  #: Relative gap on validation records over that on training records.

    @property
    def present(self) -> bool:
        """Whether the residual has more structure than noise."""
        return self.growing > GROWING or self.above_white > ABOVE_WHITE or self.new > NEW


def structure(
    model: Model,
    training: InverseDynamicsProblem,
    validation: InverseDynamicsProblem,
    fitted: Array,
    residual: Array,
) -> Structure:
    """Examine the structure of residuals of a fitted model on training and validation data."""
    training_shapes, validation_shapes = noise_shapes(model, training), noise_shapes(model, validation)
    above_white = min(
        _above_white(training, fitted, training_shapes), _above_white(validation, residual, validation_shapes)
    )
    growing = min(_growing(model, training, fitted), _growing(model, validation, residual))
    known, fresh = gaps(training, fitted), gaps(validation, residual)
    new = max(fresh[c][1] / known[c][1] if known[c][1] > 0.0 else 0.0 for c in fresh)
    return Structure(above_white, growing, new)


def _above_white(problem: InverseDynamicsProblem, residual: Array, shapes: tuple[Array | None, ...]) -> float:
    """Largest ratio of any channel between its residual and the white noise in it."""
    ratios = []
    for channel in dict.fromkeys(block.channel for block in problem.blocks):
        mine = [(b, s) for b, s in zip(problem.blocks, shapes, strict=True) if b.channel == channel]
        white = sum(white_level(residual[b.samples], b.moving, s) ** 2 * float(b.moving.sum()) for b, s in mine)
        power = sum(float(residual[b.samples] @ residual[b.samples]) for b, _ in mine)
        allowed = 1.0 if channel.endswith(".effort") or mine[0][1] is not None else DRIFTING
        ratios.append(np.sqrt(power / white) / allowed if white > 0.0 else 0.0)
    return float(max(ratios))


def _growing(model: Model, problem: InverseDynamicsProblem, residual: Array) -> float:
    """Rank correlation of the residual's size with the effort, in standard deviations; the largest of all joints."""
    from scipy.stats import spearmanr

    scores = []
    for joint in range(len(problem.joints)):
        sizes, efforts = [], []
        for record in range(len(problem.motions)):
            block = problem.efforts(record)[joint]
            _, applied, _ = problem.effort(model, model.theta, record)
            counted = block.moving > 0.0
            sizes.append(np.abs(residual[block.samples][counted]))
            efforts.append(np.abs(applied[counted, joint]))
        size, effort = np.concatenate(sizes), np.concatenate(efforts)
        if size.size > 2 * THINNED and np.ptp(effort) > 0.0 and np.ptp(size) > 0.0:
            scores.append(float(spearmanr(size, effort).statistic) * np.sqrt(size.size / THINNED))
    return max(scores, default=0.0)
