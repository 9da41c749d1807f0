"""Between readings: outputs of a model as a log holds them that read a channel less often than it has samples.

Straight lines run from reading to reading. An accelerometer jumps with every command that a drive holds, and between
two readings it is not where the line is: compared sample by sample, such a log looks late.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vpm.experiment import Experiment
from vpm.numbers import Array


@dataclass(frozen=True)
class Lines:
    """Straight lines between values at some times, taken at other times: where on which line each of these is."""

    begins: NDArray[np.intp]  #: Shape (m,); number of the value at which the line begins.
    shares: Array  #: Shape (m,); how far on the line.

    @classmethod
    def between(cls, own: Array, at: Array) -> Lines:
        """Lines between readings at times ``own`` (n,), taken at times ``at`` (m,) within them."""
        begins = np.clip(np.searchsorted(own, at, side="right") - 1, 0, len(own) - 2)
        return cls(begins, np.clip((at - own[begins]) / (own[begins + 1] - own[begins]), 0.0, 1.0))

    def of(self, values: Array) -> Array:
        """Values (m, ...) on the lines between values (n, ...) at readings."""
        shares = self.shares.reshape(-1, *(1,) * (values.ndim - 1))
        return np.asarray(values[self.begins] + shares * (values[self.begins + 1] - values[self.begins]))


def between_readings(experiment: Experiment, channel: str, values: Array) -> Array:
    """Values (N, ...) of a channel at all samples as a log holds them that has lines between its readings.

    Before the first reading and behind the last one values stay as they are.
    """
    time = experiment.time
    own = experiment.read_at.get(channel, time[:0])
    own = own[(own >= time[0]) & (own <= time[-1])]
    if len(own) < 2:
        return values
    inside = (time >= own[0]) & (time <= own[-1])
    found = values.copy()
    found[inside] = Lines.between(own, time[inside]).of(Lines.between(time, own).of(values))
    return found
