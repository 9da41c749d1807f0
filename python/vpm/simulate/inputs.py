"""What the log holds for a simulation: commands, references, disturbances, pieces of a horizon."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vpm.errors import ExperimentError, SimulationError
from vpm.experiment import Experiment
from vpm.experiment.motion import running_on
from vpm.model import Model
from vpm.numbers import Array
from vpm.simulate.setup import AUTOMATIC, Setup


def held_inputs(model: Model, experiment: Experiment, mode: str, setup: Setup) -> Array:
    """Commands and pressures of logged supplies, one column each; springs without a command keep their length.

    The end of a spring cannot jump. Where nobody says what is held, its length is the mean until the next sample.
    """
    _require(experiment, [name for name in model.input_channels if name not in model.optional_inputs], mode)
    table = _optional(experiment, model.input_channels)
    return running_on(table, lengths_of(model, setup.hold))


def simulation_inputs(model: Model, experiment: Experiment, setup: Setup) -> Array:
    """What a free run holds between samples, shape (N, inputs): commands and pressures of logged supplies."""
    return held_inputs(model, experiment, "free_run", setup)


def lengths_of(model: Model, hold: str) -> list[int]:
    """Inputs that a hold leaves to run on from sample to sample: lengths added to springs, with ``auto`` alone."""
    return [
        place for place, name in enumerate(model.input_channels) if hold == AUTOMATIC and name in model.optional_inputs
    ]


def references_of(model: Model, experiment: Experiment, mode: str) -> tuple[Array, Array]:
    """References and disturbances, one column per input; pressures of logged supplies are disturbances.

    So are commands of actuators that no controller commands: there they are all that comes.
    """
    held, free = list(model.controlled_actuators), uncontrolled(model)
    logged = [f"{name}.pressure" for name in model.logged_supplies]
    needed = [f"{name}.command" for name in free if f"{name}.command" not in model.optional_inputs]
    _require(experiment, [f"{name}.reference" for name in held] + needed + logged, mode)
    references = _optional(experiment, [f"{name}.reference" for name in model.inputs])
    disturbances = _optional(experiment, [*(f"{name}.disturbance" for name in model.actuators), *logged])
    commands = _optional(experiment, [f"{name}.command" for name in free])
    disturbances[:, [model.actuators.index(name) for name in free]] += commands
    return references, disturbances


def restart_grid(experiment: Experiment, horizon: float) -> tuple[NDArray[np.int64], int]:
    """Rows of the inputs at which pieces of a horizon (s) begin, and the samples of each."""
    length = max(2, round(horizon / experiment.dt) + 1)
    if length > len(experiment):
        raise SimulationError(
            f"horizon {horizon} s is longer than the log {experiment.name} of {len(experiment) * experiment.dt:.3g} s; "
            "choose a shorter one"
        )
    return np.arange(0, len(experiment) - length + 1, length - 1, dtype=np.int64), length


def uncontrolled(model: Model) -> list[str]:
    """Actuators without a controller, whose inputs the log gives."""
    return [name for name in model.actuators if name not in model.controlled_actuators]


def check_controllers(model: Model) -> None:
    """Refuse a model without a controller for inputs by references."""
    if not model.controlled_actuators:
        idle = f"for actuator '{model.actuators[0]}'" if model.actuators else "and an actuator"
        raise SimulationError(
            f"mode 'closed_loop' needs a controller {idle}, but the model has none; "
            "add one under [controllers] or use free_run or restarts"
        )


def _require(experiment: Experiment, channels: Sequence[str], mode: str) -> None:
    """Refuse a log without an input channel that a mode needs."""
    missing = [channel for channel in channels if channel not in experiment]
    if missing:
        raise ExperimentError(
            f"{experiment.name}: mode '{mode}' needs channel '{missing[0]}', but the log holds "
            f"{', '.join(experiment.channels)}; map a column to it in the channel table"
        )


def _optional(experiment: Experiment, channels: Sequence[str]) -> Array:
    """Input columns of a log, zero where it does not hold one."""
    table = np.zeros((len(experiment), len(channels)))
    for column, channel in enumerate(channels):
        if channel in experiment:
            table[:, column] = experiment[channel]
    return table
