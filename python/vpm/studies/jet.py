"""Numbers with exact first and second derivatives at many points at once: what a Newton step needs of an energy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vpm.numbers import Array


@dataclass(frozen=True)
class Jet:
    """A function of n variables, to second order."""

    value: Array  #: Shape (...).
    gradient: Array  #: Shape (n, ...).
    hessian: Array  #: Shape (n, n, ...).

    def __add__(self, other: Jet | float | Array) -> Jet:
        if not isinstance(other, Jet):
            return Jet(self.value + other, self.gradient, self.hessian)
        return Jet(self.value + other.value, self.gradient + other.gradient, self.hessian + other.hessian)

    def __sub__(self, other: Jet | float | Array) -> Jet:
        return self + (other * -1.0 if isinstance(other, Jet) else -other)

    def __mul__(self, other: Jet | float | Array) -> Jet:
        if not isinstance(other, Jet):
            return Jet(self.value * other, self.gradient * other, self.hessian * other)
        cross = self.gradient[:, None] * other.gradient[None]
        return Jet(
            self.value * other.value,
            self.value * other.gradient + other.value * self.gradient,
            self.value * other.hessian + other.value * self.hessian + cross + np.swapaxes(cross, 0, 1),
        )

    def power(self, exponent: float) -> Jet:
        """Power of a jet; its values have to be above zero unless the exponent is a whole number."""
        x = self.value
        first = exponent * x ** (exponent - 1.0) if exponent else np.zeros_like(x)
        second = exponent * (exponent - 1.0)
        bend = second * x ** (exponent - 2.0) if second else np.zeros_like(x)
        outer = self.gradient[:, None] * self.gradient[None]
        return Jet(x**exponent, first * self.gradient, first * self.hessian + bend * outer)


def variables(values: Array) -> list[Jet]:
    """Variables as jets, whose own derivatives are one and whose second ones are zero.

    ``values``: shape (n, ...).
    """
    count, shape = len(values), values.shape[1:]
    unit = np.eye(count).reshape(count, count, *(1,) * len(shape))
    none = np.zeros((count, count, *shape))
    return [Jet(values[k], np.broadcast_to(unit[k], values.shape), none) for k in range(count)]
