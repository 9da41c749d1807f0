"""Simulation of a log in four modes, each with its own question.

===================  =====================================================================================
free_run             Given the measured commands, where does the machine go?
inverse_dynamics     Given the measured motion, what effort did it take?
restarts             As free run, begun afresh from the measured state every horizon: for machines that
                     integrate or are unstable, whose free run drifts away for any error however small.
closed_loop          Given the references, what do controller and machine do together?
===================  =====================================================================================
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vpm.errors import DivergedError, ExperimentError, SimulationError
from vpm.experiment import Experiment, motion, parallel_filter
from vpm.initial import initial_state as start
from vpm.initial import measured_states
from vpm.model import Model
from vpm.results import Result

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

MODES = ("free_run", "inverse_dynamics", "restarts", "closed_loop")
INTEGRATORS = ("linearly_implicit", "rk4", "semi_implicit")


@dataclass(frozen=True)
class Setup:
    """How a simulation steps.

    Attributes
    ----------
    integrator : {"linearly_implicit", "rk4", "semi_implicit"}
        The first is stable whatever the stiffness of a friction law; the others are explicit.
    substeps : int
        Integration steps per sample of the log.
    horizon : float
        Length of each restart, s.
    """

    integrator: str = "linearly_implicit"
    substeps: int = 1
    horizon: float = 0.25

    def __post_init__(self) -> None:
        """Check the choices."""
        if self.integrator not in INTEGRATORS:
            raise SimulationError(f"unknown integrator '{self.integrator}'; choose one of {', '.join(INTEGRATORS)}")
        if self.substeps < 1:
            raise SimulationError(f"substeps is {self.substeps}; give a whole number of at least 1")
        if not self.horizon > 0.0:
            raise SimulationError(f"horizon is {self.horizon} s; give a positive time")


@dataclass(frozen=True, repr=False, eq=False)
class Run(Result):
    """What a simulation gave.

    Attributes
    ----------
    model_name, experiment_name, mode : str
    time : ndarray, shape (N,)
        s. In restarts the pieces follow each other.
    channels, units : tuple of str
    values : ndarray, shape (N, C)
        Simulated channels.
    measured : ndarray, shape (N, C)
        The log's counterpart on the same samples; NaN where a channel was not measured.
    starts : ndarray of int
        Rows at which a piece begins.
    settings : dict
        Integrator, substeps, horizon, cut-off.
    """

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

    def __getitem__(self, channel: str) -> Array:
        """Simulated values of one channel, shape (N,)."""
        if channel not in self.channels:
            raise SimulationError(f"the run has no channel '{channel}'; it has {', '.join(self.channels)}")
        return self.values[:, self.channels.index(channel)]

    def _headline(self) -> Mapping[str, object]:
        return {
            "model": self.model_name,
            "experiment": self.experiment_name,
            "mode": self.mode,
            "samples": self.time.size,
            "channels": ", ".join(self.channels),
        }

    def _frame_columns(self) -> Mapping[str, object]:
        return {"time": self.time, **dict(zip(self.channels, self.values.T, strict=True))}

    def plot(self) -> Figure:
        """Simulated over measured, a panel per channel. Needs the extra ``plot``."""
        from vpm.plot import plot_run

        return plot_run(self)


@dataclass(frozen=True)
class SimulatedArrays:
    """Outputs (n, outputs), their derivative (n, outputs, columns) and the rows of the log they stand for."""

    outputs: Array
    jacobian: Array
    rows: NDArray[np.int64]
    starts: NDArray[np.int64]


def judging_mode(model: Model, records: Sequence[Experiment]) -> str:
    """Mode in which a simulation of these records says most: closed loop where controllers and references are known.

    Elsewhere restarts, which need no more than position and command.
    """
    controlled = all(name in model.controlled_actuators for name in model.actuators)
    known = all(f"{name}.reference" in record for name in model.actuators for record in records)
    return "closed_loop" if model.actuators and controlled and known else "restarts"


def simulate(
    model: Model,
    experiment: Experiment,
    mode: str = "free_run",
    *,
    integrator: str = "linearly_implicit",
    substeps: int = 1,
    horizon: float = 0.25,
    cutoff: float | None = None,
    initial_state: Array | None = None,
) -> Run:
    """Simulate ``model`` on the inputs of ``experiment``.

    Parameters
    ----------
    model : Model
    experiment : Experiment
        Holds the commands (free run, restarts), the motion (inverse dynamics) or the references (closed loop).
    mode : {"free_run", "inverse_dynamics", "restarts", "closed_loop"}
    integrator, substeps, horizon
        See :class:`Setup`.
    cutoff : float, optional
        Cut-off frequency of the motion filter, Hz (inverse dynamics and initial velocities).
    initial_state : ndarray, shape (states,), optional
        By default estimated from the first samples of the measured positions; at rest at zero without them.

    Returns
    -------
    Run

    Raises
    ------
    SimulationError, ExperimentError
        A setting is wrong or a channel that the mode needs is missing.
    DivergedError
        The state left the finite numbers; carries the run up to there.
    """
    if mode == "inverse_dynamics":
        return _inverse_dynamics_run(model, experiment, cutoff)
    setup = Setup(integrator, substeps, horizon)
    arrays = simulate_arrays(model, experiment, mode, setup=setup, cutoff=cutoff, initial_state=initial_state)
    return _run(model, experiment, mode, arrays, setup)


def simulate_arrays(
    model: Model,
    experiment: Experiment,
    mode: str,
    *,
    theta: Array | None = None,
    columns: Sequence[int] = (),
    setup: Setup | None = None,
    cutoff: float | None = None,
    initial_state: Array | None = None,
) -> SimulatedArrays:
    """Outputs of a simulation and their exact derivative by parameters ``columns``, as plain arrays."""
    from vpm._core import Diverged

    setup = setup or Setup()
    theta = model.theta if theta is None else theta
    try:
        return _dispatch(model, experiment, mode, theta, list(columns), setup, cutoff, initial_state)
    except Diverged as error:
        partial = SimulatedArrays(
            error.outputs, np.zeros((*error.outputs.shape, 0)), np.arange(len(error.outputs)), np.zeros(1, np.int64)
        )
        raise DivergedError(str(error), run=_run(model, experiment, mode, partial, setup)) from None


def _dispatch(
    model: Model,
    experiment: Experiment,
    mode: str,
    theta: Array,
    columns: list[int],
    setup: Setup,
    cutoff: float | None,
    initial_state: Array | None,
) -> SimulatedArrays:
    rows = np.arange(len(experiment))
    begin = np.zeros(1, dtype=np.int64)
    stepping = (experiment.dt, setup.substeps, setup.integrator, columns)
    if mode == "free_run":
        inputs = _columns(experiment, [f"{name}.command" for name in model.actuators], mode)
        state = start(model, experiment, theta) if initial_state is None else initial_state
        outputs, _, jacobian = model.core.simulate(theta, state, inputs, *stepping)
        return SimulatedArrays(outputs, jacobian, rows, begin)
    if mode == "closed_loop":
        _check_controllers(model)
        references = _columns(experiment, [f"{name}.reference" for name in model.actuators], mode)
        disturbances = _optional(experiment, [f"{name}.disturbance" for name in model.actuators])
        state = start(model, experiment, theta) if initial_state is None else initial_state
        outputs, _, jacobian = model.core.simulate_closed_loop(theta, state, references, disturbances, *stepping)
        return SimulatedArrays(outputs, jacobian, rows, begin)
    if mode == "restarts":
        inputs = _columns(experiment, [f"{name}.command" for name in model.actuators], mode)
        starts, length = _restart_grid(experiment, setup.horizon)
        states = measured_states(model, experiment, theta, cutoff)[starts]
        outputs, jacobian = model.core.restart(theta, states, starts, length, inputs, *stepping)
        rows = (starts[:, None] + np.arange(length)).ravel()
        flat = outputs.reshape(-1, outputs.shape[-1])
        return SimulatedArrays(flat, jacobian.reshape(len(flat), flat.shape[1], -1), rows, starts)
    raise SimulationError(f"unknown mode '{mode}'; choose one of {', '.join(MODES)}")


def _run(model: Model, experiment: Experiment, mode: str, arrays: SimulatedArrays, setup: Setup) -> Run:
    channels = model.output_channels
    measured = np.full(arrays.outputs.shape, np.nan)
    for column, channel in enumerate(channels):
        if channel in experiment:
            measured[:, column] = experiment[channel][arrays.rows]
    length = len(arrays.rows) // len(arrays.starts) if arrays.starts.size else 0
    settings: dict[str, float | int | str] = {"integrator": setup.integrator, "substeps": setup.substeps}
    if mode == "restarts":
        settings["horizon"] = setup.horizon
    return Run(
        model.name,
        experiment.name,
        mode,
        experiment.time[arrays.rows],
        channels,
        tuple(model.channel_unit(channel) for channel in channels),
        arrays.outputs,
        measured,
        np.arange(len(arrays.starts), dtype=np.int64) * length,
        settings,
    )


def _inverse_dynamics_run(model: Model, experiment: Experiment, cutoff: float | None) -> Run:
    m = motion(experiment, model, cutoff=cutoff)
    required, applied, _ = model.core.inverse_dynamics(
        model.theta, m.position, m.velocity, m.acceleration, m.inputs, m.dt, []
    )
    keep = slice(m.edge, len(m.time) - m.edge)
    channels = tuple(f"{joint}.effort" for joint in model.joints)
    return Run(
        model.name,
        experiment.name,
        "inverse_dynamics",
        m.time[keep][:: m.decimation],
        channels,
        tuple(model.channel_unit(channel) for channel in channels),
        parallel_filter(required[keep], m.decimation),
        parallel_filter(applied[keep], m.decimation),
        settings={"cutoff": m.cutoff, "decimation": m.decimation},
    )


def _columns(experiment: Experiment, channels: Sequence[str], mode: str) -> Array:
    missing = [channel for channel in channels if channel not in experiment]
    if missing:
        raise ExperimentError(
            f"{experiment.name}: mode '{mode}' needs channel '{missing[0]}', but the log holds "
            f"{', '.join(experiment.channels)}; map a column to it in the channel table"
        )
    return np.ascontiguousarray(np.column_stack([experiment[channel] for channel in channels]))


def _optional(experiment: Experiment, channels: Sequence[str]) -> Array:
    zero = np.zeros(len(experiment))
    known = {channel: experiment[channel] for channel in channels if channel in experiment}
    return np.ascontiguousarray(np.column_stack([known.get(channel, zero) for channel in channels]))


def _check_controllers(model: Model) -> None:
    idle = [name for name in model.actuators if name not in model.controlled_actuators]
    if idle:
        raise SimulationError(
            f"mode 'closed_loop' needs a controller for actuator '{idle[0]}', but the model has none; "
            "add one under [controllers] or use free_run or restarts"
        )


def _restart_grid(experiment: Experiment, horizon: float) -> tuple[NDArray[np.int64], int]:
    length = max(2, round(horizon / experiment.dt) + 1)
    if length > len(experiment):
        raise SimulationError(
            f"horizon {horizon} s is longer than the log {experiment.name} of {len(experiment) * experiment.dt:.3g} s; "
            "choose a shorter one"
        )
    return np.arange(0, len(experiment) - length + 1, length - 1, dtype=np.int64), length
