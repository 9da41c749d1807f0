"""The state from which a simulation of a log starts, from what was measured."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vpm.errors import ExperimentError
from vpm.experiment import Experiment, Motion, joints_from_sensors, motion
from vpm.first_bending import first_departure
from vpm.model import Model
from vpm.model.drives.states import commanded_states, follow, rest
from vpm.model.loops.states import kept, measured
from vpm.numbers import Array

#: How the size of a piston is given: two diameters, or an area and the share of it on the side of the rod.
_SIZES = ("bore", "rod", "area", "area_ratio")


def measured_states(
    model: Model,
    experiment: Experiment,
    theta: Array,
    rows: NDArray[np.int64],
    cutoff: float | None,
    given: Motion | None = None,
) -> Array:
    """Initial or other states (len(rows), nx) at some samples of the measured motion.

    Sensor errors are undone; flexible links bend as the measured motion of the joints has made them; lags and spools
    have followed the commands from the beginning of the log, currents have settled on the held one, and chambers are
    without net force, unless the log holds what is inside of a drive. Effects remember what was since the first sample.
    Joints that effects have split off are where the measured motion of the others takes them. The motion of all joints
    may be ``given``.
    """
    gain, offset = sensor_errors(model, theta)
    m = given or (
        _closed_motion(model, experiment, (gain, offset), rows, cutoff)
        if model.loops and len(model.joints) == len(model.coordinates) and not model.added_joints
        else whole_motion(model, experiment, theta, cutoff)
    )
    states = np.zeros((len(rows), model.core.n_states))
    followed = commanded_states(model, theta, m.inputs, m.dt)
    joints, coordinates = len(model.joints), len(model.coordinates)
    states[:, :joints] = (m.position[rows] - offset) / gain
    states[:, coordinates : coordinates + joints] = m.velocity[rows] / gain
    if coordinates > joints:
        states[:, : 2 * coordinates] = _bent(
            model,
            experiment,
            theta,
            replace(
                m, position=(m.position - offset) / gain, velocity=m.velocity / gain, acceleration=m.acceleration / gain
            ),
        )[rows]
    for state, row in zip(states, rows, strict=True):
        internal = _internal(model, experiment, theta, state[:coordinates], int(row))
        follow(model, theta, internal, m.inputs[row], state[coordinates : coordinates + joints])
        for place, name in enumerate(model.internal_names):
            if name in followed:
                internal[place] = followed[name][row]
        state[2 * coordinates :] = _seen(model, experiment, theta, state[:coordinates], internal, int(row))
    memories = sum(name.endswith(".memory") for name in model.internal_names)
    if memories:  # what the joints remember of their way until then
        states[:, -memories:] = model.core.memories(theta, (m.position - offset) / gain, m.dt)[rows]
    return states


def _bent(model: Model, experiment: Experiment, theta: Array, m: Motion) -> Array:
    """Coordinates and rates (N, 2 coordinates) of flexible links along a motion, for initial states.

    They begin as what they carry reads at first, or at rest where the log holds nothing of that.
    """
    joints, coordinates = len(model.joints), len(model.coordinates)

    def along(departure: Array | None) -> tuple[Array, Array]:
        outputs, states, _ = model.core.simulate_prescribed(
            theta, m.position, m.velocity, m.acceleration, m.dt, 1, "linearly_implicit", [], [], departure=departure
        )
        return np.asarray(outputs), np.array(states)

    outputs, states = along(None)
    owners = {*model.gauges, *model.markers, *model.imus}
    told = [name for name in model.output_channels if name.partition(".")[0] in owners and name in experiment]
    if told:
        places = [model.output_channels.index(name) for name in told]
        readings = np.column_stack([experiment[name] for name in told])
        start = states[0], m.inputs[0]
        departure = first_departure(model, theta, start, (told, readings, m.dt), outputs[:, places], m.edge)
        _, states = along(departure) if np.any(departure) else (outputs, states)
    bent = states[:, : 2 * coordinates]
    bent[:, :joints] = m.position
    bent[:, coordinates : coordinates + joints] = m.velocity
    return bent


def initial_state(model: Model, experiment: Experiment, theta: Array) -> Array:
    """Initial state at the first sample: lags settled, flexible links deflected as in equilibrium.

    A joint is at zero where the log holds no position, and shafts tell none, with its logged velocity or at rest. One
    that nobody drives or measures rests beside those that are measured, and moves as that rest does: a load hangs below
    its rope. Where nothing draws it back it is at zero.
    Drives have stood without commands, but for what the log holds of them: pressures of chambers, current, place of the
    spool. One pressure and the load tell the other.
    """
    joints, coordinates = len(model.joints), len(model.coordinates)
    with suppress(ExperimentError):  # shafts that do not tell the joints leave them at rest
        experiment = joints_from_sensors(experiment, model, theta)
    state = np.zeros(model.core.n_states)
    gain, offset = sensor_errors(model, theta)
    for joint, name in enumerate(model.joints):
        if f"{name}.position" in experiment:
            position, velocity = _fit_start(experiment, f"{name}.position")
            state[joint] = (position - offset[joint]) / gain[joint]
            state[coordinates + joint] = velocity / gain[joint]
    for name in joints_by_velocity(model, experiment.channels):
        velocity, _ = _fit_start(experiment, f"{name}.velocity")
        state[coordinates + model.joints.index(name)] = _true(model, theta, f"{name}.velocity", velocity)
    if model.loops:
        seen = [name for name in model.joints if f"{name}.position" in experiment]
        moving = slice(coordinates, 2 * coordinates)
        state[:coordinates], state[moving] = measured(model, state[:coordinates], state[moving], seen)
    elif unseen := _unseen(model, experiment):
        state = _rested(model, theta, state, unseen, experiment.dt)
    if model.added_joints:
        state[:joints] = _settled(model, theta, state[:joints], experiment.dt)
    if coordinates > joints and model.loops:
        valued = model.with_parameters(dict(zip(model.parameter_names, theta.tolist(), strict=True)))
        state[:coordinates] = valued.equilibrium(state[:joints])[0]
        kept(model, state)
    elif coordinates > joints:
        state[:coordinates] = model.core.equilibrium(theta, state[:joints])[0]
    internal = _internal(model, experiment, theta, state[:coordinates], 0)
    for place, name in enumerate(model.internal_names):
        command = f"{name.removesuffix('.lag')}.command"
        if name.endswith(".lag") and command in experiment:
            internal[place] = experiment[command][0]
    state[2 * coordinates :] = _seen(model, experiment, theta, state[:coordinates], internal, 0)
    return state


def _unseen(model: Model, experiment: Experiment) -> list[str]:
    """Joints without drive and reading, for an initial state; none where a log tells of no joint at all."""
    own = [name for name in model.joints if name not in model.added_joints]
    told = [name for name in own if any(f"{name}.{what}" in experiment for what in ("position", "velocity"))]
    return [name for name in passive_joints(experiment, model) if name in own and name not in told] if told else []


def _rested(model: Model, theta: Array, state: Array, unseen: Sequence[str], step: float) -> Array:
    """Initial state with ``unseen`` joints where they rest beside the others, moving as that rest moves.

    ``step``: s, over which the others go on at their speed.
    """
    coordinates = len(model.coordinates)
    followed = tuple(name for name in model.joints if name not in {*unseen, *model.added_joints})
    places = [model.joints.index(name) for name in followed]
    gain, offset = (errors[places] for errors in sensor_errors(model, theta))
    still, rests = np.zeros((2, len(followed))), list[Array]()
    for passed in (0.0, step):
        held = state[places] + passed * state[[coordinates + place for place in places]]
        try:
            outputs = _along(model, theta, (np.tile(gain * held + offset, (2, 1)), still, still), followed, step)
        except ValueError:  # the core's: it finds no rest
            return state
        rests.append(outputs[0, [model.output_channels.index(f"{name}.position") for name in unseen]])
    begun = state.copy()
    begun[[model.joints.index(name) for name in unseen]] = rests[0]
    begun[[coordinates + model.joints.index(name) for name in unseen]] = (rests[1] - rests[0]) / step
    return begun


def joints_by_velocity(model: Model, channels: Sequence[str]) -> tuple[str, ...]:
    """Joints whose initial state a log tells by the velocity alone, as of a tachometer.

    Of closed loops, or of joints that effects split off, none: other joints place these.
    """
    own = () if model.loops else (name for name in model.joints if name not in model.added_joints)
    return tuple(name for name in own if f"{name}.velocity" in channels and f"{name}.position" not in channels)


def whole_motion(model: Model, experiment: Experiment, theta: Array, cutoff: float | None) -> Motion:
    """Motion of all joints for an initial state; joints that effects split off are computed."""
    experiment = joints_from_sensors(experiment, model, theta)
    if not model.added_joints:
        return motion(experiment, model, cutoff=cutoff)
    own = tuple(name for name in model.joints if name not in model.added_joints)
    m = motion(experiment, _Joints(model.name, own, model.input_channels, tuple(model.optional_inputs)), cutoff=cutoff)
    position, velocity, acceleration = _worked_out(model, theta, m)
    return replace(m, joints=model.joints, position=position, velocity=velocity, acceleration=acceleration)


def _closed_motion(
    model: Model, experiment: Experiment, errors: tuple[Array, Array], rows: NDArray[np.int64], cutoff: float | None
) -> Motion:
    """Motion for states of closed loops: at these rows all joints as the loops join them to those that are logged."""
    experiment, (gain, offset) = joints_from_sensors(experiment, model), errors
    seen = tuple(name for name in model.joints if f"{name}.position" in experiment)
    inputs = (model.input_channels, tuple(model.optional_inputs))
    m = motion(experiment, _Joints(model.name, seen or model.joints, *inputs), cutoff=cutoff)
    coordinates, places = len(model.coordinates), [model.joints.index(name) for name in m.joints]
    readings = np.zeros((2, len(m.time), coordinates))
    readings[0][:, places] = (m.position - offset[places]) / gain[places]
    readings[1][:, places] = m.velocity / gain[places]
    whole = np.zeros((2, len(m.time), len(model.joints)))
    remembers = any(name.endswith(".memory") for name in model.internal_names)
    position = None
    for row in range(len(m.time)) if remembers else rows:
        position, velocity = measured(model, readings[0][row], readings[1][row], m.joints, position)
        whole[:, row] = gain * position[: len(gain)] + offset, gain * velocity[: len(gain)]
    return replace(m, joints=model.joints, position=whole[0], velocity=whole[1], acceleration=np.zeros_like(whole[0]))


def _worked_out(model: Model, theta: Array, m: Motion) -> tuple[Array, Array, Array]:
    """Motion (N, joints) of all joints, computed where it lacks those split off, for an initial state."""
    quantities = ("position", "velocity", "acceleration")
    outputs = np.asarray(_along(model, theta, (m.position, m.velocity, m.acceleration), m.joints, m.dt))
    columns = [[model.output_channels.index(f"{name}.{what}") for name in model.joints] for what in quantities]
    full = [outputs[:, places] for places in columns]
    for place, name in enumerate(model.joints):
        if name in m.joints:
            for values, given in zip(full, (m.position, m.velocity, m.acceleration), strict=True):
                values[:, place] = given[:, m.joints.index(name)]
    return full[0], full[1], full[2]


def _along(model: Model, theta: Array, given: tuple[Array, Array, Array], joints: tuple[str, ...], dt: float) -> Array:
    """Outputs (N, channels) along a motion of some joints, the others passive, for an initial state."""
    followed = [place for place, name in enumerate(model.joints) if name in joints]
    passive = [place for place in range(len(model.joints)) if place not in followed]
    whole = np.zeros((3, len(given[0]), len(model.joints)))
    for order, values in enumerate(given):
        whole[order][:, followed] = values
    outputs, _, _ = model.core.simulate_prescribed(
        theta, whole[0], whole[1], whole[2], dt, 1, "linearly_implicit", [], passive
    )
    return outputs


def _settled(model: Model, theta: Array, positions: Array, dt: float) -> Array:
    """Initial positions with split-off joints at rest under gravity, remembering nothing."""
    own = [place for place, name in enumerate(model.joints) if name not in model.added_joints]
    held = np.tile(positions[own], (2, 1))
    still = np.zeros_like(held)
    outputs = _along(model, theta, (held, still, still), tuple(model.joints[place] for place in own), dt)
    settled = positions.copy()
    for name in model.added_joints:
        settled[model.joints.index(name)] = outputs[0, model.output_channels.index(f"{name}.position")]
    return settled


def _internal(model: Model, experiment: Experiment, theta: Array, coordinates: Array, row: int) -> Array:
    """Initial states of drives and supplies after a rest at the logged supply pressures."""
    known = [name for name in model.supplies if f"{name}.pressure" in experiment]
    if known:
        theta = theta.copy()
        for name in known:
            theta[model.index(f"{name}.pressure")] = experiment[f"{name}.pressure"][row]
    return rest(model, theta, coordinates)


def _seen(model: Model, experiment: Experiment, theta: Array, state: Array, internal: Array, row: int) -> Array:
    """Initial states of drives where the log holds them; see `_chambers` for pressures."""
    for place, name in enumerate(model.internal_names):
        owner, _, quantity = name.partition(".")
        if quantity in {"spool", "current"} and name in experiment:
            internal[place] = _reading(model, experiment, theta, name, row)
        elif quantity == "chamber_a":
            internal[place : place + 2] = _chambers(model, experiment, theta, owner, state, internal[place:], row)
        elif quantity == "load":
            first, second = _chambers(model, experiment, theta, owner, state, np.full(2, np.nan), row)
            full, ring = areas_of_chambers(model, theta, owner)
            internal[place] = np.nan_to_num(first - ring / full * second, nan=float(internal[place]))
    return internal


def _chambers(
    model: Model, experiment: Experiment, theta: Array, name: str, coordinates: Array, rest: Array, row: int
) -> Array:
    """Initial pressures (2,) of a cylinder's chambers: as logged, or as after a ``rest``.

    Where the log holds one of them, and the cylinder moves a joint by itself, the other is that which holds the machine
    at rest, between the pressures of tank and supply.
    """
    logged = [
        _reading(model, experiment, theta, c, row) if (c := f"{name}.pressure_{side}") in experiment else np.nan
        for side in "ab"
    ]
    if not np.any(np.isnan(logged)):
        return np.array(logged)
    alone = model.line_of_actuator(name) is None and [
        other for other in model.actuators if model.joint_of_actuator(name) in model.joints_of_actuator(other)
    ] == [name]
    if np.all(np.isnan(logged)) or not alone:
        return rest[:2]
    joint = model.joints.index(model.joint_of_actuator(name))
    load = float(model.core.equilibrium(theta, coordinates[: len(model.joints)])[1][joint])
    full, ring = areas_of_chambers(model, theta, name)
    first, second = logged
    balanced = [(ring * second + load) / full, (full * first - load) / ring]
    supply = model.supply_of_actuator(name)
    bounds = [theta[model.index(f"{supply}.{kind}")] for kind in ("tank_pressure", "pressure")]
    return np.where(np.isnan(logged), np.clip(balanced, *bounds), logged)


def _reading(model: Model, experiment: Experiment, theta: Array, channel: str, row: int) -> float:
    """True initial value of a logged channel."""
    return _true(model, theta, channel, float(experiment[channel][row]))


def _true(model: Model, theta: Array, channel: str, reading: float) -> float:
    """True initial value behind a reading, without its sensor's offset and gain."""
    sensor = model.sensor_of(channel)

    def error(suffix: str, none: float) -> float:
        name = f"{sensor}.{suffix}"
        return float(theta[model.index(name)]) if name in model.parameters else none

    return (reading - error("offset.value", 0.0)) / error("gain.value", 1.0)


