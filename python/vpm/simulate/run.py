"""What a simulation gives: a run beside its log, or plain arrays."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vpm.errors import SimulationError, ValidityWarning
from vpm.experiment import Experiment
from vpm.initial import passive_joints
from vpm.model import Model
from vpm.numbers import Array
from vpm.results import Result
from vpm.simulate.inputs import uncontrolled
from vpm.simulate.resolution import Resolution
from vpm.simulate.setup import HOLDS, Setup

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, repr=False, eq=False)
class Run(Result):
    """Simulated channels over time, with the log's counterpart.

    Attributes
    ----------
    time : ndarray, shape (N,)
        s. In restarts the pieces follow each other.
    values : ndarray, shape (N, C)
        Simulated channels.
    measured : ndarray, shape (N, C)
        The log's counterpart on the same samples; NaN where a channel was not measured.
    starts : ndarray of int
        Rows at which a piece begins.
    settings : dict
        Integrator, substeps, horizon, hold, cut-off.
    notes : tuple of str
        What to know before the numbers are trusted: one sentence each, none as a rule.
    resolution : Resolution or None
        What the steps do not resolve, worked out when somebody looks; None where no run goes
        through (restarts, inverse dynamics, prescribed motion, what diverged).
    coordinates : ndarray, shape (N, n), or None
        Positions of the joints, then coordinates of the flexible links, as in ``model.coordinates``; None where no run
        goes through (restarts, inverse dynamics, what diverged).
    """

    _samples = ("time", "values", "measured", "starts")

    model_name: str
    experiment_name: str
    mode: str
    time: Array
    channels: tuple[str, ...]
    units: tuple[str, ...]
    values: Array
    measured: Array
    starts: NDArray[np.int64] = field(default_factory=lambda: np.zeros(1, dtype=np.int64))
    settings: dict[str, float | int | str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    resolution: Resolution | None = None
    coordinates: Array | None = None

    def __getitem__(self, channel: str) -> Array:
        """Simulated values of one channel of a run, shape (N,)."""
        if channel not in self.channels:
            raise SimulationError(f"the run has no channel '{channel}'; it has {', '.join(self.channels)}")
        return self.values[:, self.channels.index(channel)]

    @property
    def messages(self) -> tuple[str, ...]:
        """Messages of a run: `notes`, and what the steps do not resolve."""
        steps = self.resolution
        return self.notes if steps is None or steps.is_complete else (*self.notes, str(steps))

    def _headline(self) -> Mapping[str, object]:
        return {
            "model": self.model_name,
            "experiment": self.experiment_name,
            "mode": self.mode,
            "samples": self.time.size,
            "channels": ", ".join(self.channels),
            **({} if self.resolution is None else {"steps": str(self.resolution)}),
        }

    def _frame_columns(self) -> Mapping[str, object]:
        return {"time": self.time, **dict(zip(self.channels, self.values.T, strict=True))}

    def plot(self) -> Figure:
        """Plot a run: simulated over measured, a panel per channel. Needs the extra ``plot``."""
        from vpm.plot import plot_run

        return plot_run(self)


@dataclass(frozen=True)
class SimulatedArrays:
    """Outputs (n, outputs), their derivative (n, outputs, columns) and the rows of the log they stand for.

    States (n, states) are there but for restarts.
    """

    outputs: Array
    jacobian: Array
    rows: NDArray[np.int64]
    starts: NDArray[np.int64]
    states: Array | None = None


def copied_channels(model: Model, mode: str, passive: Sequence[str] = ()) -> frozenset[str]:
    """Channels of a run that a mode takes from the log, with nothing to compare.

    The motion of ``passive`` joints is worked out.
    """
    logged = {f"{name}.pressure" for name in model.logged_supplies}
    if mode == "closed_loop":
        return frozenset(logged | {f"{name}.command" for name in uncontrolled(model)})
    commands = {f"{name}.command" for name in model.actuators} | logged
    if mode == "prescribed_motion":
        followed = [name for name in model.joints if name not in passive]
        motions = {f"{name}.{kind}" for name in followed for kind in ("position", "velocity", "acceleration")}
        resting = {*model.actuators, *model.supplies}
        return frozenset(motions | {name for name in model.output_channels if name.partition(".")[0] in resting})
    return frozenset(commands)


def run_of(model: Model, experiment: Experiment, mode: str, arrays: SimulatedArrays, setup: Setup) -> Run:
    """Run from the channels that a mode computes, beside the log's on the same rows."""
    guided = mode == "prescribed_motion"
    passive = passive_joints(experiment, model) if guided else ()
    left_out = copied_channels(model, mode, passive) if guided else frozenset()
    kept = [column for column, channel in enumerate(model.output_channels) if channel not in left_out]
    channels = tuple(model.output_channels[column] for column in kept)
    values = arrays.outputs[:, kept]
    measured = np.full(values.shape, np.nan)
    for column, channel in enumerate(channels):
        if channel in experiment:
            measured[:, column] = experiment[channel][arrays.rows]
    length = len(arrays.rows) // len(arrays.starts) if arrays.starts.size else 0
    settings: dict[str, float | int | str] = {
        "integrator": setup.method(model, guided=guided),
        "substeps": setup.substeps,
    }
    if mode == "restarts":
        settings["horizon"] = setup.horizon
    if setup.course != HOLDS[0]:
        settings["hold"] = setup.course
    return Run(
        model.name,
        experiment.name,
        mode,
        experiment.time[arrays.rows],
        channels,
        tuple(model.channel_unit(channel) for channel in channels),
        values,
        measured,
        np.arange(len(arrays.starts), dtype=np.int64) * length,
        settings,
        model.beyond_tables(experiment.time[arrays.rows], dict(zip(channels, values.T, strict=True))),
        coordinates=None if arrays.states is None else np.array(arrays.states[:, : len(model.coordinates)]),
    )


def judged(model: Model, run: Run, states: Array) -> Run:
    """The run with a note, and one warning, if a flexible link left the range in which its kinematics are right.

    ``states``, shape (N, nx), are those of the run's rows.
    """
    if not model.beams or len(states) == 0:
        return run
    slopes = model.core.slopes(model.theta, states)
    limits = model.slope_limits
    largest = np.max(np.where(np.isnan(slopes), 0.0, slopes), axis=0)
    if not np.any(largest > limits):
        return run
    beam = int(np.argmax(largest / limits))
    when = float(run.time[int(np.nanargmax(slopes[:, beam]))])
    name = model.beams[beam]
    warning = ValidityWarning(
        name,
        float(largest[beam]),
        when,
        float(limits[beam]),
        model.levels[name],
        second_order=name not in model.first_order_beams,
    )
    warnings.warn(warning, stacklevel=3)
    return replace(run, notes=(*run.notes, str(warning)))
