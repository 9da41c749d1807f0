"""States of machines with closed loops: at rest, from names, from measured joints, and of linear models.

At rest joints and flexible links balance with the forces of the loops.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vpm.errors import ModelError
from vpm.model.loops.assembly import least
from vpm.numbers import Array, array_of

if TYPE_CHECKING:
    from vpm.model.evaluation import Evaluations
    from vpm.model.loops.closure import Loops


#: Newton steps before a rest counts as lost, and the last of them beside coordinates of one.
_STEPS, _LAST = 60, 1e-11
#: Half of a difference of coordinates (m, rad): the cube root of the rounding of numbers, about.
_SHIFT = 1e-6


def resting(model: Evaluations, position: ArrayLike) -> tuple[Array, Array]:
    """State of loops at rest with the independent joints held at ``position``, and efforts (joints,)."""
    joints = model.joints
    at = array_of(position, f"{model.name}: position", ModelError)
    if at.shape != (len(joints),):
        raise ModelError(f"position has the shape {at.shape}; give {len(joints)} numbers, one for each joint")
    guess = dict(zip(joints, at.tolist(), strict=True))
    free = model.loops.independent(model.loops.assembled(guess=guess))
    q, efforts = rest(model, {name: guess[name] for name in free if name in joints}, guess)
    return q, np.array([efforts.get(name, 0.0) for name in joints])


def rest(
    model: Evaluations, held: Mapping[str, float], guess: Mapping[str, float] | None = None
) -> tuple[Array, dict[str, float]]:
    """State of closed loops at rest under gravity, and efforts on the held joints; see `Loops.rest`.

    ``h(q) - J^T l = 0`` on all coordinates that are not held, with closed loops, by Newton's method in q and l.
    """
    loops = model.loops
    q = loops.assembled(held, guess)
    fixed = [loops.place(name) for name in held]
    free = [place for place in range(q.size) if place not in fixed]
    chosen = loops.at(q).independent
    forces = np.zeros(int(chosen.sum()))
    for _ in range(_STEPS):
        needed, slope = model.core.load_at_rest(model.theta, q)
        state = loops.at(q)
        J = state.jacobian[chosen]
        missing = np.concatenate([(needed - J.T @ forces)[free], state.gap[chosen]])
        K = (slope - _turned(loops, q, chosen, forces))[np.ix_(free, free)]
        # Stiffness and ways have units far apart; so scaled, they have entries of like size.
        scale = max(1.0, float(np.abs(K).max(initial=0.0)))
        ways = scale * J[:, free]
        matrix = np.block([[K, -ways.T], [ways, np.zeros((len(forces), len(forces)))]])
        missing[len(free) :] *= scale
        step = np.linalg.lstsq(matrix, -missing, rcond=None)[0]
        q[free] += step[: len(free)]
        forces += scale * step[len(free) :]
        if np.abs(step[: len(free)]).max(initial=0.0) < _LAST * max(1.0, float(np.abs(q).max())):
            needed, _ = model.core.load_at_rest(model.theta, q)
            left = needed - loops.at(q).jacobian[chosen].T @ forces
            if np.abs(left[free]).max(initial=0.0) > 1e-6 * (1.0 + float(np.abs(needed).max())):
                break  # no step leads nearer, and yet the loads do not vanish
            return q, dict(zip(held, left[fixed].tolist(), strict=True))
    raise ModelError(
        f"{model.name} finds no rest with {', '.join(held) or 'nothing'} held; hold as many joints as there are "
        "degrees of freedom, or give springs to the others"
    )


def _turned(loops: Loops, q: Array, chosen: NDArray[np.bool_], forces: Array) -> Array:
    """Derivative of ``J^T l`` for the state of loops at rest, by central differences."""
    columns = np.zeros((q.size, q.size))
    for place in range(q.size if forces.any() else 0):
        shift = np.zeros_like(q)
        shift[place] = _SHIFT
        ends = [loops.at(q + sign * shift).jacobian[chosen].T @ forces for sign in (1.0, -1.0)]
        columns[:, place] = (ends[0] - ends[1]) / (2.0 * _SHIFT)
    return columns


def close(model: Evaluations, state: Array, named: Mapping[str, float]) -> None:
    """Put coordinates and rates into a state that close the loops, with those that are named as they are.

    Raises `ModelError`: they do not close so.
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


def measured(
    model: Evaluations, position: Array, velocity: Array, seen: Sequence[str], before: Array | None = None
) -> tuple[Array, Array]:
    """State next to a measured one that leaves the loops closed: coordinates and rates.

    Of the joints that were ``seen``, as many keep their readings as there are degrees of freedom. The others are where
    a motion from the assembly ``before`` takes them, by default from that of the model file.
    """
    names, loops = model.coordinates, model.loops
    readings = {name: value for name, value in zip(names, position.tolist(), strict=True) if name in seen}
    near = loops.near(readings, before)
    kept = [name for name in loops.independent(near, seen) if name in seen]
    q = loops.assembled({name: readings[name] for name in kept}, dict(zip(names, near.tolist(), strict=True)))
    return q, loops.velocities(q, {name: float(velocity[names.index(name)]) for name in kept})


def reduced(
    model: Evaluations, state: Array, matrices: tuple[Array, Array, Array]
) -> tuple[list[int], tuple[Array, Array, Array]]:
    """A, B, C of a linear model in independent coordinates, and which of the states these are.

    ``dq = T dq_i`` with T from `Loops.transmission`, and the same of the rates at rest: motions with closed loops are
    invariant.

    Raises `ModelError`: the state moves, or the loops are singular there.
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
