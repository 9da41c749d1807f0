"""Linear step of least squares, by which a candidate is judged before it is refitted.

A place, such as where a spring rests, is estimated together with the size. At size zero the location has no influence.
A spring that is assumed to rest in the middle of the motion then comes out wrong where most of its effort is constant.
An effort ``size (c + location d)`` is linear in ``size`` and in ``size location``, so both follow from one linear step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vpm.discrepancy.screening.candidates import Candidate
from vpm.identify import InverseDynamicsProblem, robust_covariance, segments
from vpm.identify.identifiability import column_lengths
from vpm.model import Model, Parameter
from vpm.numbers import Array

#: Numbers of an effect that has a size and a place, and bounds of a place that may lie anywhere.
PLACED, ANYWHERE = 2, (-np.inf, np.inf)
#: Two equal steps of a place change the column of the size alike, to rounding.
EVEN = 1e-6


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


@dataclass(frozen=True)
class Place:
    """Indices of size and location parameter of an effect, and the column of their product."""

    size: int
    where: int
    column: Array


def free_location(
    data: InverseDynamicsProblem, model: Model, candidate: Candidate, added: Sequence[str], fresh: Array
) -> Place | None:
    """Location parameter of a candidate that has a size and a location, or None.

    - ``model``: with the candidate at its start, which has no size
    - ``added``: its parameters, by dotted name
    - ``fresh`` (n, len(added)): their columns there

    None too where the column of the size does not change by equal steps with the place.
    """
    if not candidate.neutral or len(candidate.starts) > 1 or len(added) != PLACED:
        return None
    effect = model.effect(*candidate.key)
    short = {dotted: name for name, dotted in effect.parameter_names.items()}
    own = [candidate.effect.parameter(short[name]) for name in added]
    anywhere = [i for i, p in enumerate(own) if p.shape and tuple(p.physical) == ANYWHERE]
    if len(anywhere) != 1 or own[1 - anywhere[0]].shape:
        return None
    where, size = anywhere[0], 1 - anywhere[0]
    start, step = model.parameters[added[where]].value, own[where].typical
    columns = [fresh[:, size]]
    for steps in (1.0, 2.0):
        moved = model.with_parameters({added[where]: start + steps * step})
        columns.append(data.evaluate(moved, moved.theta, [moved.index(added[size])])[1][:, 0])
    first, second = columns[1] - columns[0], columns[2] - columns[1]
    if not np.any(first) or np.linalg.norm(second - first) > EVEN * np.linalg.norm(first):
        return None
    return Place(size, where, first / step)
