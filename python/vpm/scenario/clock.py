"""The time base of a scenario: one for all runs."""

import math
from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vpm.model import Model
from vpm.scenario.messages import refuse
from vpm.scenario.schema import Document, si_value

#: Samples that a scenario may have: more do not fit into a memory.
MOST_SAMPLES = 10_000_000

#: Numbers that all runs of a scenario may make together, states and outputs of every sample: some copies of them fit
#: into 2 GB, and a core that gets no memory ends the process.
MOST_NUMBERS = 20_000_000

#: Share of a step by which the duration may miss a whole number of steps: decimal fractions are rounded.
DIVISION_TOLERANCE = 1e-6


@dataclass(frozen=True)
class Clock:
    """Samples at ``0, time_step, 2 time_step, ... duration``."""

    #: s.
    duration: float
    time_step: float
    steps: int  #: Steps between the first and the last sample.

    @cached_property
    def time(self) -> NDArray[np.float64]:
        """Time of a scenario's clock, shape (steps + 1,), s."""
        return np.arange(self.steps + 1, dtype=np.float64) * np.float64(self.time_step)


def clock_of(document: Document) -> Clock:
    """Clock of a scenario."""
    duration = si_value(document.duration, "s", ("duration",))
    time_step = si_value(document.time_step, "s", ("time_step",))
    for name, value in (("duration", duration), ("time_step", time_step)):
        if not value > 0.0:
            refuse((name,), f"is {value:g} s, but has to be above 0 s; correct it")
    steps = duration / time_step
    if steps > MOST_SAMPLES:
        refuse(("time_step",), f"is {time_step:g} s, which makes {steps:.3g} samples in {duration:g} s; make it longer")
    whole = round(steps)
    if whole < 1 or abs(steps - whole) > DIVISION_TOLERANCE:
        near = duration / max(1, math.ceil(steps - DIVISION_TOLERANCE))
        rest = f"is {time_step:g} s, which does not divide the duration of {duration:g} s ({steps:.6g} steps)"
        refuse(("time_step",), f"{rest}; write for example {near:.6g}")
    return Clock(duration, time_step, whole)


def check_numbers(clock: Clock, models: Collection[Model]) -> None:
    """Refuse a clock with runs that no memory holds."""
    each = sum(len(model.state_names) + len(model.output_channels) for model in models)
    if clock.steps * each > MOST_NUMBERS:
        rest = f"makes {clock.steps} samples of {each} numbers in all runs, and {MOST_NUMBERS} numbers fit together"
        refuse(("duration",), f"{rest}; shorten it, or make time_step longer")
