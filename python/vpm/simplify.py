"""Walk a model back down: the cheapest one that still predicts the data within a tolerance."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from vpm.budget import budget
from vpm.errors import DivergedError, SimulationError
from vpm.experiment import Experiment
from vpm.identify import InverseDynamicsProblem, OutputErrorProblem, estimate, gaps
from vpm.model import Effect, Model
from vpm.results import Result, Storable
from vpm.simulate import FIXED_STEP, Setup, judging_mode

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Steps timed for each rung.
TIMED_STEPS = 20_000
#: Effects beyond this number are left out one at a time only; below it every subset is tried.
EXHAUSTIVE = 5


@dataclass(frozen=True, repr=False, eq=False)
class Rung(Storable):
    """One simplified model.

    Attributes
    ----------
    removed : tuple of str
        ``effect at site`` of what was left out.
    integrator : str
    error : float
        Largest relative error over the channels, on the records.
    loss : float
        What it lost against the full model.
    seconds : float
        Typical step time (median), s: what the rungs are ranked by.
    slowest : float
        Step time at its 99.9 % quantile, s: what has to fit the period.
    """

    removed: tuple[str, ...]
    integrator: str
    error: float
    loss: float
    seconds: float
    slowest: float


@dataclass(frozen=True, repr=False, eq=False)
class Ladder(Result):
    """All rungs that were tried and the one to take.

    Attributes
    ----------
    rungs : tuple of Rung
        Cheapest first; the full model is among them.
    chosen : Rung
        The cheapest one within the tolerance.
    holds : bool
        Whether it also fits the period.
    rate, tolerance : float
    model : Model
        The chosen model, its parameters fitted again.
    """

    rungs: tuple[Rung, ...]
    chosen: Rung
    holds: bool
    rate: float
    tolerance: float
    model: Model

    def __str__(self) -> str:
        """The choice, and the rungs around it."""
        left_out = ", ".join(self.chosen.removed) or "nothing"
        lines = [
            f"cheapest within {100 * self.tolerance:g} %: left out {left_out}; {self.chosen.integrator}; "
            f"error {100 * self.chosen.error:.2f} % (loss {100 * self.chosen.loss:.2f} %), "
            f"{1e6 * self.chosen.seconds:.3g} us a step, "
            f"{100 * self.chosen.slowest * self.rate:.3g} % of the period at p99.9"
        ]
        lines += [
            f"  {1e6 * r.seconds:8.3g} us  error {100 * r.error:7.2f} %  {r.integrator:18s} "
            f"without {', '.join(r.removed) or 'nothing'}"
            for r in self.rungs[:20]
        ]
        return "\n".join(lines)

    def _headline(self) -> Mapping[str, object]:
        return {"left_out": self.chosen.removed, "integrator": self.chosen.integrator, "holds": self.holds}

    def _frame_columns(self) -> Mapping[str, object]:
        return {
            "left_out": [", ".join(r.removed) for r in self.rungs],
            **{
                name: [getattr(r, name) for r in self.rungs]
                for name in ("integrator", "error", "loss", "seconds", "slowest")
            },
        }

    def plot(self) -> Figure:
        """Error against step time. Needs the extra ``plot``."""
        from vpm.plot import plot_ladder

        return plot_ladder(
            [r.seconds for r in self.rungs], [r.error for r in self.rungs], self.rungs.index(self.chosen)
        )


def simplify(
    model: Model,
    experiments: Experiment | Sequence[Experiment],
    *,
    rate: float = 1000.0,
    tolerance: float = 0.02,
    share: float = 0.2,
    tell: Callable[[str], None] | None = None,
) -> Ladder:
    """Leave out effects and choose an integrator until the model is as cheap as the tolerance allows.

    Every reduced model is fitted again to the records before it is judged by simulation, so that what remains may
    take over what it can.

    Parameters
    ----------
    model : Model
    experiments : Experiment or sequence of Experiment
        Trajectories on which accuracy counts.
    rate : float
        Rate of the controller, Hz.
    tolerance : float
        Largest loss of relative error against the full model.
    share : float
        Share of the period that a step may take.
    tell : callable, optional
        Called with a sentence at every step.

    Returns
    -------
    Ladder
    """
    if not tolerance >= 0.0:
        raise SimulationError(f"a tolerance of {tolerance:g} is not possible; give a share of zero or more")
    records = [experiments] if isinstance(experiments, Experiment) else list(experiments)
    say = tell or (lambda _: None)
    rungs: list[tuple[Rung, Model]] = []
    full = np.nan
    for removed in _subsets(model.effects):
        reduced = _refitted(_without(model, removed), records)
        labels = tuple(f"{effect.name} at {effect.at}" for effect in removed)
        say(f"without {', '.join(labels) or 'nothing'}")
        for integrator in FIXED_STEP:
            error = _error(reduced, records, integrator)
            full = error if np.isnan(full) else full
            if error < np.inf:
                report = budget(reduced, rate=rate, steps=TIMED_STEPS, integrator=integrator, experiment=records[0])
                typical, slowest = report.quantiles["p50"], report.quantiles["p99.9"]
                rung = Rung(labels, integrator, error, error - full, typical, slowest)
                rungs.append((rung, reduced))
    if not rungs:
        raise SimulationError(f"{model.name}: no integrator can simulate the records at {rate:g} Hz")
    rungs.sort(key=lambda pair: pair[0].seconds)
    chosen, best = next(pair for pair in rungs if pair[0].loss <= tolerance)
    return Ladder(tuple(r for r, _ in rungs), chosen, chosen.slowest * rate <= share, rate, tolerance, best)


def _subsets(effects: Sequence[Effect]) -> Iterator[tuple[Effect, ...]]:
    """What to leave out, the full model first."""
    sizes = range(len(effects) + 1) if len(effects) <= EXHAUSTIVE else range(2)
    for size in sizes:
        yield from combinations(effects, size)


def _without(model: Model, removed: Sequence[Effect]) -> Model:
    for effect in removed:
        model = model.without_effect(effect.name, effect.at)
    return model


def _refitted(model: Model, records: Sequence[Experiment]) -> Model:
    free = [p.name for p in model.parameters.values() if p.adjustable]
    if not free:
        return model
    fit = estimate(model, InverseDynamicsProblem(model, records), free)
    return model.with_parameters(dict(zip(free, map(float, fit.values), strict=True)))


def _error(model: Model, records: Sequence[Experiment], integrator: str) -> float:
    """Largest relative error over the channels; infinite where the simulation fails."""
    try:
        data = OutputErrorProblem(model, records, judging_mode(model, records), setup=Setup(integrator))
        residual, _ = data.evaluate(model, model.theta)
    except DivergedError:
        return np.inf
    return max(share for _, share, _ in gaps(data, residual).values())