def areas_of_chambers(model: Model, theta: Array, name: str) -> tuple[float, float]:
    """Areas (m^2) of a cylinder's chambers a and b, for initial pressures."""
    size = {
        key: float(theta[model.index(f"{name}.cylinder.{key}")])
        for key in _SIZES
        if f"{name}.cylinder.{key}" in model.parameters
    }
    if "bore" in size:
        return 0.25 * np.pi * size["bore"] ** 2, 0.25 * np.pi * (size["bore"] ** 2 - size["rod"] ** 2)
    return size["area"], size["area"] * size["area_ratio"]


@dataclass(frozen=True)
class _Joints:
    """A machine of which the joints alone are asked."""

    name: str
    joints: tuple[str, ...]
    input_channels: tuple[str, ...] = ()
    optional_inputs: tuple[str, ...] = ()


def passive_joints(experiment: Experiment, model: Model) -> tuple[str, ...]:
    """Passive joints, which need initial states: neither driven nor measured.

    In prescribed motion they move freely with their effects. A joint with an actuator is never one of them; that its
    position is missing is a mistake of the log. One that an effect has split off is always one of them: where the log
    holds its deflection, that is compared and not prescribed, or the log would show nothing of its stiffness.
    """
    turning = [name for name in model.actuators if model.line_of_actuator(name) is None]
    driven = {joint for name in turning for joint in model.joints_of_actuator(name)}
    added = set(model.added_joints)
    unseen = (name for name in model.joints if name in added or f"{name}.position" not in experiment)
    return tuple(name for name in unseen if name not in driven)


