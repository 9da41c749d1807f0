"""Commands by which chosen outputs of a flexible machine follow a target, with all that the machine does meanwhile."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vpm.control.plan import FlexibleFeedforward
from vpm.control.rest import along, course, loaded
from vpm.control.splitting import between, solve, split
from vpm.control.target import TargetMotion
from vpm.control.task import Task, task_of
from vpm.errors import SimulationError, check_known
from vpm.model import Model
from vpm.numbers import Array, array_of, number_of
from vpm.simulate import Setup

#: From the cheapest to the exact one.
METHODS = ("rigid", "quasi_static", "inertial", "inversion")
#: What is left of internal motions where the feed-forward begins and ends, as a share of the motion.
LEFT = 1e-6
#: Errors of the outputs die out over so many samples.
SAMPLES = 10
#: Points in a motion that show how it accelerates.
RESOLVED = 200
#: Samples that are solved at once: what they need of memory grows with them.
MOST = 50_000


def flexible_feedforward(
    model: Model,
    motion: TargetMotion,
    output: str | Sequence[str] | None = None,
    *,
    start: Mapping[str, float] | ArrayLike | None = None,
    inputs: Sequence[str] | None = None,
    time_step: float = 1e-3,
    method: str = "inversion",
    pre_actuation: float | None = None,
    post_actuation: float | None = None,
    limits: Mapping[str, float] | None = None,
) -> FlexibleFeedforward:
    """Commands by which outputs of a flexible machine follow a target exactly, computed ahead of the motion.

    ``"inversion"`` solves the internal elastic motions as a boundary value problem: what dies out is followed from the
    start, what grows is followed back from the end, so that tips that move the wrong way first begin early. The
    cheaper ones take links as straight (``"rigid"``), bent as by gravity (``"quasi_static"``), or as by gravity and
    the inertial forces of that motion (``"inertial"``).

    Parameters
    ----------
    model : Model
        With drives that deliver at once; delays are left to the feedback.
    output : str or sequence of str, optional
        A marker, whose three coordinates are meant, or names such as ``"tip.x"`` and ``"joint_1.position"``, as many
        as inputs; by default the joints.
    start : mapping of str to float, or array_like of shape (joints,), optional
        Joints near the first pose, which decide between elbow up and down; by default zero.
    inputs : sequence of str, optional
        Actuators at work; by default all.
    time_step : float
        s.
    method : {"inversion", "inertial", "quasi_static", "rigid"}
    pre_actuation, post_actuation : float, optional
        s; by default as long as internal motions need to die out, the latter at most as long as the motion.
    limits : mapping of str to float, optional
        Largest absolute values, SI, of inputs ``"motor_2"`` and of joints, ``"joint_2.position"`` or
        ``"joint_2.velocity"``.

    Raises
    ------
    SimulationError
        A name is unknown, the target is out of reach, the pre-actuation is too short, a limit is not kept, outputs
        cannot be prescribed by these inputs, or the machine has closed loops.

    Examples
    --------
    >>> move = TargetMotion.rest_to_rest([0.5, 0.0, 0.9], [0.6, 0.3, 0.8], 0.8)
    >>> plan = flexible_feedforward(arm, move, "tip", start={"joint_2": 0.6, "joint_3": -1.0})
    >>> plan.commands, plan.strain
    """
    task = task_of(model, output, inputs)
    if motion.width != len(task.outputs):
        raise SimulationError(
            f"the target has {motion.width} columns, the outputs are {', '.join(task.outputs)}; give one for each"
        )
    if method not in METHODS:
        raise SimulationError(f"there is no method '{method}'; choose {', '.join(METHODS)}")
    if not (np.isfinite(time_step) and 0.0 < time_step <= motion.duration / 20.0):
        raise SimulationError(
            f"samples of {time_step} s do not resolve a motion of {motion.duration:.4g} s; give at most a twentieth"
        )
    near = _start(model, start)
    if method == "inversion":
        found = _inverted(task, motion, near, time_step, (pre_actuation, post_actuation))
    else:
        ends = (pre_actuation or 0.0, post_actuation or 0.0)
        found = _algebraic(task, motion, near, time_step, ends, METHODS.index(method))
    _keep(found, limits or {})
    return found


def _start(model: Model, start: Mapping[str, float] | ArrayLike | None) -> Array:
    """Coordinates near the first pose of a feed-forward: joints as given, links bent by gravity."""
    joints: Array = np.zeros(len(model.joints))
    if isinstance(start, Mapping):
        check_known(start, model.joints, SimulationError, "start:", "is no joint")
        for name, value in start.items():
            joints[model.joints.index(name)] = number_of(value, f"start: {name}", SimulationError)
    elif start is not None:
        given = array_of(start, "the start", SimulationError)
        if given.shape != joints.shape:
            raise SimulationError(
                f"the start has shape {given.shape}, but {model.name} has {len(joints)} joints; give a number for each"
            )
        joints = given
    if not np.isfinite(joints).all():
        raise SimulationError("the start is not finite; give a number for each joint that it names")
    return np.asarray(model.equilibrium(joints)[0])


def _inverted(
    task: Task, motion: TargetMotion, near: Array, step: float, actuation: tuple[float | None, float | None]
) -> FlexibleFeedforward:
    n, stiffness = len(near), 1.0 / (SAMPLES * step)
    inside = _times(motion, step, (0.0, 0.0))
    way = along(task, motion.at(inside)[0], near)

    def rates(times: Array, states: Array) -> tuple[Array, Array]:
        answer = task.follow(motion, times, states, stiffness)
        by_state = np.zeros((len(times), 2 * n, 2 * n))
        by_state[:, :n, n:], by_state[:, n:] = np.eye(n), answer.acceleration_by_state
        return np.concatenate([states[:, n:], answer.acceleration], axis=1), by_state

    still = np.zeros((2, 2 * n))
    still[:, :n] = way[0], way[-1]
    ends = rates(np.array([-1.0, motion.duration + 1.0]), still)[1]
    zeros = _internal(ends[0], stiffness, len(task.outputs))
    lead, trail = _lengths(zeros, _internal(ends[1], stiffness, len(task.outputs)), motion, actuation)
    times = _times(motion, step, (lead, trail))
    guess = np.concatenate(_loaded(task, motion, times, _held(way, inside, times))[:2], axis=1)
    guess[[0, -1]] = still
    states = solve(rates, times, guess, (ends[0], ends[1]))
    _check_lead(task, states, still[0], (lead, _needed(zeros.real[zeros.real > 0.0])))
    slopes = rates(times, states)[0]
    middle, between_states = between(times, states, slopes)
    held = task.follow(motion, middle, between_states, stiffness).inputs
    last = task.follow(motion, times[-1:], states[-1:], stiffness).inputs
    found = (states[:, :n], states[:, n:], slopes[:, n:])
    return _plan(task, motion, "inversion", times, np.concatenate([held, last]), found, zeros)


def _algebraic(
    task: Task, motion: TargetMotion, near: Array, step: float, actuation: tuple[float, float], order: int
) -> FlexibleFeedforward:
    """Poses of a feed-forward by balance under loads of the motion before."""
    times, stiff = _times(motion, step, actuation), order == 0
    q = along(task, motion.at(times)[0], near, stiff=stiff)
    found = _loaded(task, motion, times, q) if METHODS[order] == "inertial" else course(times, q, times)
    q, efforts = found[0], np.asarray(task.model.inverse_dynamics(*found))
    moving = np.arange(len(task.model.joints) if stiff else q.shape[1])
    inverse = np.linalg.pinv(task.levers(q)[:, moving])
    u = np.einsum("kmn,kn->km", inverse, efforts[:, moving])
    held = np.concatenate([0.5 * (u[1:] + u[:-1]), u[-1:]])
    return _plan(task, motion, METHODS[order], times, held, found, np.zeros(0, dtype=np.complex128))


def _loaded(task: Task, motion: TargetMotion, times: Array, q: Array) -> tuple[Array, Array, Array]:
    """Positions, velocities and accelerations of a feed-forward with the loads of inertia.

    They are sought at times so far apart that four derivatives leave little of rounding.
    """
    span = float(times[-1] - times[0]) / motion.duration
    count = min(len(times), round(span * max(RESOLVED, 4 * (len(motion.breaks) - 1))) + 1)
    coarse = np.linspace(times[0], times[-1], count)
    found = loaded(task, coarse, motion.at(coarse)[0], course(times, q, coarse)[0])
    return course(coarse, found, times)


def _plan(
    task: Task,
    motion: TargetMotion,
    method: str,
    times: Array,
    inputs: Array,
    found: tuple[Array, Array, Array],
    zeros: NDArray[np.complex128],
) -> FlexibleFeedforward:
    model = task.model
    commands = np.tile(model.command(), (len(times), 1))
    commands[:, task.columns] = inputs
    strains = tuple(name for name in model.output_channels if name.endswith(".strain"))
    return FlexibleFeedforward(
        model.name,
        method,
        times,
        model.inputs,
        task.outputs,
        model.coordinates,
        strains,
        commands,
        motion.at(times)[0],
        task.values(found[0]),
        *found,
        _strains(model, found[0], strains),
        zeros,
    )


def _strains(model: Model, q: Array, names: tuple[str, ...]) -> Array:
    """Gauge strains at the poses of a feed-forward (N, gauges)."""
    if not names:
        return np.zeros((len(q), 0))
    from vpm._core import Simulation

    places = [model.output_channels.index(name) for name in names]
    states = np.concatenate([q, np.zeros_like(q)], axis=1)
    shown = Simulation(model.core, model.theta, states[0], 1e-3, 1, Setup().method(model))
    rows = np.empty((len(q), len(places)))
    for row, state in zip(rows, states, strict=True):
        shown.reset(state)
        row[:] = shown.outputs[places]
    return rows


def _times(motion: TargetMotion, step: float, actuation: tuple[float, float]) -> Array:
    lengths = actuation[0], motion.duration + actuation[1]
    if sum(lengths) > MOST * step:
        raise SimulationError(
            f"a motion of {sum(lengths):.4g} s with what goes before and after has more than {MOST} samples of "
            f"{step:g} s; give a longer time step, or a shorter motion or actuation"
        )
    before, after = (int(np.ceil(length / step - 1e-9)) for length in lengths)
    return np.asarray(step * np.arange(-before, after + 1), dtype=np.float64)


def _held(way: Array, inside: Array, times: Array) -> Array:
    return np.column_stack([np.interp(times, inside, column) for column in way.T])


def _internal(matrix: Array, stiffness: float, outputs: int) -> NDArray[np.complex128]:
    """Poles of a feed-forward's internal motions: the machine's but for two of each output."""
    poles = split(matrix).poles.astype(np.complex128)
    far = np.argsort(np.abs(poles + stiffness))
    return np.asarray(poles[np.sort(far[2 * outputs :])])


def _lengths(
    first: NDArray[np.complex128],
    last: NDArray[np.complex128],
    motion: TargetMotion,
    given: tuple[float | None, float | None],
) -> tuple[float, float]:
    for name, value in zip(("pre", "post"), given, strict=True):
        if value is not None and not (np.isfinite(value) and value >= 0.0):
            raise SimulationError(f"a {name}-actuation of {value} s is not possible; give a time that is not negative")
    lead = _needed(first.real[first.real > 0.0]) if given[0] is None else given[0]
    trail = min(_needed(-last.real[last.real < 0.0]), motion.duration) if given[1] is None else given[1]
    return lead, trail


def _needed(rates: Array) -> float:
    """Time that the slowest of a feed-forward's rates (1/s) needs to leave little, s."""
    return float(-np.log(LEFT) / rates.min()) if rates.size else 0.0


