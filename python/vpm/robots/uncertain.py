"""How uncertain parameters of an imported robot are: a share of each, with bounds that a fit keeps to."""

import math
from dataclasses import dataclass
from typing import Any

from vpm.errors import ModelError
from vpm.robots.parts import Inertial

#: Standard deviations to either side that a fit may go.
REACH = 5.0


@dataclass(frozen=True)
class Spread:
    """Standard deviation of parameters as a share of their size; 0 where they are known.

    A mass or a friction is of its own size. A centre is of the size of its body as seen from the joint, the root of the
    mean square distance of the mass from there; an inertia of that of the mean moment.
    """

    share: float = 0.0

    def __post_init__(self) -> None:
        if not 0.0 <= self.share < 1.0:
            raise ModelError(
                f"parameters are uncertain by a share of {self.share:g}; give one from 0 to below 1, such as 0.1"
            )

    def scaled(self, value: float, unit: str) -> dict[str, Any]:
        """Uncertain parameter above 0: its bounds are as many times smaller as larger."""
        factor = 1.0 + REACH * self.share
        return self._table(value, unit, self.share * value, value / factor, value * factor)

    def friction(self, value: float, unit: str) -> dict[str, Any]:
        """Uncertain parameter that may be 0."""
        return self._table(value, unit, self.share * value, 0.0, value * (1.0 + REACH * self.share))

    def center(self, inertial: Inertial) -> list[Any]:
        """Centre of mass of an imported body as parameters with uncertainties."""
        size = math.hypot(*inertial.center, inertial.spread)
        return [self._about(value, "m", self.share * size) for value in inertial.center]

    def inertia(self, inertial: Inertial) -> list[Any]:
        """Uncertain inertia about the centre of mass."""
        size = self.share * sum(inertial.inertia[:3]) / 3.0
        lowest = [-math.inf if place > 2 else 0.0 for place in range(6)]
        pairs = zip(inertial.inertia, lowest, strict=True)
        return [self._about(value, "kg m^2", size, low) for value, low in pairs]

    def _about(self, value: float, unit: str, deviation: float, lowest: float = -math.inf) -> float | dict[str, Any]:
        """Parameter of either sign with an uncertainty and bounds around its value."""
        if not self.share or deviation == 0.0:
            return value
        low = max(value - REACH * deviation, min(lowest, value))
        return self._table(value, unit, deviation, low, value + REACH * deviation)

    def _table(self, value: float, unit: str, deviation: float, low: float, high: float) -> dict[str, Any]:
        table: dict[str, Any] = {"value": value, "unit": unit}
        if self.share and deviation > 0.0:
            bounds = {"min": min(float(f"{low:.3g}"), value), "max": max(float(f"{high:.3g}"), value)}
            table |= {"uncertainty": float(f"{deviation:.2g}"), **bounds}
        return table
