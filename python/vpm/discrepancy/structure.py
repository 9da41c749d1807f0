"""Does the residual still follow something? A test that does not need to know what."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vpm.identify import InverseDynamicsProblem

Array = NDArray[np.float64]

#: Bins of position and of velocity in the state map.
BINS = 8
#: Share of the unseen residual that a state map must predict, and share of its power in the lowest tenth of the
#: band (a tenth for white noise), before it counts as structured.
PREDICTED_SHARE = 0.15
SLOW_SHARE = 0.5


@dataclass(frozen=True)
class Structure:
    """What is left to explain.

    Attributes
    ----------
    predicted : float
        Share of the unseen residual's mean square that a map of position, velocity and acceleration, drawn from the
        training residual, predicts.
    slow : float
        Share of its power in the lowest tenth of the retained band.
    """

    predicted: float
    slow: float

    @property
    def present(self) -> bool:
        """Whether the residual is more than noise."""
        return self.predicted > PREDICTED_SHARE or self.slow > SLOW_SHARE


def structure(
    training: InverseDynamicsProblem, unseen: InverseDynamicsProblem, fitted: Array, residual: Array
) -> Structure:
    """Examine the residuals of a fitted model on training and unseen data."""
    joints = range(len(training.joints))
    predicted = max(_predicted(training, unseen, fitted, residual, joint) for joint in joints)
    slow = float(np.mean([_slow_share(residual[block.samples]) for block in unseen.blocks]))
    return Structure(predicted, slow)


def _predicted(
    training: InverseDynamicsProblem,
    unseen: InverseDynamicsProblem,
    fitted: Array,
    residual: Array,
    j: int,
) -> float:
    """Cross-validated share of one joint's residual that bins of its state explain."""
    states = [np.vstack([_state(problem, r, j) for r in range(len(problem.motions))]) for problem in (training, unseen)]
    targets = [
        np.concatenate([values[problem.efforts(r)[j].samples] for r in range(len(problem.motions))])
        for problem, values in ((training, fitted), (unseen, residual))
    ]
    edges = [np.quantile(column, np.linspace(0, 1, BINS + 1)[1:-1]) for column in states[0].T]
    features = [_features(state, edges, states[0]) for state in states]
    ridge = 1e-3 * len(targets[0]) * np.eye(features[0].shape[1]) / BINS
    weights = np.linalg.solve(features[0].T @ features[0] + ridge, features[0].T @ targets[0])
    power = float(targets[1] @ targets[1])
    left = targets[1] - features[1] @ weights
    return max(0.0, 1.0 - float(left @ left) / power) if power > 0.0 else 0.0


def _state(problem: InverseDynamicsProblem, record: int, joint: int) -> Array:
    position, velocity, acceleration = problem.state(record)
    return np.column_stack([position[:, joint], velocity[:, joint], acceleration[:, joint]])


def _features(state: Array, edges: list[Array], reference: Array) -> Array:
    """Membership in bins of position and of velocity, and the acceleration."""
    columns = []
    for quantity in range(2):
        place = np.digitize(state[:, quantity], edges[quantity])
        columns.append(place[:, None] == np.arange(BINS)[None, :])
    scale = float(np.std(reference[:, 2])) or 1.0
    return np.column_stack([*columns, state[:, 2:] / scale]).astype(np.float64)


def _slow_share(residual: Array) -> float:
    power = np.abs(np.fft.rfft(residual)) ** 2
    total = float(power.sum())
    return float(power[: max(1, len(power) // 10)].sum()) / total if total > 0.0 else 0.0
