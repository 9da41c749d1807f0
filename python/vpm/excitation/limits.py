"""What a joint may do."""

from dataclasses import dataclass

import numpy as np

from vpm.errors import ExcitationError
from vpm.results import Storable


@dataclass(frozen=True, repr=False, eq=False)
class JointLimits(Storable):
    """Limits of a joint that an excitation keeps.

    Attributes
    ----------
    position : tuple of float
        Lowest and highest, rad or m.
    speed, acceleration : float
        Largest absolute values, per second and per second squared.
    effort : float
        Largest absolute effort of the actuator at the joint, N m or N; without bound by default.
    """

    position: tuple[float, float]
    speed: float
    acceleration: float
    effort: float = float("inf")

    def __post_init__(self) -> None:
        """Refuse limits that allow no motion."""
        low, high = self.position
        if not (np.isfinite(low) and np.isfinite(high) and low < high):
            raise ExcitationError(f"a joint's range from {low:g} to {high:g} is empty or endless; give low before high")
        for what, value in (("speed", self.speed), ("acceleration", self.acceleration), ("effort", self.effort)):
            if not value > 0.0 or (what != "effort" and not np.isfinite(value)):
                raise ExcitationError(f"the limit of a joint's {what} is {value:g}; give a positive number")
