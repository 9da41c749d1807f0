"""Simulation of a log in five modes, each with its own question.

===================  =====================================================================================
free_run             Given the measured commands, where does the machine go?
inverse_dynamics     Given the measured motion, what effort did it take?
restarts             As free run, begun afresh from the measured state every horizon: for machines that
                     integrate or are unstable, whose free run drifts away for any error however small.
closed_loop          Given the references, what do controller and machine do together?
prescribed_motion    Given the measured motion of the joints, how do the flexible links respond: which strains,
                     which efforts? The counterpart of inverse dynamics for machines with elastic coordinates.
                     A joint without an actuator whose position the log does not hold is passive: it moves freely
                     with its effects, from its rest under gravity.
===================  =====================================================================================
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vpm.errors import DivergedError, ExperimentError, SimulationError, ValidityWarning, VpmError
from vpm.experiment import Experiment, Motion
from vpm.initial import initial_state as start
from vpm.initial import joint_motion, measured_states, passive_joints, whole_motion
from vpm.model import Model
from vpm.results import Result, Storable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

MODES = ("free_run", "inverse_dynamics", "restarts", "closed_loop", "prescribed_motion")
#: Integrators of fixed steps, whose work is bounded.
FIXED_STEP = ("linearly_implicit", "rosenbrock", "rk4", "semi_implicit")
#: Chooses by what a machine contains.
AUTOMATIC = "auto"
INTEGRATORS = (AUTOMATIC, *FIXED_STEP, "guarded", "adaptive")


@dataclass(frozen=True)
class Setup(Storable):
    """How a simulation steps.

    Attributes
    ----------
    integrator : {"auto", "linearly_implicit", "rosenbrock", "rk4", "semi_implicit", "guarded", "adaptive"}
        Or, with a tolerance, ``"adaptive(1e-8)"``.
        ``auto`` is ``adaptive`` for machines with contacts or hydraulic drives, which impacts and oil make abrupt, and
        ``linearly_implicit`` for all others. The next two are stable whatever is stiff, of order 2 and 4; the first of
        them also stops on dry friction far sharper than a step. Then come two that are explicit, but for the constant
        stiffness of flexible links in the second.
        ``adaptive`` takes as many steps of ``rosenbrock`` as keep the error of each within a tolerance, 1e-6 or the
        one in brackets, relative to each state and its natural size: for impacts, oil and other things that change
        between microseconds and seconds. Its time is not bounded. ``guarded`` is its counterpart for real time: one
        step of ``rosenbrock``, or up to 16 where an impact or a jump makes its error larger than 1 %.
    substeps : int
        Integration steps per sample of the log; with ``adaptive`` and ``guarded`` pieces of a sample that take one
        step at least.
    horizon : float
        Length of each restart, s.
    settling : float
        Time at the beginning of each record, s, that a fit simulates but does not compare: until what nobody knows of
        the first state, such as vibrations, has died away. Restarts have none.
    """

    integrator: str = AUTOMATIC
    substeps: int = 1
    horizon: float = 0.25
    settling: float = 0.0

    def __post_init__(self) -> None:
        """Check the choices."""
        _check_integrator(self.integrator)
        if self.substeps < 1:
            raise SimulationError(f"substeps is {self.substeps}; give a whole number of at least 1")
        if not self.horizon > 0.0:
            raise SimulationError(f"horizon is {self.horizon} s; give a positive time")
        if not self.settling >= 0.0:
            raise SimulationError(f"settling is {self.settling} s; give a time that is not negative")

    def method(self, model: Model, *, bounded: bool = False) -> str:
        """Integrator for a model, as the core names it.

        Parameters
        ----------
        model : Model
        bounded : bool
            Where ``auto`` would step adaptively, take ``guarded``, whose time has a bound.
        """
        if self.integrator != AUTOMATIC:
            return self.integrator
        if not model.is_abrupt:
            return "linearly_implicit"
        return "guarded" if bounded else "adaptive"


def _check_integrator(name: str) -> None:
    """Complain about a name that is none, or a tolerance that means nothing.

    Raises
    ------
    SimulationError
    """
    from vpm._core import check_integrator

    if name in INTEGRATORS:
        return
    if not name.startswith("adaptive("):
        choice = ", ".join(INTEGRATORS)
        raise SimulationError(
            f"unknown integrator '{name}'; choose one of {choice} or, with a tolerance, adaptive(1e-8)"
        )
    try:
        check_integrator(name)
    except ValueError as error:
        raise SimulationError(str(error)) from None


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
    notes : tuple of str
        What to know before the numbers are trusted: one sentence each, none as a rule.
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
    notes: tuple[str, ...] = ()

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

    def _html_rows(self) -> Mapping[str, object]:
        return {**self._headline(), **{f"note {i}": note for i, note in enumerate(self.notes, 1)}}

    def _frame_columns(self) -> Mapping[str, object]:
        return {"time": self.time, **dict(zip(self.channels, self.values.T, strict=True))}

    def plot(self) -> Figure:
        """Simulated over measured, a panel per channel. Needs the extra ``plot``."""
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


def judging_mode(model: Model, records: Sequence[Experiment]) -> str:
    """Mode in which a simulation of these records says most: closed loop where controllers and references are known.

    Elsewhere restarts, which need no more than position and command.
    """
    held = model.controlled_actuators
    needed = [f"{name}.reference" for name in held]
    needed += [f"{name}.command" for name in _uncontrolled(model) if f"{name}.command" not in model.optional_inputs]
    known = all(channel in record for channel in needed for record in records)
    return "closed_loop" if held and known else "restarts"


def simulate(
    model: Model,
    experiment: Experiment,
    mode: str = "free_run",
    *,
    integrator: str = AUTOMATIC,
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
        Holds the commands (free run, restarts), the motion (inverse dynamics, prescribed motion) or the references
        (closed loop).
    mode : {"free_run", "inverse_dynamics", "restarts", "closed_loop", "prescribed_motion"}
    integrator, substeps, horizon
        See :class:`Setup`.
    cutoff : float, optional
        Cut-off frequency of the motion filter, Hz (inverse dynamics, prescribed motion, initial velocities).
    initial_state : ndarray, shape (states,), optional
        By default estimated from the first samples of the measured positions; at rest at zero without them. Flexible
        links start from the deflection of their equilibrium there.

    Returns
    -------
    Run

    Raises
    ------
    SimulationError, ExperimentError
        A setting is wrong or a channel that the mode needs is missing.
    DivergedError
        The state left the finite numbers, or no step of ``adaptive`` can follow it; carries the run up to there.

    Warns
    -----
    ValidityWarning
        A flexible link in displacement coordinates bends more than its kinematics allow.
    """
    if mode == "inverse_dynamics":
        return _inverse_dynamics_run(model, experiment, cutoff)
    setup = Setup(integrator, substeps, horizon)
    arrays = simulate_arrays(model, experiment, mode, setup=setup, cutoff=cutoff, initial_state=initial_state)
    run = _run(model, experiment, mode, arrays, setup)
    return run if arrays.states is None else judged(model, run, arrays.states)


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
    followed: Motion | None = None,
) -> SimulatedArrays:
    """Outputs of a simulation and their exact derivative by parameters ``columns``, as plain arrays.

    ``followed`` is what `joint_motion` gave, for callers that prescribe the same motion again and again.
    """
    from vpm._core import Diverged

    setup = setup or Setup()
    theta = model.theta if theta is None else theta
    try:
        if mode == "prescribed_motion":
            return _prescribed(model, followed or joint_motion(experiment, model, cutoff), theta, list(columns), setup)
        return _dispatch(model, experiment, mode, theta, list(columns), setup, cutoff, initial_state)
    except Diverged as error:
        partial = SimulatedArrays(
            error.outputs, np.zeros((*error.outputs.shape, 0)), np.arange(len(error.outputs)), np.zeros(1, np.int64)
        )
        run = _run(model, experiment, mode, partial, setup)
        raise DivergedError(
            str(error), run=run, time=float(experiment.time[0]) + len(run.time) * experiment.dt
        ) from None
    except VpmError:
        raise
    except ValueError as error:  # of the core: sizes, numbers and steps that no simulation can take
        raise SimulationError(f"{experiment.name}: {error}") from error


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
    stepping = (experiment.dt, setup.substeps, setup.method(model), columns)
    if mode == "free_run":
        inputs = _inputs(model, experiment, mode)
        state = start(model, experiment, theta) if initial_state is None else initial_state
        outputs, states, jacobian = model.core.simulate(theta, state, inputs, *stepping)
        return SimulatedArrays(outputs, jacobian, rows, begin, states)
    if mode == "closed_loop":
        _check_controllers(model)
        references, disturbances = _references(model, experiment, mode)
        state = start(model, experiment, theta) if initial_state is None else initial_state
        outputs, states, jacobian = model.core.simulate_closed_loop(theta, state, references, disturbances, *stepping)
        return SimulatedArrays(outputs, jacobian, rows, begin, states)
    if mode == "restarts":
        inputs = _inputs(model, experiment, mode)
        starts, length = restart_grid(experiment, setup.horizon)
        states = measured_states(model, experiment, theta, starts, cutoff)
        outputs, jacobian = model.core.restart(theta, states, starts, length, inputs, *stepping)
        rows = (starts[:, None] + np.arange(length)).ravel()
        flat = outputs.reshape(-1, outputs.shape[-1])
        return SimulatedArrays(flat, jacobian.reshape(len(flat), flat.shape[1], -1), rows, starts)
    raise SimulationError(f"unknown mode '{mode}'; choose one of {', '.join(MODES)}")


