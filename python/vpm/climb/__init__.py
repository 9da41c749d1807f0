"""Climb in complexity while identifying, as far as validation records say that more detail pays."""

from vpm.climb.climbing import climb
from vpm.climb.result import Climb, Level

__all__ = ["Climb", "Level", "climb"]
