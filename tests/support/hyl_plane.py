"""Points, bodies and lines in a plane, vectors as complex numbers: places, partial velocities, accelerations."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass
class Point:
    """A point: place, partial velocities by the coordinates, acceleration without z''."""

    place: Complex
    partial: Complex
    bias: Complex

    def velocity(self, rates: Array) -> Complex:
        """Velocity."""
        return np.asarray((self.partial * rates).sum(axis=0))


@dataclass
class Frame:
    """A body's origin, angle, and the coordinates that its angle is the sum of."""

    origin: Point
    angle: Array
    spin: Array
    partial: Array

    def point(self, local: complex) -> Point:
        """Point that is fixed to the body."""
        arm = local * np.exp(1j * self.angle)
        turned = self.origin.partial + 1j * arm * self.partial
        return Point(self.origin.place + arm, turned, self.origin.bias - self.spin**2 * arm)


@dataclass
class Rod:
    """A straight line between two points: length, angle, and points along it."""

    start: Point
    end: Point
    rates: Array

    def __post_init__(self) -> None:
        span = self.end.place - self.start.place
        partial, bias = self.end.partial - self.start.partial, self.end.bias - self.start.bias
        self.length = np.abs(span)
        self.along = span / self.length
        across = 1j * self.along
        self.lever = (np.conj(self.along) * partial).real
        self.turn = (np.conj(across) * partial).real / self.length
        self.rate = (self.lever * self.rates).sum(axis=0)
        self.spin = (self.turn * self.rates).sum(axis=0)
        self.turn_bias = ((np.conj(across) * bias).real - 2.0 * self.rate * self.spin) / self.length

    def point(self, end: Point, distance: float) -> Point:
        """Point at a distance from one end, along the line."""
        way, across = distance * self.along, 1j * distance * self.along
        bias = end.bias + across * self.turn_bias - way * self.spin**2
        return Point(end.place + way, end.partial + across * self.turn, bias)
