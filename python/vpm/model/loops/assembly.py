"""Assembly of machines with closed loops: coordinates at which the loops close, with some of them held.

The equations of loops may be redundant, and the linear algebra of them stands here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from vpm.numbers import Array

if TYPE_CHECKING:
    from vpm.model.loops.closure import Loops


#: A closed loop has no larger gap (m, or the cosine of an angle that has to be a right one).
CLOSED = 1e-12
#: What is below this share is rounding: the square root of that of numbers.
NOTHING = 1e-8
#: Newton steps, and halvings of a step that does not bring the ends together.
_STEPS, _HALVINGS = 200, 12
#: Farthest turn of a joint in a step, rad: near a stretched pose steps would leap over whole turns.
_TURN = 0.3
#: Share by which an assembly may be farther from a start than another one and count as near.
_AS_NEAR = 0.05
#: Fewest pieces of the way of an assembly from its start; no angle turns farther than `_TURN` in one of them.
_PIECES = 20


def assembled(loops: Loops, start: Array, fixed: Mapping[int, float], joints: int) -> Array:
    """The assembly next to a start, or what comes nearest to one.

    - ``start``: shape (n,)
    - ``fixed``: places of coordinates that are held, and where
    - ``joints``: number of joints, which come first. Flexible links bend only where joints cannot close the loops.
    """
    free = [place for place in range(joints) if place not in fixed]
    everything = [place for place in range(start.size) if place not in fixed]
    closed = _moved(loops, _closed(loops, start, range(joints)), fixed, (free, everything))
    if _open(loops, closed) > CLOSED:
        closed = min(closed, _put(loops, start, fixed, (free, everything)), key=lambda q: _open(loops, q))
    return closed


def mirrored(loops: Loops, start: Array, fixed: Mapping[int, float], joints: int) -> Array | None:
    """Another assembly that is as near to a start as the one that is found from there, or nearer; or None.

    It is sought opposite to the start, in all joints and in each of them: a linkage has its mirror image there.
    """
    first = _closed(loops, start, range(joints))
    away = float(np.linalg.norm(first - start))
    if away <= CLOSED:
        return None
    one = assembled(loops, start, fixed, joints)
    for turned in (np.arange(start.size), *range(joints)):
        second = first.copy()
        second[turned] = 2.0 * start[turned] - first[turned]
        second = _closed(loops, second, range(joints))
        if _open(loops, second) > CLOSED or np.linalg.norm(second - start) > (1.0 + _AS_NEAR) * away:
            continue
        other = assembled(loops, second, fixed, joints)
        between = other - one
        between[loops.angles] = np.remainder(between[loops.angles] + np.pi, 2.0 * np.pi) - np.pi
        if _open(loops, other) <= CLOSED and np.linalg.norm(between) > 0.5 * away:
            return other
    return None


def _moved(loops: Loops, q: Array, fixed: Mapping[int, float], ways: Sequence[Sequence[int]]) -> Array:
    """Closed on the whole way to where some have to be: the assembly stays the same.

    Where the way ends before, what is held is put there all the same, and the loops are left as little open as can be.
    """
    way, turns = _way(loops, q, fixed)
    for piece in way:
        q = _put(loops, q, piece, ways)
        if _open(loops, q) > CLOSED:
            return _put(loops, q, fixed, ways)
    return q + turns


def followed(loops: Loops, q: Array, readings: Mapping[int, float], joints: int) -> Array:
    """The assembly next to readings of some joints, on the way there from the assembly ``q``.

    Readings may be more than the degrees of freedom and disagree a little: all joints close the loops.
    """
    way, turns = _way(loops, q, readings)
    for piece in way:
        others = [place for place in range(joints) if place not in piece]
        q = _put(loops, _put(loops, q, piece, [others]), {}, [range(joints)])
    return q + turns


def _way(loops: Loops, q: Array, ends: Mapping[int, float]) -> tuple[list[dict[int, float]], Array]:
    """Pieces of the way from an assembly to the ends of some coordinates, and the whole turns that it leaves out.

    A whole turn of an angle changes no assembly.
    """
    turns, ways = np.zeros_like(q), {}
    for place, end in ends.items():
        ways[place] = end - float(q[place])
        if place in loops.angles:
            turns[place] = 2.0 * np.pi * np.trunc(ways[place] / (2.0 * np.pi))
            ways[place] -= float(turns[place])
    farthest = max((abs(way) for place, way in ways.items() if place in loops.angles), default=0.0)
    shares = np.linspace(0.0, 1.0, max(_PIECES, int(np.ceil(farthest / _TURN)) + 1))[1:].tolist()
    start = q.copy()
    return [{place: float(start[place]) + share * way for place, way in ways.items()} for share in shares], turns


def _put(loops: Loops, q: Array, fixed: Mapping[int, float], ways: Sequence[Sequence[int]]) -> Array:
    """Assembly start: some coordinates put where they have to be, the loops closed by the first others that can."""
    q = q.copy()
    for place, value in fixed.items():
        q[place] = value
    for free in ways:
        q = _closed(loops, q, free)
        if _open(loops, q) <= CLOSED:
            break
    return q


def _closed(loops: Loops, q: Array, free: Sequence[int]) -> Array:
    """Assembly by Newton's method with the smallest steps; one that does not bring the ends together is halved."""
    state = loops.at(q)
    for _ in range(_STEPS):
        if not free or np.abs(state.gap).max(initial=0.0) < 0.01 * CLOSED:
            break
        step = np.zeros_like(q)
        step[list(free)] = least(state.jacobian[:, list(free)], -state.gap)
        step /= max(float(np.abs(step[loops.angles]).max(initial=0.0)) / _TURN, 1.0)
        moved, share = state, 1.0
        for _ in range(_HALVINGS):
            moved = loops.at(q + share * step)
            if np.linalg.norm(moved.gap) < np.linalg.norm(state.gap):
                break
            share *= 0.5
        else:
            break
        q, state = q + share * step, moved
    return q


def _open(loops: Loops, q: Array) -> float:
    return float(np.abs(loops.at(q).gap).max(initial=0.0))


def least(matrix: Array, right: Array) -> Array:
    """Smallest least-squares solution for an assembly step, without what rounding alone decides."""
    return np.asarray(np.linalg.lstsq(matrix, right, rcond=NOTHING)[0])


def null_space(jacobian: Array) -> Array:
    """Orthonormal columns of the motions that loops with this derivative allow in an assembly."""
    _, sizes, rows = np.linalg.svd(jacobian)
    rank = int((sizes > NOTHING * float(sizes.max(initial=0.0))).sum())
    return np.asarray(rows[rank:].T)


def pivots(matrix: Array, rank: int, tiers: Sequence[Sequence[int]]) -> set[int]:
    """Pivot columns of an assembly's derivative, on which all others depend: as many as its rank."""
    left, sizes = matrix.copy(), np.linalg.norm(matrix, axis=0)
    found: set[int] = set()
    for tier in tiers:
        open_ones = list(tier)
        while open_ones and len(found) < rank:
            norms = np.linalg.norm(left[:, open_ones], axis=0)
            place = open_ones[int(np.argmax(norms))]
            if norms.max() <= NOTHING * max(sizes[place], 1.0):
                break
            way = left[:, place] / np.linalg.norm(left[:, place])
            left -= np.outer(way, way @ left)
            found.add(place)
            open_ones.remove(place)
    return found
