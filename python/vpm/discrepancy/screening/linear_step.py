"""Linear step of least squares, by which a candidate is judged before it is refitted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vpm.identify import InverseDynamicsProblem, robust_covariance, segments
from vpm.identify.identifiability import column_lengths
from vpm.model import Parameter
from vpm.numbers import Array

#: Bounds of a place that may lie anywhere.
ANYWHERE = (-np.inf, np.inf)


def linear_step(data: InverseDynamicsProblem, jacobian: Array, residual: Array) -> tuple[Array, Array, Array]:
    """Linear least-squares step, its standard deviations and the remaining residual (n,)."""
    if jacobian.shape[1] == 0:
        return np.zeros(0), np.zeros(0), residual
    lengths = column_lengths(jacobian)
    scaled = jacobian / lengths
    step = np.linalg.lstsq(scaled, -residual, rcond=1e-10)[0]
    left = residual + scaled @ step
    std = np.sqrt(np.diag(robust_covariance(scaled, left, segments(data)))) / lengths
    return step / lengths, std, left


def step_without(
    data: InverseDynamicsProblem, jacobian: Array, residual: Array, staying: Sequence[int]
) -> tuple[Array, Array, Array]:
    """Linear step in which some parameters stay where they are, without deviation."""
    moves = [i for i in range(jacobian.shape[1]) if i not in staying]
    values, std = np.zeros(jacobian.shape[1]), np.zeros(jacobian.shape[1])
    values[moves], std[moves], left = linear_step(data, jacobian[:, moves], residual)
    return values, std, left


def is_outside(parameter: Parameter, value: float, std: float) -> bool:
    """Whether an estimate of a linear step lies outside the physical range by more than one standard deviation."""
    return value + std < parameter.minimum or value - std > parameter.maximum


def softened(start: float, estimate: float, std: float) -> tuple[float, float]:
    """Stiffness after a linear step in the compliance of a series spring, with its standard deviation.

    Under an effort F it gives way by F/k, which is linear in 1/k. From a start k0, a step dk is one of -dk/k0^2 in the
    compliance. Taken in k, a spring half as stiff as its start, or less, would come out below zero. What comes out
    stiffer than rigid stays as it is.
    """
    ratio = 2.0 - estimate / start if start > 0.0 else 0.0
    if ratio <= 0.0:
        return estimate, std
    return start / ratio, std / ratio**2
