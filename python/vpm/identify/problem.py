"""Comparisons of a model with data: a residual by channel and record, with its exact derivative.

A problem fixes the data and how they are compared; the model may change under it. That is what lets one problem judge
the nominal model, the recalibrated one and every candidate effect on the same samples.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from vpm.errors import IdentificationError, check_known
from vpm.model import Model
from vpm.numbers import Array
from vpm.units import parse_unit

#: By channel: root mean square, its share of the measured signal, unit.
Gaps = dict[str, tuple[float, float, str]]

#: A record with fewer samples after decimation says nothing about anything.
FEWEST_SAMPLES = 12
#: Share of a column that rounding may leave of a constant.
ROUNDING = 1e-12


@dataclass(frozen=True)
class Block:
    """One channel of one record inside the residual vector."""

    #: Where the samples come from and their unit.
    experiment: str
    channel: str
    unit: str
    samples: slice  #: Their place in the residual vector.
    time: Array  #: Time of each sample, s.
    scale: float  #: Size of the measured signal (root mean square), in ``unit``; relative errors refer to it.
    weight: float  #: What the residual was multiplied by, 1/``unit``, so that channels of different units can be added.
    moving: Array  #: 1 for samples that count, 0 for those at standstill, whose residual is zero.


class Problem(Protocol):
    """Residual ``(measured - predicted) * weight`` of a model on fixed data."""

    mode: str
    blocks: tuple[Block, ...]

    def evaluate(self, model: Model, theta: Array, columns: Sequence[int] = ()) -> tuple[Array, Array]:
        """Residual of the problem, shape (n,), and its derivative by the named parameters, shape (n, len(columns))."""


def segments(problem: Problem) -> list[slice]:
    """Contiguous pieces of a problem's residual vector."""
    return [block.samples for block in problem.blocks]


def less_means(values: Array, blocks: Sequence[Block]) -> Array:
    """Residual (n,) or derivative (n, columns) of a problem less the mean of each of some blocks.

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


def gaps(problem: Problem, residual: Array) -> Gaps:
    """Root mean square residual of a problem by channel, its share of the measured signal, and unit."""
    result = {}
    for channel in dict.fromkeys(block.channel for block in problem.blocks):
        mine = [block for block in problem.blocks if block.channel == channel]
        count = sum(float(block.moving.sum()) for block in mine)
        power = sum(float(np.sum(residual[b.samples] ** 2)) / b.weight**2 for b in mine)
        signal = sum(b.scale**2 * float(b.moving.sum()) for b in mine)
        rms = float(np.sqrt(power / count))
        result[channel] = (rms, float(np.sqrt(power / signal)) if signal > 0.0 else np.inf, mine[0].unit)
    return result


class TiedProblem:
    """A problem in which parameters follow others.

    ``ties``: following parameter to the one whose value it takes; see `check_ties`.
    """

    def __init__(self, data: Problem, ties: Mapping[str, str]) -> None:
        self.mode: str = data.mode
        self.blocks: tuple[Block, ...] = data.blocks
        self.untied, self._ties = data, dict(ties)

    def evaluate(
        self, model: Model, theta: Array, columns: Sequence[int] = (), unknown: Array | None = None
    ) -> tuple[Array, Array]:
        """Residual of a tied problem and its derivative; followers count with what they follow.

        ``unknown`` are first states, for a `ShootingProblem`; derivatives by them come last.
        """
        follows = {model.index(follower): model.index(leader) for follower, leader in self._ties.items()}
        theta = theta.copy()
        for follower, leader in follows.items():
            theta[follower] = theta[leader]
        wanted = [*columns, *(follower for follower, leader in follows.items() if leader in columns)]
        given = {} if unknown is None else {"unknown": unknown}
        residual, jacobian = self.untied.evaluate(model, theta, wanted, **given)
        whole = np.delete(jacobian, range(len(columns), len(wanted)), axis=1)
        for place, follower in enumerate(wanted[len(columns) :], start=len(columns)):
            whole[:, list(columns).index(follows[follower])] += jacobian[:, place]
        return residual, whole


def untied(data: Problem) -> Problem:
    """The problem behind ties, if there are any."""
    return data.untied if isinstance(data, TiedProblem) else data


def tied(data: Problem, ties: Mapping[str, str]) -> Problem:
    """The problem with ties, if there are any."""
    return TiedProblem(data, ties) if ties else data


def check_ties(model: Model, ties: Mapping[str, str], free: Sequence[str]) -> None:
    """Refuse ties of a problem that have no single meaning.

    ``ties``: following parameter to the one whose value it takes.
    """
    for follower, leader in ties.items():
        check_known((follower, leader), model.parameters, IdentificationError, f"ties: {model.name} has no parameter")
        if follower in free or leader in ties:
            reason = f'"{follower}" is free' if follower in free else f'"{leader}" follows "{ties[leader]}" itself'
            repair = "take it out of free=" if follower in free else f'tie "{follower}" to "{ties[leader]}"'
            raise IdentificationError(f'ties: "{follower}" cannot follow "{leader}", because {reason}; {repair}')
        units = [model.parameters[name].unit for name in (follower, leader)]
        if parse_unit(units[0]).dimension != parse_unit(units[1]).dimension:
            raise IdentificationError(
                f'ties: "{follower}" [{units[0]}] cannot take the value of "{leader}" [{units[1]}]; tie equal units'
            )