def joint_motion(
    experiment: Experiment,
    model: Model,
    cutoff: float | None = None,
    *,
    commanded: bool = False,
    band: float | None = None,
) -> Motion:
    """Filtered motion of the joints for initial states, as `vpm.experiment.motion` gives it.

    Of joints that are passive there (see `passive_joints`) it has no columns, as long as any joint is measured. The
    log need not hold commands, unless the motion is to be ``commanded``.
    """
    experiment = joints_from_sensors(experiment, model)
    passive = passive_joints(experiment, model)
    followed = tuple(name for name in model.joints if name not in passive)
    inputs = (model.input_channels, tuple(model.optional_inputs)) if commanded else ((), ())
    return motion(experiment, _Joints(model.name, followed or model.joints, *inputs), cutoff=cutoff, band=band)


def _fit_start(experiment: Experiment, channel: str) -> tuple[float, float]:
    """Initial position and velocity from a parabola through the first few samples."""
    count = min(15, len(experiment))
    time = experiment.time[:count] - experiment.time[0]
    curve = np.polynomial.Polynomial.fit(time, experiment[channel][:count], min(2, count - 1)).convert()
    coefficients = np.append(curve.coef, [0.0, 0.0])
    return float(coefficients[0]), float(coefficients[1])


def sensor_errors(model: Model, theta: Array) -> tuple[Array, Array]:
    """Gain and offset of each joint's position sensor (1 and 0 by default), for initial states."""
    gain, offset = np.ones(len(model.joints)), np.zeros(len(model.joints))
    for joint, name in enumerate(model.joints):
        sensor = model.sensor_of(f"{name}.position")
        for index, key, target in ((joint, "gain.value", gain), (joint, "offset.value", offset)):
            full = f"{sensor}.{key}"
            if sensor is not None and full in model.parameters:
                target[index] = theta[model.index(full)]
    return gain, offset
