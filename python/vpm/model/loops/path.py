"""The way of a machine with closed loops and one degree of freedom, and the singular configurations on it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vpm.errors import ModelError
from vpm.model.loops.assembly import least, null_space
from vpm.numbers import Array

if TYPE_CHECKING:
    from vpm.model.loops.closure import Loops


#: Length of a step along the way, in units of the coordinates; shorter ones follow sharp bends.
_STEP, _SHORTEST = 0.02, 1e-7
#: Steps after which a way that does not return to its start is given up, and bisections of a step.
_MOST, _BISECTIONS = 20_000, 60
#: Newton steps back to the way.
_TURNS = 12


@dataclass(frozen=True)
class Singularity:
    """A configuration in which a coordinate loses control of the others."""

    coordinate: str  #: The one that loses control: it stands still while the others move.
    value: float  #: Where it stands (m, rad).
    position: Mapping[str, float]  #: All coordinates there.

    def __repr__(self) -> str:
        where = ", ".join(f"{name} = {value:.6g}" for name, value in self.position.items() if name != self.coordinate)
        return f"{self.coordinate} = {self.value:.9g} controls nothing any more ({where})"


class Path:
    """The configurations that are reached with closed loops while some coordinates are held.

    Followed by predictor and corrector along the tangent (E. Allgower, K. Georg, "Introduction to Numerical
    Continuation Methods", 2003, chapter 2).

    ``fixed``: places of those that are held.
    """

    def __init__(self, loops: Loops, names: Sequence[str], fixed: Sequence[int]) -> None:
        self._loops = loops
        self._names = tuple(names)
        self._free = [place for place in range(len(names)) if place not in fixed]

    def singular(self, start: Array, coordinate: int) -> tuple[Singularity, ...]:
        """Singular places on the path, where a coordinate turns round, in both directions from the start."""
        found: list[Singularity] = []
        for direction in (1.0, -1.0):
            before, closed = None, False
            for q, tangent in self._follow(start, direction):
                if before is not None:
                    at, ahead = before
                    if ahead[coordinate] * tangent[coordinate] < 0.0:
                        place = self._between(at, ahead, q, coordinate)
                        values = dict(zip(self._names, place.tolist(), strict=True))
                        found.append(Singularity(self._names[coordinate], float(place[coordinate]), values))
                    if self._is_back(at, q, start):
                        closed = True
                        break
                before = (q, tangent)
            if closed:
                break
        return tuple(found)

    def _tangent(self, q: Array) -> Array:
        """Unit vector along the path."""
        ways = null_space(self._loops.at(q).jacobian[:, self._free])
        left = ways.shape[1]
        if left != 1:
            raise ModelError(
                f"{left} degrees of freedom are left where one way is followed; hold {left - 1} coordinates more"
                if left > 1
                else "no degree of freedom is left where one way is followed; hold fewer coordinates"
            )
        tangent = np.zeros_like(q)
        tangent[self._free] = ways[:, -1]
        return tangent

    def _follow(self, start: Array, direction: float) -> Iterator[tuple[Array, Array]]:
        tangent = direction * self._tangent(start)
        q, step = start, _STEP
        yield q, tangent
        for _ in range(_MOST):
            moved = self._back(q + step * tangent)
            ahead = None if moved is None else self._tangent(moved)
            if ahead is not None and ahead @ tangent < 0.0:
                ahead = -ahead
            # A bend of more than some degrees in a step, or none that closes: look closer.
            if moved is None or ahead is None or ahead @ tangent < 0.99 or np.linalg.norm(moved - q) > 2.0 * step:
                step *= 0.5
                if step < _SHORTEST:
                    return
                continue
            q, tangent, step = moved, ahead, min(2.0 * step, _STEP)
            yield q, tangent

    def _back(self, q: Array) -> Array | None:
        """Nearest place on the path; None where none is near."""
        for _ in range(_TURNS):
            state = self._loops.at(q)
            if np.abs(state.gap).max(initial=0.0) < 1e-14:
                return q
            q = q.copy()
            q[self._free] += least(state.jacobian[:, self._free], -state.gap)
        return q if np.abs(self._loops.at(q).gap).max(initial=0.0) < 1e-12 else None

    def _between(self, at: Array, ahead: Array, end: Array, coordinate: int) -> Array:
        """Place on the path between two others where the coordinate stands still."""
        low, high = 0.0, float(ahead @ (end - at))
        sign = ahead[coordinate]
        place = end
        for _ in range(_BISECTIONS):
            middle = 0.5 * (low + high)
            found = self._back(at + middle * ahead)
            if found is None:
                break
            place, tangent = found, self._tangent(found)
            tangent = tangent if tangent @ ahead > 0.0 else -tangent
            low, high = (middle, high) if tangent[coordinate] * sign > 0.0 else (low, middle)
        return place

    def _is_back(self, at: Array, q: Array, start: Array) -> bool:
        """Whether the path passes its start between two places; whole turns of angles count as none."""
        turning = [place for place in self._free if self._loops.turns(self._names[place])]

        def apart(other: Array) -> Array:
            away = other - start
            away[turning] = (away[turning] + np.pi) % (2.0 * np.pi) - np.pi
            return np.asarray(away)

        before, after = apart(at), apart(q)
        length = float(np.linalg.norm(q - at))  # where an angle leaps by a whole turn, what is apart does not
        near = float(np.linalg.norm(before)) < 2.0 * length and float(np.linalg.norm(after)) < 2.0 * length
        return near and float(before @ (after - before)) < 0.0 <= float(after @ (after - before))
