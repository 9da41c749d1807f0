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

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vpm.errors import CoreError, DivergedError, SimulationError
from vpm.experiment import Experiment, Motion, joints_from_sensors
from vpm.initial import initial_state as start
from vpm.initial import joint_motion, measured_states, whole_motion
from vpm.model import Model
from vpm.numbers import Array
from vpm.simulate.inputs import check_controllers, held_inputs, references_of, restart_grid, uncontrolled
from vpm.simulate.resolution import resolution
from vpm.simulate.run import Run, SimulatedArrays, judged, run_of
from vpm.simulate.setup import AUTOMATIC, HOLDS, Setup

MODES = ("free_run", "inverse_dynamics", "restarts", "closed_loop", "prescribed_motion")
#: Those whose commands come from the log.
LOGGED = ("free_run", "restarts")
#: Those that begin once, in any state.
BEGUN = ("free_run", "closed_loop")


def simulate(
    model: Model,
    experiment: Experiment,
    mode: str = "free_run",
    *,
    integrator: str = AUTOMATIC,
    substeps: int = 1,
    horizon: float = 0.25,
    cutoff: float | None = None,
    initial_state: Mapping[str, float] | ArrayLike | None = None,
    hold: str = HOLDS[0],
) -> Run:
    """Simulate ``model`` on the inputs of ``experiment``, in one of the modes.

    Parameters
    ----------
    experiment : Experiment
        Holds the commands (free run, restarts), the motion (inverse dynamics, prescribed motion) or the references
        (closed loop).
    mode : {"free_run", "inverse_dynamics", "restarts", "closed_loop", "prescribed_motion"}
    integrator, substeps, horizon, hold
        See :class:`Setup`.
    cutoff : float, optional
        Cut-off frequency of the motion filter, Hz (inverse dynamics, prescribed motion, initial velocities).
    initial_state : mapping of str to float, or array_like of shape (nx,), optional
        Of a free run or a closed loop, as ``model.state`` takes it. By default estimated from the first samples of the
        measured positions; at rest at zero without them. Flexible links start from the deflection of their equilibrium
        there.

    Raises
    ------
    SimulationError, ModelError, ExperimentError
        A setting or a name is wrong, or a channel that the mode needs is missing.
    DivergedError
        The state left the finite numbers, or no step of ``adaptive`` can follow it; carries the run up to there.

    Warns
    -----
    ValidityWarning
        A flexible link in displacement coordinates bends more than its kinematics allow.
    """
    setup = Setup(integrator, substeps, horizon, hold=hold)
    if setup.course != HOLDS[0] and mode not in LOGGED:
        raise SimulationError(
            f"hold '{hold}' is for commands of a log, and mode '{mode}' takes none; leave it out, or use the mode "
            f"{' or '.join(LOGGED)}"
        )
    if initial_state is not None and mode not in BEGUN:
        raise SimulationError(
            f"mode '{mode}' takes no initial_state, since its states follow from the log; leave it out, or use the "
            f"mode {' or '.join(BEGUN)}"
        )
    if mode == "inverse_dynamics":
        return _inverse_dynamics_run(model, experiment, cutoff)
    state = None if initial_state is None else model.state(initial_state)
    arrays = simulate_arrays(model, experiment, mode, setup=setup, cutoff=cutoff, initial_state=state)
    run = run_of(model, experiment, mode, arrays, setup)
    if arrays.states is None:
        return run
    run = judged(model, run, arrays.states)
    if mode == "prescribed_motion":
        return replace(run, notes=(*run.notes, *_left_out(model)))
    if len(arrays.states) == 0:
        return run
    duration = len(arrays.states) * experiment.dt
    commands = arrays.outputs[:, [model.output_channels.index(name) for name in model.input_channels]]
    steps = resolution(model, arrays.states, commands, experiment.dt, setup, duration)
    return replace(run, resolution=steps)


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
    """Outputs of a simulation in a mode and their exact derivative by ``columns``, as plain arrays.

    ``followed`` is what `joint_motion` gave, for callers that prescribe the same motion again and again.
    """
    from vpm._core import Diverged

    setup = setup or Setup()
    theta = model.theta if theta is None else theta
    try:
        if mode == "prescribed_motion":
            followed = followed or joint_motion(experiment, model, cutoff)
            return _prescribed(model, followed, theta, list(columns), setup)
        return _dispatch(model, experiment, mode, theta, list(columns), setup, cutoff, initial_state)
    except Diverged as error:
        # Behind the settling of the filter of a motion that the run follows.
        first = 0 if followed is None else followed.edge
        rows = first + np.arange(len(error.outputs))
        partial = SimulatedArrays(error.outputs, np.zeros((*error.outputs.shape, 0)), rows, np.zeros(1, np.int64))
        run = run_of(model, experiment, mode, partial, setup)
        time = float(experiment.time[0]) + (first + len(run.time)) * experiment.dt
        raise DivergedError(str(error), run=run, time=time) from None
    except (CoreError, np.linalg.LinAlgError) as error:  # sizes, numbers and steps that no simulation can take
        raise SimulationError(f"{experiment.name}: {error}") from error


def judging_mode(model: Model, records: Sequence[Experiment]) -> str:
    """Mode in which a simulation of these records says most: closed loop where controllers and references are known.

    Elsewhere restarts, which need no more than position and command.
    """
    held = model.controlled_actuators
    needed = [f"{name}.reference" for name in held]
    needed += [f"{name}.command" for name in uncontrolled(model) if f"{name}.command" not in model.optional_inputs]
    known = all(channel in record for channel in needed for record in records)
    return "closed_loop" if held and known else "restarts"


