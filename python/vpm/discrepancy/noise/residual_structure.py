"""Structure in a residual that noise does not have: a test that needs no candidate effect."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vpm.discrepancy.noise.noise_floor import QUIET_SHARE, white_level
from vpm.discrepancy.noise.noise_spectrum import noise_shapes, noise_spectrum
from vpm.identify import InverseDynamicsProblem, gaps
from vpm.model import Model
from vpm.numbers import Array

#: Bins of position and of velocity in the state map.
BINS = 8
#: One sample in so many is taken for independent of the others.
THINNED = 2
#: A residual is structured above this share that a state map predicts, or this share of its power in the lowest tenth
#: of the band (a tenth for white noise).
PREDICTED_SHARE = 0.1
LOW_FREQUENCY_SHARE = 0.5
#: A residual of so many times its white part is not white.
ABOVE_WHITE = 1.6
#: Strains and other signs of hidden motion integrate noise, which raises them above their white part about so much.
DRIFTING = 1.5
#: Validation records with so many times the relative error of the training records hold something new.
NEW = 4.0
#: From so many standard deviations of the rank correlation between the two on, its size grows with that of the effort.
GROWING = 4.0


@dataclass(frozen=True)
class Structure:
    """Structure of a residual: tests on states, frequency, white noise, effort and validation records."""

    #: Share of the validation residual's mean square that a map of position, velocity, acceleration and effort, drawn
    #: from the training residual, predicts.
    predicted: float
    low_frequency: float  #: Share of its power in the lowest tenth of the retained band.
    above_white: float  #: Ratio of the residual to its white part, on the records where that is smaller.
    #: Rank correlation of its size with that of the effort, in standard deviations: noise of sensors and drives does
    #: not depend on the effort.
    growing: float
    new: float  #: Relative gap on validation records over that on training records.

    @property
    def present(self) -> bool:
        """Whether the residual has more structure than noise."""
        follows = self.predicted > PREDICTED_SHARE or self.growing > GROWING
        return follows or self.low_frequency > LOW_FREQUENCY_SHARE or self.above_white > ABOVE_WHITE or self.new > NEW


def structure(
    model: Model,
    training: InverseDynamicsProblem,
    validation: InverseDynamicsProblem,
    fitted: Array,
    residual: Array,
) -> Structure:
    """Examine the structure of residuals of a fitted model on training and validation data."""
    training_shapes, validation_shapes = noise_shapes(model, training), noise_shapes(model, validation)
    joints = range(len(training.joints))
    predicted = max(_predicted(model, training, validation, fitted, residual, joint) for joint in joints)
    blocks = zip(validation.blocks, validation_shapes, strict=True)
    low_frequency = float(np.mean([_low_frequency_share(residual[block.samples], shape) for block, shape in blocks]))
    above_white = min(
        _above_white(training, fitted, training_shapes), _above_white(validation, residual, validation_shapes)
    )
    growing = min(_growing(model, training, fitted), _growing(model, validation, residual))
    known, fresh = gaps(training, fitted), gaps(validation, residual)
    new = max(fresh[c][1] / known[c][1] if known[c][1] > 0.0 else 0.0 for c in fresh)
    return Structure(predicted, low_frequency, above_white, growing, new)


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


def _predicted(
    model: Model,
    training: InverseDynamicsProblem,
    validation: InverseDynamicsProblem,
    fitted: Array,
    residual: Array,
    j: int,
) -> float:
    """Cross-validated share of one joint's residual that bins of its state explain."""
    states = [
        np.vstack([_state(model, problem, r, j) for r in range(len(problem.motions))])
        for problem in (training, validation)
    ]
    targets = [
        np.concatenate([values[problem.efforts(r)[j].samples] for r in range(len(problem.motions))])
        for problem, values in ((training, fitted), (validation, residual))
    ]
    edges = [np.quantile(column, np.linspace(0, 1, BINS + 1)[1:-1]) for column in states[0].T]
    features = [_features(state, edges, states[0]) for state in states]
    ridge = 1e-3 * len(targets[0]) * np.eye(features[0].shape[1]) / BINS
    weights = np.linalg.solve(features[0].T @ features[0] + ridge, features[0].T @ targets[0])
    power = float(targets[1] @ targets[1])
    left = targets[1] - features[1] @ weights
    return max(0.0, 1.0 - float(left @ left) / power) if power > 0.0 else 0.0


def _state(model: Model, problem: InverseDynamicsProblem, record: int, joint: int) -> Array:
    position, velocity, acceleration = problem.state(record)
    _, applied, _ = problem.effort(model, model.theta, record)
    return np.column_stack([position[:, joint], velocity[:, joint], acceleration[:, joint], applied[:, joint]])


def _features(state: Array, edges: list[Array], reference: Array) -> Array:
    """Features for the structure of a residual: bins of position, velocity, acceleration and effort."""
    columns = []
    for quantity in range(2):
        place = np.digitize(state[:, quantity], edges[quantity])
        columns.append(place[:, None] == np.arange(BINS)[None, :])
    scale = np.std(reference[:, 2:], axis=0)
    further = state[:, 2:] / np.where(scale > 0.0, scale, 1.0)
    against = np.abs(further[:, 1]) * np.sign(state[:, 1])
    return np.column_stack([*columns, further, against]).astype(np.float64)


def _low_frequency_share(residual: Array, shape: Array | None) -> float:
    power = np.abs(np.fft.rfft(residual)) ** 2
    if shape is not None:
        power = power / noise_spectrum(residual, shape, QUIET_SHARE)
    total = float(power.sum())
    return float(power[: max(1, len(power) // 10)].sum()) / total if total > 0.0 else 0.0
