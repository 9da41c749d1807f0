"""Lever of a structure's effect: a size and the place that it acts at, of which records show the products."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vpm.numbers import Array


@dataclass(frozen=True)
class Lever:
    """Lever: places among a structure's unknown parameters, of which records tell products with a size.

    Of a spring these are the stiffness and the force where its joint is at zero. Of a mass they are what it weighs and
    turns by, its first moment, and what it takes to turn it, its second one. The mass alone shows little where a joint
    turns it. In all of these a fit goes straight ahead where it would turn round corners otherwise.
    """

    size: int  #: Index of the size.
    places: tuple[int, ...]  #: Those of the place, one for each axis.
    is_mass: bool  #: Whether the size is a mass.

    def moved(self, size: float, place: Array, more: float, way: Array) -> tuple[float, Array]:
        """Size and place (k,) after a step by ``more`` and ``way`` (k,) that products follow in a straight line."""
        first = size * (place + way) + place * more
        second = float(place @ place) * (size + more) + 2.0 * size * float(place @ way)
        after = float(first @ first) / second if self.is_mass and second > 0.0 else size + more
        return (after, first / after) if size * after > 0.0 else (size + more, place + way)

    def way(self, size: float, place: Array, after: float, there: Array) -> tuple[float, Array]:
        """Step from a size and place (k,) to others: what `moved` takes."""
        if size * after <= 0.0:
            return after - size, there - place
        first, far = after * there - size * place, float(place @ place)
        second = after * float(there @ there) - size * far
        more = (2.0 * float(place @ first) - second) / far if self.is_mass and far > 0.0 else after - size
        return more, np.asarray((first - place * more) / size)