def _prescribed(model: Model, m: Motion, theta: Array, columns: list[int], setup: Setup) -> SimulatedArrays:
    """Joints on the filtered motion, from behind the filter's settling to before it; those it lacks are passive."""
    followed = [place for place, joint in enumerate(model.joints) if joint in m.joints]
    passive = [place for place in range(len(model.joints)) if place not in followed]
    motion = np.zeros((3, len(m.time[m.kept]), len(model.joints)))
    for order, values in enumerate((m.position, m.velocity, m.acceleration)):
        motion[order][:, followed] = values[m.kept]
    q, v, a = motion
    outputs, states, jacobian = model.core.simulate_prescribed(
        theta, q, v, a, m.dt, setup.substeps, setup.method(model), columns, passive
    )
    rows = np.arange(len(m.time))[m.kept]
    return SimulatedArrays(outputs, jacobian, rows, np.zeros(1, dtype=np.int64), states)


def copied_channels(model: Model, mode: str, passive: Sequence[str] = ()) -> frozenset[str]:
    """Outputs that a mode takes from the log, or does not work out: nothing to compare there.

    The motion of ``passive`` joints is worked out.
    """
    logged = {f"{name}.pressure" for name in model.logged_supplies}
    if mode == "closed_loop":
        return frozenset(logged | {f"{name}.command" for name in _uncontrolled(model)})
    commands = {f"{name}.command" for name in model.actuators} | logged
    if mode == "prescribed_motion":
        followed = [name for name in model.joints if name not in passive]
        motions = {f"{name}.{kind}" for name in followed for kind in ("position", "velocity", "acceleration")}
        resting = {*model.actuators, *model.supplies}
        return frozenset(motions | {name for name in model.output_channels if name.partition(".")[0] in resting})
    return frozenset(commands)


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


