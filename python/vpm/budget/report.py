"""What a budget says: how long steps take, what their time goes into, and whether they fit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from vpm.results import Result, Storable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: What is no stage of its own: the integrator's algebra, recording, and memory that is no longer warm.
REST = "integrator and rest"


@dataclass(frozen=True, eq=False)
class Stage(Storable):
    """One part of a step.

    Attributes
    ----------
    seconds : float
        In one step, s.
    calls : float
        Calls in one step.
    """

    name: str
    seconds: float
    calls: float


@dataclass(frozen=True, repr=False, eq=False)
class BudgetReport(Result):
    """Distribution of the time of one step against the period.

    Attributes
    ----------
    rate : float
        Hz.
    steps : int
        Steps timed, one by one.
    quantiles : dict of str to float
        Seconds at p50, p99, p99.9, p99.99 and the largest.
    share : float
        Share of the period that the 99.9 % quantile may take.
    overruns : int
        Steps longer than the period.
    stages : tuple of Stage
        What a step does, each part timed apart at states along the way, warm and at its fastest; last the difference to
        the median step.
    allocations : int
        How often the timed steps asked for memory; a step that does can take any time.
    memory : int
        Bytes that a simulation of the model holds.
    instructions : float or None
        Machine instructions of a step, counted by valgrind; None where they were not counted.
    latency : dict of str to float
        Time from a deadline to the wake-up of a periodic loop without work, s: the machine's part, in none of the other
        figures. Empty where it was not measured.
    direct : str
        Why the steps were evaluated directly; empty where they ran as machine code.
    """

    model_name: str
    integrator: str
    rate: float
    steps: int
    quantiles: dict[str, float]
    share: float
    overruns: int
    stages: tuple[Stage, ...]
    allocations: int
    memory: int
    instructions: float | None
    latency: dict[str, float]
    machine: str
    direct: str = ""

    @property
    def taken(self) -> float:
        """Reported share of the period that a step takes at its 99.9 % quantile."""
        return self.quantiles["p99.9"] * self.rate

    @property
    def holds(self) -> bool:
        """Whether the reported budget holds: steps are short enough, and none asks for memory."""
        return self.taken <= self.share and self.allocations == 0

    @property
    def largest(self) -> Stage:
        """Largest stage of a step in the report."""
        return max(self.stages, key=lambda stage: stage.seconds)

    @property
    def verdict(self) -> str:
        """Verdict of the report: whether the budget holds, or what breaks it."""
        taken = f"{100 * self.taken:.3g} % of the period at p99.9, {100 * self.share:g} % allowed"
        if self.allocations:
            return f"the budget does not hold: the steps asked for memory {self.allocations} times ({taken})"
        if self.holds:
            return f"the budget holds: {taken}"
        most = self.largest
        part = 100 * most.seconds / max(sum(stage.seconds for stage in self.stages), 1e-300)
        return f"the budget does not hold: {taken}; most of a step, {part:.0f} %, is: {most.name}"

    def __str__(self) -> str:
        """Text of the report, a few lines for the terminal."""
        lines = [
            f"{self.model_name}, {self.integrator}, {self.steps} steps at {self.rate:g} Hz on {self.machine}",
            f"  {_times(self.quantiles)}; {self.overruns} steps were longer than the period",
            f"  {self.verdict}",
            f"  stages of a step: {', '.join(f'{stage.name} {_time(stage.seconds)}' for stage in self.stages)}",
            f"  {self._resources}",
            f"  evaluated {f'directly: {self.direct}' if self.direct else 'as machine code'}",
        ]
        if self.latency:
            lines.append(f"  wake-up of a loop at this rate, apart from all the above: {_times(self.latency)}")
        lines.append(
            "  computing time only: on a machine that others share it proves that a step is short, not that it is "
            "never late; for that, run on the controller's own machine and kernel"
        )
        return "\n".join(lines)

    @property
    def _resources(self) -> str:
        asked = "nothing" if self.allocations == 0 else f"{self.allocations} times"
        counted = "" if self.instructions is None else f"; {self.instructions:.0f} instructions a step"
        return f"memory: {self.memory / 1024:.0f} kB held, {asked} asked for while stepping{counted}"

    def _headline(self) -> Mapping[str, object]:
        return {"model": self.model_name, "rate": self.rate, "taken": self.taken, "holds": self.holds}

    def _frame_columns(self) -> Mapping[str, object]:
        return {"quantile": list(self.quantiles), "seconds": list(self.quantiles.values())}

    def plot(self) -> Figure:
        """Plot the report: quantiles against the period. Needs the extra ``plot``."""
        from vpm.plot import plot_step_cost

        return plot_step_cost(self.quantiles, 1.0 / self.rate)


def _times(quantiles: Mapping[str, float]) -> str:
    return "  ".join(f"{name} {_time(value)}" for name, value in quantiles.items())


def _time(seconds: float) -> str:
    return f"{1e6 * seconds:.3g} us" if seconds < 1e-3 else f"{1e3 * seconds:.3g} ms"
