"""Does one step of a model fit into the period of a controller? Measured, not estimated."""

from __future__ import annotations

import os
import platform
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vpm.errors import SimulationError
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.results import Result
from vpm.simulate import AUTOMATIC, Setup, simulate

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

QUANTILES = {"p50": 0.5, "p99": 0.99, "p99.9": 0.999, "p99.99": 0.9999, "max": 1.0}
#: The command that is repeated when no record is given: samples, and frequencies in Hz.
SWEEP_SAMPLES = 10_000
SWEEP_FREQUENCIES = (0.3, 0.7, 1.9, 4.3)


@dataclass(frozen=True, repr=False, eq=False)
class BudgetReport(Result):
    """Distribution of the time of one step against the period.

    Attributes
    ----------
    model_name, integrator : str
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
    machine : str
    """

    model_name: str
    integrator: str
    rate: float
    steps: int
    quantiles: dict[str, float]
    share: float
    overruns: int
    machine: str

    @property
    def taken(self) -> float:
        """Share of the period that a step takes at its 99.9 % quantile."""
        return self.quantiles["p99.9"] * self.rate

    @property
    def holds(self) -> bool:
        """Whether that share is within the allowed one."""
        return self.taken <= self.share

    def __str__(self) -> str:
        """A few lines for the terminal."""
        times = "  ".join(f"{name} {1e6 * value:.3g} us" for name, value in self.quantiles.items())
        verdict = "holds" if self.holds else "does not hold"
        return (
            f"{self.model_name}, {self.integrator}, {self.steps} steps at {self.rate:g} Hz on {self.machine}\n"
            f"  {times}\n"
            f"  the budget {verdict}: {100 * self.taken:.3g} % of the period at p99.9, {100 * self.share:g} % allowed; "
            f"{self.overruns} steps were longer than the period\n"
            "  computing time only: a shared machine proves that a step is short, not that it is never late"
        )

    def _headline(self) -> Mapping[str, object]:
        return {"model": self.model_name, "rate": self.rate, "taken": self.taken, "holds": self.holds}

    def _frame_columns(self) -> Mapping[str, object]:
        return {"quantile": list(self.quantiles), "seconds": list(self.quantiles.values())}

    def plot(self) -> Figure:
        """Quantiles against the period. Needs the extra ``plot``."""
        from vpm.plot import plot_step_cost

        return plot_step_cost(self.quantiles, 1.0 / self.rate)


def budget(
    model: Model,
    *,
    rate: float = 1000.0,
    share: float = 0.2,
    steps: int = 1_000_000,
    integrator: str = AUTOMATIC,
    substeps: int = 1,
    experiment: Experiment | None = None,
) -> BudgetReport:
    """Time single steps of a model along a command.

    Parameters
    ----------
    model : Model
    rate : float
        Steps per second that the controller asks for, Hz.
    share : float
        Share of the period that a step may take at its 99.9 % quantile.
    steps : int
        How many steps to time.
    integrator, substeps
        See :class:`vpm.simulate.Setup`; ``auto`` takes steps whose time has a bound.
    experiment : Experiment, optional
        Its commands drive the model, over and over; without it a sum of sines at one unit of command does.

    Returns
    -------
    BudgetReport
    """
    if not rate > 0.0:
        raise SimulationError(f"a rate of {rate:g} Hz is not possible; give a positive number")
    if steps < 1000:
        raise SimulationError(f"{steps} steps are too few for a 99.9 % quantile; time at least 1000")
    setup = Setup(integrator, substeps)
    method = setup.method(model, bounded=True)
    seconds = step_times(model, rate, setup, steps, commands(model, rate, experiment))
    quantiles = {name: float(np.quantile(seconds, q)) for name, q in QUANTILES.items()}
    overruns = int(np.count_nonzero(seconds > 1.0 / rate))
    return BudgetReport(model.name, method, rate, steps, quantiles, share, overruns, _machine())


def step_times(model: Model, rate: float, setup: Setup, steps: int, inputs: Array) -> Array:
    """Duration of each step, s.

    Parameters
    ----------
    model : Model
    rate : float
        Hz.
    setup : Setup
    steps : int
    inputs : ndarray, shape (N, inputs)
        Repeated as often as needed.

    Raises
    ------
    SimulationError
        The commands do not lead through a simulation in these steps.
    """
    from vpm._core import Diverged

    method = setup.method(model, bounded=True)
    try:
        return model.core.time_steps(model.theta, model.state(), inputs, 1.0 / rate, setup.substeps, method, steps)
    except (Diverged, ValueError) as error:
        raise SimulationError(f"{model.name}: {error}") from error


def commands(model: Model, rate: float, experiment: Experiment | None = None) -> Array:
    """Inputs (N, inputs) that drive a model while it is timed.

    Parameters
    ----------
    model : Model
    rate : float
        Hz.
    experiment : Experiment, optional
        Its commands, or what the model's controllers make of its references; without it a sum of sines.
    """
    if experiment is not None:
        columns = _driving(model, experiment)
    else:
        time = np.arange(SWEEP_SAMPLES) / rate
        wave = np.mean([np.sin(2.0 * np.pi * f * time) for f in SWEEP_FREQUENCIES], axis=0)
        columns = [wave for _ in model.actuators]
        columns += [np.full(time.size, model.parameters[name].value) for name in model.inputs[len(columns) :]]
    return np.ascontiguousarray(np.column_stack(columns)) if columns else np.zeros((1, 0))


def _driving(model: Model, experiment: Experiment) -> list[Array]:
    """Commands of a record; where controllers give them, what these say along its references."""
    missing = [name for name in model.input_channels if name not in experiment]
    if not missing or not model.controlled_actuators:
        return [experiment[name] for name in model.input_channels]
    run = simulate(model, experiment, "closed_loop")
    return [run[name] if name in missing else experiment[name] for name in model.input_channels]


def _machine() -> str:
    return f"{platform.machine()} with {os.cpu_count()} cores, {platform.system()}"
