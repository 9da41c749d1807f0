"""Reduced models that were tried: coarsely timed, fitted, simulated in every way of stepping that may pay and timed."""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from functools import partial

import numpy as np

from vpm.budget import commands, start_state, time_steps
from vpm.errors import ExecutorError, SimulationError, VpmError
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.numbers import Array
from vpm.simplify.judge import Judge
from vpm.simplify.pareto_front import Rung
from vpm.simplify.reductions import Reduction, reduced
from vpm.simplify.replacement import commanded
from vpm.simulate import FIXED_STEP, Setup
from vpm.tasks import outcomes

#: Steps timed for each rung: as many as these seconds allow, within these numbers. A 99.9 % quantile needs the least.
TIMED_SECONDS = 0.05
TIMED_STEPS = (1_000, 20_000)
#: Every integrator of fixed steps is tried with these numbers of steps in a period.
SUBSTEPS = (1, 2, 4)
#: More steps of an integrator are tried while they lower the error to this share; two integrators that differ by less
#: both show the error of the model itself.
PAYS = 0.7
#: What a clock and a busy machine add to the time of any step, s: differences below it say nothing.
CLOCK = 5e-7
#: Times of steps of less than a microsecond differ by so much for no reason on a machine that does other things too.
ALIKE = 1.3
#: Steps of a coarse timing, and how much slower than another way that works one may be if it does not fit the period.
COARSE, SLOWER = 20, 5.0
#: What coarse timings of one model differ by, and medians of its steps.
REPEATED = 1.05
#: Share of the tolerance that is next to nothing, and how much slower than what loses no more than that a way may be.
NEGLIGIBLE, SPARE = 0.2, 2.0
#: Steps are timed before all ordinary threads where that is permitted, as a controller runs.
PRIORITY = 50

Changes = tuple[Reduction, ...]