def _run(model: Model, experiment: Experiment, mode: str, arrays: SimulatedArrays, setup: Setup) -> Run:
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
    settings: dict[str, float | int | str] = {"integrator": setup.method(model), "substeps": setup.substeps}
    if mode == "restarts":
        settings["horizon"] = setup.horizon
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
    )


def check_balance(model: Model) -> None:
    """Complain, with the way on, if a balance of effort cannot be drawn up.

    Nobody measures elastic coordinates, and the effort of a drive with a life of its own does not follow from its
    command.

    Raises
    ------
    SimulationError
        A flexible link has elastic coordinates, or an actuator is not ideal.
    """
    for name in model.actuators:
        kind = model.actuator_type(name)
        if kind != "ideal":
            raise SimulationError(
                f"mode 'inverse_dynamics' gives efforts sample by sample, but that of {name} (type {kind}) does not "
                "follow from its command alone; use the mode 'free_run' or 'restarts', or describe it as ideal"
            )
    if model.core.n_elastic:
        elastic = [name for name in model.beams if model.levels[name] != "rigid"]
        raise SimulationError(
            f"mode 'inverse_dynamics' needs the motion of every coordinate, but no log holds the elastic ones of "
            f"{', '.join(elastic)}; use the mode 'prescribed_motion', or model.at('rigid')"
        )


