"""States of machines with closed loops: from names, from measured joints, and of linear models."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vpm.errors import ModelError
from vpm.model.loop_algebra import least

if TYPE_CHECKING:
    from vpm.model.evaluation import Evaluations

Array = NDArray[np.float64]


def close(model: Evaluations, state: Array, named: Mapping[str, float]) -> None:
    """Put coordinates and rates into a state that close the loops, with those that are named as they are.

    Raises
    ------
    ModelError
        They do not close so.
    """
    n = len(model.coordinates)

    def of(kind: str) -> dict[str, float]:
        own = {name.removesuffix(kind): value for name, value in named.items() if name.endswith(kind)}
        return {name: value for name, value in own.items() if name in model.coordinates}

    state[:n] = model.loops.assembled(of(".position"))
    state[n : 2 * n] = model.loops.velocities(state[:n], of(".velocity"))


def kept(model: Evaluations, state: Array) -> None:
    """Put the nearest rates into a state that keep its loops closed, after its links were bent."""
    n = len(model.coordinates)
    jacobian = model.loops.at(state[:n]).jacobian
    state[n : 2 * n] -= least(jacobian, jacobian @ state[n : 2 * n])


def measured(model: Evaluations, position: Array, velocity: Array, seen: Sequence[str]) -> tuple[Array, Array]:
    """Coordinates and rates next to measured ones that leave the loops closed.

    Of the joints that were ``seen``, as many keep their readings as there are degrees of freedom.
    """
    names, loops = model.coordinates, model.loops
    start = {name: value for name, value in zip(names, position.tolist(), strict=True) if name in seen}
    kept = [name for name in loops.independent(loops.assembled(guess=start), seen) if name in seen]
    q = loops.assembled({name: start[name] for name in kept}, start)
    return q, loops.velocities(q, {name: float(velocity[names.index(name)]) for name in kept})


def reduced(
    model: Evaluations, state: Array, matrices: tuple[Array, Array, Array]
) -> tuple[list[int], tuple[Array, Array, Array]]:
    """A, B, C of a linear model in independent coordinates, and which of the states these are.

    ``dq = T dq_i`` with T from `Loops.transmission`, and the same of the rates at rest: motions with closed loops are
    invariant.

    Raises
    ------
    ModelError
        The state moves, or the loops are singular there.
    """
    names, n = model.coordinates, len(model.coordinates)
    if np.abs(state[n : 2 * n]).max(initial=0.0) > 0.0:
        raise ModelError(
            f"{model.name} moves there, and machines with closed loops are linearised at rest only; give no velocities"
        )
    free = model.loops.independent(state[:n])
    T = model.loops.transmission(state[:n], free)
    own = [names.index(name) for name in free]
    kept = [*own, *(n + place for place in own), *range(2 * n, state.size)]
    whole, k = np.zeros((state.size, len(kept))), len(own)
    whole[:n, :k], whole[n : 2 * n, k : 2 * k] = T, T
    whole[2 * n :, 2 * k :] = np.eye(state.size - 2 * n)
    A, B, C = matrices
    return kept, (A[kept] @ whole, B[kept], C @ whole)
