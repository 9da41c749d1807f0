"""Steps of a model, timed one by one along commands."""

import warnings
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass

import numpy as np

from vpm.errors import SimulationError, ValidityWarning, refused_as
from vpm.experiment import Experiment
from vpm.initial import initial_state
from vpm.model import Model
from vpm.numbers import Array
from vpm.realtime import Loop
from vpm.simulate import Setup, simulate

#: The command that is repeated when no record is given: samples, and frequencies in Hz.
SWEEP_SAMPLES = 10_000
SWEEP_FREQUENCIES = (0.3, 0.7, 1.9, 4.3)
#: Steps between two words to whoever waits; whole ways through the sweep.
CHUNK = 100_000
#: Why steps are evaluated directly that could be compiled.
NOT_ASKED = "machine code was not asked for"


@dataclass(frozen=True)
class Timed:
    """Timed steps of a simulation: duration of each, stages, and how often they asked for memory."""

    seconds: Array  #: Shape (steps,); duration of each, s.
    allocations: int  #: How often they asked for memory.
    memory: int  #: Bytes that a simulation holds.
    stages: list[tuple[str, float, float]]  #: Name, seconds of one call, calls in a step.
    direct: str  #: Why they were evaluated directly; empty where they ran as machine code.


def time_steps(
    model: Model,
    rate: float,
    setup: Setup,
    steps: int,
    inputs: Array,
    *,
    states: int = 0,
    tell: Callable[[str], None] | None = None,
    priority: int | None = None,
    start: Array | None = None,
    compiled: bool = False,
) -> Timed:
    """Time steps, and at so many ``states`` along the way their stages; with a ``priority`` before ordinary threads.

    If they are to be ``compiled``, they run as machine code where there is any.

    - ``rate``: Hz
    - ``inputs``: shape (N, inputs), repeated as often as needed
    - ``start``: shape (states,), where each way through the inputs starts; by default at rest at zero, once
    """
    method = setup.method(model, bounded=True)
    durations: list[Array] = []
    allocations = memory = done = 0
    direct = None if compiled else NOT_ASKED
    stages: list[tuple[str, float, float]] = []
    chunk = CHUNK if tell else steps
    chunk = chunk if start is None else min(chunk, len(inputs))
    first = model.state() if start is None else start
    while done < steps:
        count = min(chunk, steps - done)
        with refused_as(SimulationError, model.name), _ahead(rate, priority):
            looks = 0 if done else states
            seconds, asked, memory, found, reason = model.core.time_steps(
                model.theta, first, inputs, 1.0 / rate, setup.substeps, method, count, looks, compiled
            )
        durations.append(seconds)
        stages = stages or found
        direct = direct or reason
        allocations += asked
        done += count
        if tell and (start is None or done == steps):
            tell(f"timed {done} of {steps} steps, {1e6 * float(np.median(seconds)):.3g} us each")
    seconds = np.concatenate(durations) if durations else np.empty(0)
    return Timed(seconds, allocations, memory, stages, direct or "")


def _ahead(rate: float, priority: int | None) -> AbstractContextManager[object]:
    """Loop of raised priority, in which steps are timed as a controller runs; does nothing without a priority."""
    return nullcontext() if priority is None else Loop(rate, priority=priority)


def start_state(model: Model, experiment: Experiment | None) -> Array | None:
    """Start state of timed steps: a record's, if contacts or oil make zero impossible."""
    return initial_state(model, experiment, model.theta) if experiment is not None and model.is_abrupt else None


def commands(model: Model, rate: float, experiment: Experiment | None = None) -> Array:
    """Inputs (N, inputs) that drive timed steps of a model.

    - ``rate``: Hz
    - ``experiment``: its commands, or what the model's controllers make of its references, each held until the record's
      next sample; without it a sum of sines
    """
    if experiment is not None:
        # The machine moves as fast as it was measured, whatever the rate of the log.
        count = max(1, round((experiment.duration + experiment.dt) * rate))
        held = np.minimum((np.arange(count) / (rate * experiment.dt) + 1e-6).astype(int), len(experiment.time) - 1)
        columns = [column[held] for column in _driving(model, experiment)]
    else:
        time = np.arange(SWEEP_SAMPLES) / rate
        wave = np.mean([np.sin(2.0 * np.pi * f * time) for f in SWEEP_FREQUENCIES], axis=0)
        columns = [wave for _ in model.actuators]
        columns += [np.full(time.size, model.parameters[name].value) for name in model.inputs[len(columns) :]]
    return np.ascontiguousarray(np.column_stack(columns)) if columns else np.zeros((1, 0))


def _driving(model: Model, experiment: Experiment) -> list[Array]:
    """Commands of a record for timed steps; where controllers give them, along its references."""
    missing = [name for name in model.input_channels if name not in experiment]
    if not missing or not model.controlled_actuators:
        return [experiment[name] for name in model.input_channels]
    with warnings.catch_warnings():
        # The commands alone are asked for, which the place of a tip does not change.
        warnings.simplefilter("ignore", ValidityWarning)
        run = simulate(model, experiment, "closed_loop")
    return [run[name] if name in missing else experiment[name] for name in model.input_channels]