def _inverse_dynamics_run(model: Model, experiment: Experiment, cutoff: float | None) -> Run:
    check_balance(model)
    m = whole_motion(model, experiment, model.theta, cutoff)
    required, applied, _ = model.core.inverse_dynamics(
        model.theta, m.position, m.velocity, m.acceleration, m.inputs, m.dt, []
    )
    channels = tuple(f"{joint}.effort" for joint in model.joints)
    return Run(
        model.name,
        experiment.name,
        "inverse_dynamics",
        m.time[m.retained],
        channels,
        tuple(model.channel_unit(channel) for channel in channels),
        m.parallel(required),
        m.parallel(applied),
        settings={"cutoff": m.cutoff, "decimation": m.decimation},
    )


def _require(experiment: Experiment, channels: Sequence[str], mode: str) -> None:
    """Complain about the first channel that a mode needs and the log does not hold."""
    missing = [channel for channel in channels if channel not in experiment]
    if missing:
        raise ExperimentError(
            f"{experiment.name}: mode '{mode}' needs channel '{missing[0]}', but the log holds "
            f"{', '.join(experiment.channels)}; map a column to it in the channel table"
        )


def _optional(experiment: Experiment, channels: Sequence[str]) -> Array:
    """Columns of a log, zero where it does not hold one."""
    table = np.zeros((len(experiment), len(channels)))
    for column, channel in enumerate(channels):
        if channel in experiment:
            table[:, column] = experiment[channel]
    return table


def _inputs(model: Model, experiment: Experiment, mode: str) -> Array:
    """Commands and pressures of logged supplies, one column each; springs without a command keep their length."""
    _require(experiment, [name for name in model.input_channels if name not in model.optional_inputs], mode)
    return _optional(experiment, model.input_channels)


def simulation_inputs(model: Model, experiment: Experiment) -> Array:
    """What a free run holds between samples, shape (N, inputs): commands and pressures of logged supplies.

    Raises
    ------
    ExperimentError
        The log lacks a command.
    """
    return _inputs(model, experiment, "free_run")


def _references(model: Model, experiment: Experiment, mode: str) -> tuple[Array, Array]:
    """References and disturbances, one column per input; pressures of logged supplies are disturbances.

    So are commands of actuators that no controller commands: there they are all that comes.
    """
    held, free = list(model.controlled_actuators), _uncontrolled(model)
    logged = [f"{name}.pressure" for name in model.logged_supplies]
    needed = [f"{name}.command" for name in free if f"{name}.command" not in model.optional_inputs]
    _require(experiment, [f"{name}.reference" for name in held] + needed + logged, mode)
    references = _optional(experiment, [f"{name}.reference" for name in model.inputs])
    disturbances = _optional(experiment, [*(f"{name}.disturbance" for name in model.actuators), *logged])
    commands = _optional(experiment, [f"{name}.command" for name in free])
    disturbances[:, [model.actuators.index(name) for name in free]] += commands
    return references, disturbances


def _uncontrolled(model: Model) -> list[str]:
    """Actuators that no controller commands; in a closed loop the log does."""
    return [name for name in model.actuators if name not in model.controlled_actuators]


def _check_controllers(model: Model) -> None:
    if not model.controlled_actuators:
        idle = f"for actuator '{model.actuators[0]}'" if model.actuators else "and an actuator"
        raise SimulationError(
            f"mode 'closed_loop' needs a controller {idle}, but the model has none; "
            "add one under [controllers] or use free_run or restarts"
        )


def restart_grid(experiment: Experiment, horizon: float) -> tuple[NDArray[np.int64], int]:
    """Rows at which pieces of a horizon (s) begin, and the samples of each, both ends among them.

    Raises
    ------
    SimulationError
        The horizon is longer than the log.
    """
    length = max(2, round(horizon / experiment.dt) + 1)
    if length > len(experiment):
        raise SimulationError(
            f"horizon {horizon} s is longer than the log {experiment.name} of {len(experiment) * experiment.dt:.3g} s; "
            "choose a shorter one"
        )
    return np.arange(0, len(experiment) - length + 1, length - 1, dtype=np.int64), length