class Trials:
    """Reduced models by their changes, each tried once.

    What is much slower by a coarse timing than something that loses next to nothing is not fitted: it can neither be
    chosen nor be a choice that anybody would take instead.

    - ``refit``: says of changes whether the parameters are fitted again
    - ``tell``: called with a sentence for each trial
    - ``tolerance``: largest loss that is allowed
    - ``executor``: does fits that `ahead` asks for, see `vpm.tasks.Tasks`
    """

    def __init__(
        self,
        model: Model,
        judge: Judge,
        refit: Callable[[Changes], bool],
        tell: Callable[[str], None],
        tolerance: float,
        executor: Executor | Callable[[], Executor] | None = None,
    ) -> None:
        self.model, self.judge, self.tolerance = model, judge, tolerance
        self._refit, self.say, self._executor = refit, tell, executor
        #: Fits that were done elsewhere, or their errors, by the models that they began with.
        self._fits: dict[Model, Model | VpmError] = {}
        #: Along what models are timed.
        self.courses = Courses(model, judge)
        #: Why the last way that did not work did not.
        self.reason = ""
        #: Fastest step of each model by a coarse timing, s.
        self._coarsely_timed: dict[frozenset[Reduction], float] = {}
        self._rungs: dict[frozenset[Reduction], list[Rung]] = {}
        self._models: dict[frozenset[Reduction], Model] = {}
        self._cut: set[frozenset[Reduction]] = set()

    @property
    def cut(self) -> int:
        """Number of trials without a fit because of a coarse timing."""
        return len(self._cut - set(self._rungs))

    @property
    def rungs(self) -> list[Rung]:
        """Tried models, cheapest first, with what they lose against the best way to step the full model."""
        everything, least = self._everything(), self._least()
        return sorted((replace(r, loss=r.error - least) for r in everything), key=lambda rung: rung.seconds)

    def fitted(self, changes: Changes) -> Model:
        """The model of a trial, its parameters fitted again."""
        return self._models[frozenset(changes)]

    def changes_of(self, rung: Rung) -> Changes:
        """Changes that gave a tried model."""
        return next(_in_order(key) for key in self._rungs if sorted(map(str, key)) == sorted(rung.removed))

    def cheapest(self, changes: Changes, limit: float) -> Rung | None:
        """Cheapest trial of these changes whose error is within a limit."""
        good = [rung for rung in self.attempt(changes) if rung.error <= limit]
        return min(good, key=lambda rung: rung.seconds, default=None)

    def attempt(self, changes: Changes, below: float = np.inf) -> Sequence[Rung]:
        """Trials of the model with these changes: one for each way to step it that works.

        None where the changes contradict each other, where no fit can simulate the model, or where no way is quick
        enough to matter.

        ``below``: coarse time of a period (s) from which on the model is not fitted.
        """
        key, changes = frozenset(changes), _in_order(changes)
        if key not in self._rungs:
            try:
                model = reduced(self.model, changes)
                coarse = self._coarse_times(model)
                self._coarsely_timed[key] = min(map(_period, coarse.values()), default=0.0)
                if changes and self._coarsely_timed[key] > min(below, self._dear()):
                    self._cut.add(key)
                    return []
                self.say(", ".join(map(str, changes)) or "the full model")
                self._models[key] = self._fit(self._begun(model, key)) if self._refit(changes) else model
                self._rungs[key] = []
                self._step(changes, coarse)
            except VpmError as error:
                self.reason = str(error)
                self._rungs.setdefault(key, [])
        return self._rungs[key]

    def ahead(self, tried: Iterable[Changes], below: float = np.inf) -> None:
        """Let the executor fit models of coming trials, side by side; without one they are fitted in turn.

        All end before anything is timed. A trial takes such a fit if its own would begin with the same values.

        ``below``: as for `attempt`.
        """
        if self._executor is None:
            return
        begun: list[Model] = []
        for changes in map(_in_order, tried):
            key = frozenset(changes)
            if key in self._rungs or not self._refit(changes):
                continue
            try:
                model = reduced(self.model, changes)
                if min(map(_period, self._coarse_times(model).values()), default=0.0) <= min(below, self._dear()):
                    begun.append(self._begun(model, key))
            except VpmError:
                continue  # the trial says why
        found, interrupted = outcomes([partial(self.judge.fitted, model) for model in begun], self._executor, self.say)
        if interrupted:
            raise KeyboardInterrupt
        for model, done in zip(begun, found, strict=True):
            if done is None or isinstance(done.error, ExecutorError):
                continue  # it was told, and the trial fits the model here
            if done.error is not None and not isinstance(done.error, VpmError):
                raise done.error
            self._fits[model] = done.value if done.error is None else done.error

    def _fit(self, begun: Model) -> Model:
        known = self._fits.get(begun)
        if isinstance(known, VpmError):
            raise known
        return self.judge.fitted(begun) if known is None else known

    def as_quick_as(self, changes: Changes) -> float:
        """Coarse time of a period (s) up to which a model is no dearer than a tried one."""
        return REPEATED * self._coarsely_timed[frozenset(changes)] + CLOCK

    def _begun(self, model: Model, key: frozenset[Reduction]) -> Model:
        """Start of a trial's fit: the parameters of the tried model that differs in the fewest changes."""
        nearest = min(self._models, key=lambda known: len(known ^ key), default=None)
        if nearest is None:
            return model
        known = self._models[nearest].parameters
        return model.with_parameters({name: known[name].value for name in model.adjustable if name in known})

    def saved(self, change: Reduction, setup: Setup) -> float:
        """Seconds of a period that one tried change of the full model saves; none where it fails."""
        try:
            return self._coarse_time(self.model, setup) - self._coarse_time(reduced(self.model, (change,)), setup)
        except VpmError:
            return 0.0

    def _everything(self) -> list[Rung]:
        return [rung for rungs in self._rungs.values() for rung in rungs]

    def _least(self) -> float:
        """Least error of trials: the full model stepped as well as it was."""
        return min((rung.error for rung in self._everything() if not rung.removed), default=0.0)

    def _enough(self) -> float:
        """Negligible error of trials: nothing more exact is looked for."""
        return self._least() + NEGLIGIBLE * self.tolerance

    def _dear(self) -> float:
        """Time of a period from which on a trial is not worth it."""
        enough = self._enough()
        least = min((rung.seconds for rung in self._everything() if rung.error <= enough), default=np.inf)
        return SPARE * least + CLOCK

    def _coarse_times(self, model: Model) -> Mapping[str, tuple[int, float]]:
        """Fewest steps of each integrator in trials by a coarse timing, and seconds of one of them."""
        found = {}
        for integrator in FIXED_STEP:
            for substeps in SUBSTEPS:
                try:
                    found[integrator] = substeps, self._coarse_time(model, Setup(integrator, substeps)) / substeps
                    break
                except SimulationError as error:
                    self.reason = str(error)
        return found

    def _coarse_time(self, model: Model, setup: Setup) -> float:
        inputs, start = self.courses.of(model)
        return float(np.min(time_steps(model, self.judge.rate, setup, COARSE, inputs, start=start).seconds))

    def _step(self, changes: Changes, coarse: Mapping[str, tuple[int, float]]) -> None:
        """Try every integrator with its fewest steps in a period, then more where they could pay."""
        for integrator, (fewest, seconds) in sorted(coarse.items(), key=lambda item: _period(item[1])):
            for substeps in SUBSTEPS[SUBSTEPS.index(fewest) :]:
                if self._is_hopeless(changes, seconds * substeps):
                    break
                # Too long a step for this integrator: perhaps a shorter one.
                if self._add(changes, Setup(integrator, substeps)) is not None:
                    break
        found = self._rungs[frozenset(changes)]
        # No steps lower the error of the model itself, which the best way shows.
        least = min((rung.error for rung in found), default=0.0)
        for first in [rung for rung in found if rung.error == least or PAYS * rung.error > least]:
            self._refine(changes, first)

    def _refine(self, changes: Changes, rung: Rung) -> None:
        """Try more and more steps in a period, as long as they pay."""
        for substeps in SUBSTEPS[SUBSTEPS.index(rung.substeps) + 1 :]:
            predicted = rung.seconds * substeps / rung.substeps
            if rung.error <= self._enough() or predicted > self._dear() or predicted * self.judge.rate > 1.0:
                return
            finer = self._add(changes, Setup(rung.integrator, substeps), PAYS * rung.error)
            if finer is None:
                return
            rung = finer

    def _is_hopeless(self, changes: Changes, seconds: float) -> bool:
        """Whether a trial is too slow by a coarse timing.

        All that is within reach of the period is tried with the full model: what it errs is the measure of the others.
        """
        known, enough = self._rungs[frozenset(changes)], self._enough()
        fastest = min((rung.seconds for rung in known), default=np.inf)
        if seconds * self.judge.rate > 1.0 and seconds > SLOWER * fastest:
            return True
        if not changes:
            return False
        if seconds > self._dear():
            return True
        good = min((rung.seconds for rung in known if rung.error <= enough), default=np.inf)
        return seconds > ALIKE * good or (seconds > fastest and _agree(known))

    def _add(self, changes: Changes, setup: Setup, demanded: float = np.inf) -> Rung | None:
        """Add the trial of one way of stepping, if it works and its error is small enough."""
        key = frozenset(changes)
        model = self._models[key]
        try:
            errors = self.judge.errors(model, setup)
            error, loudest = max((share, channel) for channel, share in errors.items())
            if not np.isfinite(error):
                self.reason = f"{loudest} does not change in the records, so that no error is a share of it"
            if not error < demanded:
                return None
            seconds, slowest = self.timed(model, setup)
        except SimulationError as reason:
            self.reason = str(reason)
            return None
        labels, states, told = tuple(map(str, changes)), model.core.n_states, tuple(errors.items())
        rung = Rung(labels, setup.integrator, setup.substeps, states, error, loudest, error, seconds, slowest, told)
        self._rungs[key].append(rung)
        return rung

    def timed(self, model: Model, setup: Setup) -> tuple[float, float]:
        """Median and 99.9 % quantile of a trial's period, s."""
        rate, (inputs, start) = self.judge.rate, self.courses.of(model)
        times = time_steps(model, rate, setup, TIMED_STEPS[0], inputs, priority=PRIORITY, start=start).seconds
        steps = int(np.clip(TIMED_SECONDS / np.median(times), *TIMED_STEPS))
        if steps > TIMED_STEPS[0]:
            times = time_steps(model, rate, setup, steps, inputs, priority=PRIORITY, start=start).seconds
        return float(np.median(times)), float(np.quantile(times, 0.999))