def _check_lead(task: Task, states: Array, rest: Array, times: tuple[float, float]) -> None:
    n = len(task.model.coordinates)
    moved = np.abs(states[:, :n] - rest[:n]).max(axis=0)
    jump = np.abs(states[0, :n] - rest[:n])
    share = float((jump / np.maximum(moved, 1e-300))[moved > 1e-9].max(initial=0.0))
    if share > 1e3 * LEFT:
        place = int(np.argmax(np.where(moved > 1e-9, jump / np.maximum(moved, 1e-300), 0.0)))
        raise SimulationError(
            f"{task.model.name}: with a pre-actuation of {times[0]:.3g} s {task.model.coordinates[place]} would have "
            f"to begin at {100 * share:.2g} % of its motion, as internal motions grow by themselves; "
            f"give at least {times[1]:.3g} s"
        )


def _keep(found: FlexibleFeedforward, limits: Mapping[str, float]) -> None:
    tables = {name: found.commands[:, place] for place, name in enumerate(found.inputs)}
    for place, name in enumerate(found.coordinates):
        tables |= {f"{name}.position": found.position[:, place], f"{name}.velocity": found.velocity[:, place]}
    check_known(limits, tables, SimulationError, "limits:", "is unknown")
    for name, limit in limits.items():
        if not limit > 0.0:
            raise SimulationError(f'limits: "{name}" is {limit:g}; give a positive number')
        largest = float(np.abs(tables[name]).max())
        if largest > limit:
            at = float(found.time[np.argmax(np.abs(tables[name]))])
            raise SimulationError(
                f"the motion takes {name} to {largest:.4g} at {at:.4g} s, beyond its limit of {limit:.4g}; "
                "take more time, or a shorter way"
            )
