"""Parameters that share one value, such as the gain of several gauges on one amplifier."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from vpm.errors import IdentificationError, near_match
from vpm.identify.balance import InverseDynamicsProblem
from vpm.identify.input_error import InputErrorProblem
from vpm.identify.output_error import OutputErrorProblem
from vpm.identify.prediction_error import PredictionErrorProblem
from vpm.identify.problem import Block
from vpm.model import Model
from vpm.units import parse_unit

Array = NDArray[np.float64]


Untied = InverseDynamicsProblem | OutputErrorProblem | InputErrorProblem | PredictionErrorProblem


class TiedProblem:
    """A problem in which parameters follow others.

    Parameters
    ----------
    data : problem
        The problem behind it.
    ties : mapping of str to str
        Following parameter to the one whose value it takes; see `check_ties`.
    """

    def __init__(self, data: Untied, ties: Mapping[str, str]) -> None:
        self.mode: str = data.mode
        self.blocks: tuple[Block, ...] = data.blocks
        self.untied, self._ties = data, dict(ties)

    def evaluate(
        self, model: Model, theta: Array, columns: Sequence[int] = (), unknown: Array | None = None
    ) -> tuple[Array, Array]:
        """Residual and its derivative, those by the followers added to those by what they follow.

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


def untied(data: Untied | TiedProblem) -> Untied:
    """The problem behind ties, if there are any."""
    return data.untied if isinstance(data, TiedProblem) else data


def tied(data: Untied, ties: Mapping[str, str]) -> Untied | TiedProblem:
    """The problem with ties, if there are any."""
    return TiedProblem(data, ties) if ties else data


def check_ties(model: Model, ties: Mapping[str, str], free: Sequence[str]) -> None:
    """Complain about ties that have no single meaning.

    Parameters
    ----------
    model : Model
    ties : mapping of str to str
        Following parameter to the one whose value it takes.
    free : sequence of str
        Parameters to be fitted.

    Raises
    ------
    IdentificationError
        A name is unknown, a follower is free or followed itself, or the units of a pair differ.
    """
    for follower, leader in ties.items():
        for name in (follower, leader):
            if name not in model.parameters:
                repair = near_match(name, model.parameters)
                raise IdentificationError(f'ties: {model.name} has no parameter "{name}"; {repair}')
        if follower in free or leader in ties:
            reason = f'"{follower}" is free' if follower in free else f'"{leader}" follows "{ties[leader]}" itself'
            repair = "take it out of free=" if follower in free else f'tie "{follower}" to "{ties[leader]}"'
            raise IdentificationError(f'ties: "{follower}" cannot follow "{leader}", because {reason}; {repair}')
        units = [model.parameters[name].unit for name in (follower, leader)]
        if parse_unit(units[0]).dimension != parse_unit(units[1]).dimension:
            raise IdentificationError(
                f'ties: "{follower}" [{units[0]}] cannot take the value of "{leader}" [{units[1]}]; tie equal units'
            )