def _period(step: tuple[int, float]) -> float:
    """Period of a trial in seconds, of so many steps of so many seconds."""
    substeps, seconds = step
    return substeps * seconds


def _in_order(changes: Collection[Reduction]) -> Changes:
    """Tried changes by their words, terms of the equations last."""
    return tuple(sorted(changes, key=lambda change: (change.kind == "terms", str(change))))


def _agree(rungs: Sequence[Rung]) -> bool:
    """Whether two integrators agree in trials: the error is then the model's own."""
    first: dict[str, float] = {}
    for rung in rungs:
        first.setdefault(rung.integrator, rung.error)
    least = sorted(first.values())[:2]
    return len(least) == 2 and least[0] > PAYS * least[1]


class Courses:
    """Commands along the first record to judge on, worked out once for all models with the same drives."""

    def __init__(self, model: Model, judge: Judge) -> None:
        self._full, self._judge = model, judge
        self._known: dict[tuple[str, ...], Array] = {}

    def record(self, model: Model) -> Experiment:
        """Record that drives a tried model."""
        return commanded(model, self._full, self._judge.driven)

    def of(self, model: Model) -> tuple[Array, Array | None]:
        """Inputs (N, inputs) of a tried model, and its start state; see `vpm.budget.start_state`."""
        record = self.record(model)
        kinds = tuple(model.actuator_type(name) for name in model.actuators) + model.controlled_actuators
        if kinds not in self._known:
            # Reduced models of the same drives get what the first of them got, which is the full model.
            self._known[kinds] = commands(model, self._judge.rate, record)
        return self._known[kinds], start_state(model, record)
