"""Reduced models that were tried: fitted, simulated in every way to step them, and timed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from vpm.budget import commands, step_times
from vpm.errors import SimulationError, VpmError
from vpm.model import Model
from vpm.simplify.judge import Judge
from vpm.simplify.ladder import Rung
from vpm.simplify.reductions import Reduction, reduced
from vpm.simulate import FIXED_STEP, Setup

#: Steps timed for each rung: as many as these seconds allow, within these numbers. A 99.9 % quantile needs the least.
TIMED_SECONDS = 0.25
TIMED_STEPS = (1_000, 20_000)
#: Every integrator of fixed steps is tried with these numbers of steps in a period.
SUBSTEPS = (1, 2, 4)
#: More steps of an integrator are tried while they lower the error to this share.
PAYS = 0.7
#: Steps of a first glance, and how much slower than another way that works one may be if it does not fit the period.
GLANCE, SLOWER = 20, 5.0

Changes = tuple[Reduction, ...]


class Trials:
    """Reduced models by their changes, each tried once.

    Parameters
    ----------
    model : Model
        The full one.
    judge : Judge
    refit : Callable
        Says of changes whether the parameters are fitted again.
    tell : callable
        Called with a sentence for each trial.
    """

    def __init__(
        self, model: Model, judge: Judge, refit: Callable[[Changes], bool], tell: Callable[[str], None]
    ) -> None:
        self.model, self.judge = model, judge
        self._refit, self._tell = refit, tell
        self._inputs = commands(model, judge.rate, judge.driven)
        #: Why the last way that did not work did not.
        self.reason = ""
        self._rungs: dict[frozenset[Reduction], list[Rung]] = {}
        self._models: dict[frozenset[Reduction], Model] = {}

    @property
    def rungs(self) -> list[Rung]:
        """All rungs, cheapest first, with what they lose against the best way to step the full model."""
        everything = [rung for rungs in self._rungs.values() for rung in rungs]
        least = min((rung.error for rung in everything if not rung.removed), default=0.0)
        return sorted((replace(r, loss=r.error - least) for r in everything), key=lambda rung: rung.seconds)

    def fitted(self, changes: Changes) -> Model:
        """The model of a trial, its parameters fitted again."""
        return self._models[frozenset(changes)]

    def changes_of(self, rung: Rung) -> Changes:
        """Changes that gave a rung."""
        return next(tuple(key) for key in self._rungs if sorted(map(str, key)) == sorted(rung.removed))

    def cheapest(self, changes: Changes, limit: float) -> Rung | None:
        """Cheapest rung of these changes whose error is within a limit."""
        good = [rung for rung in self.attempt(changes) if rung.error <= limit]
        return min(good, key=lambda rung: rung.seconds, default=None)

    def attempt(self, changes: Changes) -> Sequence[Rung]:
        """Rungs of the model with these changes: one for each way to step it that works.

        None where the changes contradict each other, or where no fit can simulate the model.
        """
        key = frozenset(changes)
        if key not in self._rungs:
            self._tell(", ".join(map(str, changes)) or "the full model")
            try:
                self._models[key] = self._made(changes)
                self._rungs[key] = self._stepped(changes)
            except VpmError as error:
                self.reason = str(error)
                self._rungs[key] = []
        return self._rungs[key]

    def _made(self, changes: Changes) -> Model:
        model = reduced(self.model, changes)
        return self.judge.fitted(model) if self._refit(changes) else model

    def _stepped(self, changes: Changes) -> list[Rung]:
        """Rungs of every integrator."""
        found: list[Rung] = []
        for integrator in FIXED_STEP:
            fastest = min((rung.seconds for rung in found), default=np.inf)
            found += self._with_more_steps(changes, integrator, fastest)
        return found

    def _with_more_steps(self, changes: Changes, integrator: str, fastest: float) -> list[Rung]:
        """Rungs of one integrator with more and more steps in a period, as long as more steps pay."""
        model, found = self._models[frozenset(changes)], list[Rung]()
        for substeps in SUBSTEPS:
            setup = Setup(integrator, substeps)
            try:
                if self._is_hopeless(model, setup, fastest):
                    break
                errors = self.judge.errors(model, setup)
            except SimulationError as reason:
                # Too long a step for this integrator: perhaps a shorter one.
                self.reason = str(reason)
                continue
            error, loudest = max((share, channel) for channel, share in errors.items())
            if found and not error < PAYS * found[-1].error:
                break
            times = self.timed(model, setup)
            labels, states = tuple(map(str, changes)), model.core.n_states
            found.append(Rung(labels, integrator, substeps, states, error, loudest, error, *times))
        return found

    def _is_hopeless(self, model: Model, setup: Setup, fastest: float) -> bool:
        """Whether a step takes longer than the period, and so much longer than a way that works, that none takes it."""
        few = float(np.median(step_times(model, self.judge.rate, setup, GLANCE, self._inputs)))
        return few * self.judge.rate > 1.0 and few > SLOWER * fastest

    def timed(self, model: Model, setup: Setup, most: int = TIMED_STEPS[1]) -> tuple[float, float]:
        """Median and 99.9 % quantile of a period, s.

        Parameters
        ----------
        model : Model
        setup : Setup
        most : int
            Steps at most.
        """
        rate = self.judge.rate
        times = step_times(model, rate, setup, TIMED_STEPS[0], self._inputs)
        steps = int(np.clip(TIMED_SECONDS / np.median(times), TIMED_STEPS[0], most))
        if steps > TIMED_STEPS[0]:
            times = step_times(model, rate, setup, steps, self._inputs)
        return float(np.median(times)), float(np.quantile(times, 0.999))
