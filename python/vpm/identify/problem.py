"""What every comparison of a model with data is: a residual by channel and record, with its exact derivative.

A problem fixes the data and how they are compared; the model may change under it. That is what lets one problem judge
the nominal model, the recalibrated one and every candidate effect on the same samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from vpm.model import Model

Array = NDArray[np.float64]

#: A record with fewer samples after decimation says nothing about anything.
FEWEST_SAMPLES = 12
#: Share of a column that rounding may leave of a constant.
ROUNDING = 1e-12


@dataclass(frozen=True)
class Block:
    """One channel of one record inside the residual vector.

    Attributes
    ----------
    experiment, channel, unit : str
        Where the samples come from and their unit.
    samples : slice
        Their place in the residual vector.
    time : ndarray
        Time of each sample, s.
    scale : float
        Size of the measured signal (root mean square), in ``unit``; relative errors refer to it.
    weight : float
        What the residual was multiplied by, 1/``unit``, so that channels of different units can be added.
    moving : ndarray
        1 for samples that count, 0 for those at standstill, whose residual is zero.
    """

    experiment: str
    channel: str
    unit: str
    samples: slice
    time: Array
    scale: float
    weight: float
    moving: Array


class Problem(Protocol):
    """Residual ``(measured - predicted) * weight`` of a model on fixed data."""

    mode: str
    blocks: tuple[Block, ...]

    def evaluate(self, model: Model, theta: Array, columns: Sequence[int] = ()) -> tuple[Array, Array]:
        """Residual, shape (n,), and its derivative by the named parameters, shape (n, len(columns))."""


def segments(problem: Problem) -> list[slice]:
    """The contiguous pieces of the residual vector."""
    return [block.samples for block in problem.blocks]


def less_means(values: Array, blocks: Sequence[Block]) -> Array:
    """What constants of some blocks leave of a residual (n,) or its derivative (n, columns).

    The least squares beside constants are those of what is left (R. Frisch and F. Waugh, *Econometrica* 1, 1933;
    variable projection: G. Golub and V. Pereyra, *SIAM J. Numerical Analysis* 10, 1973). Values are zero where a
    sample does not count.
    """
    if not blocks or not np.all(np.isfinite(values)):
        return values
    left = values.copy()
    for block in blocks:
        rows, shape = values[block.samples], (-1, *[1] * (values.ndim - 1))
        counts = block.moving.reshape(shape)
        rest = (rows - rows.sum(axis=0) / counts.sum()) * counts
        # Rounding is not to look like something that the data see.
        lost = np.linalg.norm(rest, axis=0) <= ROUNDING * np.linalg.norm(rows, axis=0)
        left[block.samples] = np.where(lost, 0.0, rest)
    return left


def gaps(problem: Problem, residual: Array) -> dict[str, tuple[float, float, str]]:
    """Root mean square, its share of the measured signal, and the unit, for each channel over all records."""
    result = {}
    for channel in dict.fromkeys(block.channel for block in problem.blocks):
        mine = [block for block in problem.blocks if block.channel == channel]
        count = sum(float(block.moving.sum()) for block in mine)
        power = sum(float(np.sum(residual[b.samples] ** 2)) / b.weight**2 for b in mine)
        signal = sum(b.scale**2 * float(b.moving.sum()) for b in mine)
        rms = float(np.sqrt(power / count))
        result[channel] = (rms, float(np.sqrt(power / signal)) if signal > 0.0 else np.inf, mine[0].unit)
    return result