def comparing_mode(model: Model, experiment: Experiment) -> str:
    """Mode in which a model is compared with a log: inverse dynamics, or restarts if that is no way.

    It is none with loops, links that bend, and drives that do not follow their commands. Restarts are none where the
    log does not place every joint; then a free run is.
    """
    follow = not (model.loops or model.core.n_elastic) and all(map(model.follows_command, model.actuators))
    if follow:
        return "inverse_dynamics"
    return "restarts" if places_joints(model, experiment) else "free_run"


def places_joints(model: Model, experiment: Experiment) -> bool:
    """Whether a log tells where every joint is, as restarts need; joints of loops tell each other."""
    log = joints_from_sensors(experiment, model)
    own = () if model.loops else (name for name in model.joints if name not in model.added_joints)
    return all(f"{name}.position" in log for name in own)


def simulated_rows(
    experiment: Experiment, mode: str, setup: Setup, followed: Motion | None = None
) -> NDArray[np.int64]:
    """Rows of a log that a mode's outputs stand for; ``followed`` is the motion of its joints, if given."""
    if mode == "restarts":
        starts, length = restart_grid(experiment, setup.horizon)
        return (starts[:, None] + np.arange(length)).ravel()
    return np.arange(len(experiment)) if followed is None else np.arange(len(followed.time))[followed.kept]


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
    rows = simulated_rows(experiment, mode, setup)
    begin = np.zeros(1, dtype=np.int64)
    stepping = (experiment.dt, setup.substeps, setup.method(model), columns)
    if mode == "free_run":
        inputs = held_inputs(model, experiment, mode)
        state = start(model, experiment, theta) if initial_state is None else initial_state
        outputs, states, jacobian = model.core.simulate(theta, state, inputs, *stepping, setup.course)
        return SimulatedArrays(outputs, jacobian, rows, begin, states)
    if mode == "closed_loop":
        check_controllers(model)
        references, disturbances = references_of(model, experiment, mode)
        state = start(model, experiment, theta) if initial_state is None else initial_state
        outputs, states, jacobian = model.core.simulate_closed_loop(theta, state, references, disturbances, *stepping)
        return SimulatedArrays(outputs, jacobian, rows, begin, states)
    if mode == "restarts":
        inputs = held_inputs(model, experiment, mode)
        starts, length = restart_grid(experiment, setup.horizon)
        states = measured_states(model, experiment, theta, starts, cutoff)
        outputs, jacobian = model.core.restart(theta, states, starts, length, inputs, *stepping, setup.course)
        flat = outputs.reshape(-1, outputs.shape[-1])
        return SimulatedArrays(flat, jacobian.reshape(len(flat), flat.shape[1], -1), rows, starts)
    raise SimulationError(f"unknown mode '{mode}'; choose one of {', '.join(MODES)}")


def _left_out(model: Model) -> tuple[str, ...]:
    """What does not act on the links and passive joints of a prescribed run, in which drives do nothing."""
    springs = [name for name in model.actuators if f"{name}.command" in model.optional_inputs]
    if not springs:
        return ()
    return (
        f"springs along lines ({', '.join(springs)}) did nothing, as no drive does in a prescribed motion: links and "
        "passive joints that they pull moved without them",
    )


def _prescribed(model: Model, m: Motion, theta: Array, columns: list[int], setup: Setup) -> SimulatedArrays:
    """Prescribed mode: joints on the filtered motion, without its ends; missing ones are passive."""
    followed = [place for place, joint in enumerate(model.joints) if joint in m.joints]
    passive = [place for place in range(len(model.joints)) if place not in followed]
    motion = np.zeros((3, len(m.time[m.kept]), len(model.joints)))
    for order, values in enumerate((m.position, m.velocity, m.acceleration)):
        motion[order][:, followed] = values[m.kept]
    q, v, a = motion
    outputs, states, jacobian = model.core.simulate_prescribed(
        theta, q, v, a, m.dt, setup.substeps, setup.method(model, guided=True), columns, passive, first=m.edge
    )
    rows = np.arange(len(m.time))[m.kept]
    return SimulatedArrays(outputs, jacobian, rows, np.zeros(1, dtype=np.int64), states)


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


def check_balance(model: Model) -> None:
    """Refuse the inverse-dynamics mode of a machine whose efforts cannot be computed.

    Nobody measures elastic coordinates, and the effort of a drive with a life of its own does not follow from its
    command.
    """
    for name in model.actuators:
        kind = model.actuator_type(name)
        if not model.follows_command(name):
            what = f"type {kind}" if kind != "ideal" else "with friction of its own"
            raise SimulationError(
                f"mode 'inverse_dynamics' gives efforts sample by sample, but that of {name} ({what}) does not "
                "follow from its command alone; use the mode 'free_run' or 'restarts', or describe it as ideal"
            )
    if model.core.n_elastic:
        elastic = [name for name in model.beams if model.levels[name] != "rigid"]
        raise SimulationError(
            f"mode 'inverse_dynamics' needs the motion of every coordinate, but no log holds the elastic ones of "
            f"{', '.join(elastic)}; use the mode 'prescribed_motion', or model.at('rigid')"
        )
