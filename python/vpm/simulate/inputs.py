"""What the log holds for a simulation: commands, references, disturbances, pieces of a horizon."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from vpm.errors import ExperimentError, SimulationError
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.numbers import Array
from vpm.simulate.setup import AUTOMATIC, Setup


def held_inputs(model: Model, experiment: Experiment, mode: str) -> Array:
    """Commands and pressures of logged supplies, one column each; springs without a command keep their length."""
    _require(experiment, [name for name in model.input_channels if name not in model.optional_inputs], mode)
    return _optional(experiment, model.input_channels)


def simulation_inputs(model: Model, experiment: Experiment) -> Array:
    """What a free run holds between samples, shape (N, inputs): commands and pressures of logged supplies."""
    return held_inputs(model, experiment, "free_run")


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


def with_running_lengths(
    model: Model, experiments: Sequence[Experiment], setup: Setup
) -> tuple[list[Experiment], Setup]:
    """Records and setup with lengths that move springs run on from sample to sample, beside commands that are held.

    The end of a spring cannot jump. Where logs hold its length and nobody says what is held, all inputs run on, and
    commands of controllers do so half a sample later, as held ones come. Where no log does, nothing changes.
    """
    lengths = [name for name in model.input_channels if name in model.optional_inputs]
    logged = any(np.ptp(record[name]) > 0.0 for record in experiments for name in lengths if name in record)
    if not logged or setup.hold != AUTOMATIC or model.controlled_actuators:
        return list(experiments), setup
    held = [f"{name}.command" for name in model.actuators if f"{name}.command" not in lengths]
    later = list(experiments)
    for name in held:
        for place, record in enumerate(later):
            if name in record:
                means = 0.5 * (record[name] + np.append(record[name][:1], record[name][:-1]))
                later[place] = record.with_channel(name, means, record.unit(name))
    return later, replace(setup, hold="first_order")


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
