"""A record with delayed channels: the delay is fitted together with the parameters of a model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vpm.experiment import Experiment
from vpm.log_check.correction import Correction
from vpm.model import Model
from vpm.numbers import Array
from vpm.ranking.model_structure import Structure
from vpm.ranking.settings import Settings
from vpm.ranking.tracked_records import TrackedRecords, Tracker, among_parameters
from vpm.simulate import Setup
from vpm.weighing.priors import Prior

#: What a structure calls the delay, which no model has.
DELAY = "delay"
#: By how much a delay is moved for its derivative, in samples.
STEP = 0.1


class Delayed(TrackedRecords):
    """A record with delayed channels; the delay follows the parameters of the model in ``theta``.

    It has the same samples for every delay: those at its ends, which have no values of their own, are cut.

    - ``correction``: its channels are delayed; its delay is the start value of a fit
    - ``longest_delay``: longest delay, s
    """

    def __init__(
        self,
        model: Model,
        record: Experiment,
        correction: Correction,
        longest_delay: float,
        settings: Settings,
        setup: Setup,
    ) -> None:
        self.logged, self.correction = record, correction
        # A sample more than the longest delay takes, for the derivative there.
        self.cut = int(np.ceil(longest_delay / record.dt)) + 1
        super().__init__(model, [self._corrected(correction.delay)], settings, setup)

    def follow(
        self,
        model: Model,
        theta: Array,
        tracker: Tracker,
        columns: Sequence[int] = (),
        moves: Array | None = None,
    ) -> tuple[Array, Array]:
        """Readings less outputs, see `TrackedRecords.follow`; ``theta`` are the parameters, then the delay."""
        own, delay = len(model.theta), float(theta[-1])
        _, by = among_parameters(own, columns, moves)
        residual, slopes = self._at(delay).follow(model, theta[:own], tracker, *by)
        if own not in columns:
            return residual, slopes
        step = STEP * self.logged.dt
        moved, _ = self._at(delay + step).follow(model, theta[:own], tracker)
        return residual, np.insert(slopes, list(columns).index(own), (moved - residual) / step, axis=2)

    def _at(self, delay: float) -> TrackedRecords:
        return TrackedRecords(self.model, [self._corrected(delay)], self.settings, self.setup)

    def _corrected(self, delay: float) -> Experiment:
        later = replace(self.correction, delay=delay).applied(self.logged)
        first = self.cut - round((later.time[0] - self.logged.time[0]) / self.logged.dt)
        kept = slice(first, first + len(self.logged) - 2 * self.cut)
        return replace(later, time=later.time[kept], data=later.data[kept])


def with_delay(structure: Structure, delay: float, longest_delay: float) -> Structure:
    """A structure one of whose unknowns is a delay, s."""
    prior = Prior(0.0, longest_delay, -longest_delay, longest_delay)
    theta = np.append(structure.theta, delay)
    return replace(structure, theta=theta, priors={**structure.priors, DELAY: prior}, firsts=(DELAY,))


def without_delay(structure: Structure) -> Structure:
    """The structure with the unknowns of the model alone, without the delay."""
    priors = {name: prior for name, prior in structure.priors.items() if name != DELAY}
    return replace(structure, theta=structure.theta[:-1], priors=priors, firsts=())
