"""What a machine does along a measured motion: the effort the motion needs, that of the drives, and what shows of them.

Nothing here integrates the motion itself, so that no error of a force adds up: every sample balances by itself, but for
what nobody measures and what therefore has to be worked out along the motion, elastic coordinates of links, joints
without a sensor, and the states inside of drives.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vpm.errors import DivergedError, SimulationError
from vpm.experiment import Experiment, Motion
from vpm.initial import measured_states
from vpm.model import Model
from vpm.simulate import Setup, copied_channels

Array = NDArray[np.float64]

#: Drives that go by samples of their own and remember the last ones.
SAMPLED_TYPES = ("narx", "maxwell_narx")


@dataclass(frozen=True)
class Response:
    """What shows along one record, between the two ends where its filter settles.

    Attributes
    ----------
    required, applied : ndarray, shape (n, joints)
        Effort that the motion needs at each measured joint, and that the drives deliver there, N or N m.
    balance : ndarray, shape (n, joints, columns)
        Derivative of required - applied.
    seen : ndarray, shape (n, channels)
        Outputs beside the motion.
    slopes : ndarray, shape (n, channels, columns)
        Their derivative.
    """

    required: Array
    applied: Array
    balance: Array
    seen: Array
    slopes: Array


def has_own_drives(model: Model) -> bool:
    """Whether the effort of any drive does not follow from its command alone."""
    return any(model.actuator_type(name) != "ideal" for name in model.actuators)


def has_hidden(model: Model, joints: Sequence[str]) -> bool:
    """Whether it moves in ways beside the measured ``joints``: elastic links, or joints that nobody measures."""
    return bool(model.core.n_elastic) or tuple(model.joints) != tuple(joints)


def check_along(model: Model, joints: Sequence[str]) -> None:
    """Complain about a machine whose efforts cannot be balanced along a measured motion.

    Raises
    ------
    SimulationError
    """
    for name in model.actuators:
        if model.actuator_type(name) in SAMPLED_TYPES:
            raise SimulationError(
                f"no effort can be balanced along a motion for the actuator {name} (type {model.actuator_type(name)}), "
                "which goes by samples of its own; compare in the mode free_run or closed_loop"
            )
    if not has_hidden(model, joints):
        return
    hidden = [name for name in model.beams if model.levels[name] != "rigid"]
    hidden += [name for name in model.joints if name not in joints]
    for name in model.actuators:
        kind, line = model.actuator_type(name), model.line_of_actuator(name)
        if kind != "ideal" or line is not None:
            what = f"has type {kind}" if kind != "ideal" else f"acts on the line {line}"
            raise SimulationError(
                f"no effort can be balanced along a motion that leaves {', '.join(hidden)} free while the actuator "
                f"{name} {what}; make the links rigid with model.at('rigid'), measure every joint, or identify in the "
                "mode free_run or closed_loop"
            )


def shown_channels(model: Model, joints: Sequence[str], experiments: Sequence[Experiment]) -> tuple[str, ...]:
    """Outputs beside the balance of effort that every log holds and that this machine works out along the motion."""
    if not has_own_drives(model) and not has_hidden(model, joints):
        return ()
    efforts = {f"{name}.effort" for name in model.joints}
    if has_own_drives(model):
        lengths = {c for c in model.output_channels if c.rpartition(".")[0] in {*model.joints, *model.lines}}
        given = copied_channels(model, "free_run") | lengths | efforts
    else:
        passive = tuple(name for name in model.joints if name not in joints)
        given = copied_channels(model, "prescribed_motion", passive) | efforts
    return tuple(c for c in model.output_channels if c not in given and all(c in e for e in experiments))


def respond(
    model: Model,
    theta: Array,
    m: Motion,
    experiment: Experiment,
    columns: Sequence[int],
    channels: Sequence[str],
) -> Response:
    """Let a machine answer to a measured motion and to its commands.

    Parameters
    ----------
    model : Model
        May have joints that ``m`` does not hold: nobody measured them, and they move freely.
    theta : ndarray, shape (P,)
    m : Motion
    experiment : Experiment
        Tells what drives held at the beginning.
    columns : sequence of int
        Parameters to differentiate by.
    channels : sequence of str
        Outputs to give, see `shown_channels`.

    Raises
    ------
    DivergedError
        What is worked out along the motion left the finite numbers.
    """
    from vpm._core import Diverged

    try:
        if has_own_drives(model):
            return _with_drives(model, theta, m, experiment, columns, channels)
        if has_hidden(model, m.joints):
            return _with_hidden(model, theta, m, columns, channels)
    except Diverged as error:
        time = float(m.time[0]) + len(error.outputs) * m.dt
        raise DivergedError(f"{experiment.name}: {error}", time=time) from None
    return _rigid(model, theta, m, columns)


def _rigid(model: Model, theta: Array, m: Motion, columns: Sequence[int]) -> Response:
    required, applied, jacobian = model.core.inverse_dynamics(
        theta, m.position, m.velocity, m.acceleration, m.inputs, m.dt, list(columns)
    )
    rows = m.kept
    nothing = np.zeros((len(m.time[rows]), 0))
    return Response(required[rows], applied[rows], jacobian[rows], nothing, np.zeros((len(nothing), 0, len(columns))))


def _with_drives(
    model: Model, theta: Array, m: Motion, experiment: Experiment, columns: Sequence[int], channels: Sequence[str]
) -> Response:
    """Drives with states of their own, on the joints' motion."""
    setup, rows = Setup(), m.kept
    # From the beginning of the record: what nobody knows of the first state has the filter's settling to die away.
    state = measured_states(model, experiment, theta, np.zeros(1, dtype=np.int64), m.cutoff)[0]
    motion = (m.position, m.velocity, m.acceleration, m.inputs)
    places, seen = _measured_states(model, experiment)
    stepping = (m.dt, setup.substeps, setup.method(model), list(columns))
    internal = state[2 * len(model.joints) :]
    outputs, _, jacobian = model.core.simulate_drives(theta, *motion, internal, places, seen, *stepping)
    effort = [model.output_channels.index(f"{name}.effort") for name in model.joints]
    drives = range(len(model.output_channels), outputs.shape[1])
    shown = [model.output_channels.index(channel) for channel in channels]
    return Response(
        outputs[rows][:, effort],
        outputs[rows][:, drives],
        (jacobian[:, effort] - jacobian[:, drives])[rows],
        outputs[rows][:, shown],
        jacobian[rows][:, shown],
    )


def _measured_states(model: Model, experiment: Experiment) -> tuple[list[int], Array]:
    """Which states of drives the log holds, and their values: currents, and both pressures of a cylinder or none."""
    places: list[int] = []
    columns: list[Array] = []
    for place, name in enumerate(model.internal_names):
        owner, _, quantity = name.partition(".")
        pair = [f"{owner}.pressure_{side}" for side in "ab"]
        if quantity == "current" and name in experiment:
            places, columns = [*places, place], [*columns, experiment[name]]
        elif quantity == "chamber_a" and all(channel in experiment for channel in pair):
            places, columns = [*places, place, place + 1], [*columns, *(experiment[channel] for channel in pair)]
    return places, np.column_stack(columns) if columns else np.zeros((len(experiment), 0))


def _with_hidden(model: Model, theta: Array, m: Motion, columns: Sequence[int], channels: Sequence[str]) -> Response:
    """Elastic links, and joints that nobody measures, on the motion of the others; ideal drives."""
    setup, rows = Setup(), m.kept
    measured = [place for place, joint in enumerate(model.joints) if joint in m.joints]
    passive = [place for place in range(len(model.joints)) if place not in measured]
    motion = np.zeros((3, len(m.time), len(model.joints)))
    for order, values in enumerate((m.position, m.velocity, m.acceleration)):
        motion[order][:, measured] = values
    stepping = (m.dt, setup.substeps, setup.method(model), list(columns), passive)
    outputs, _, jacobian = model.core.simulate_prescribed(theta, motion[0], motion[1], motion[2], *stepping)
    applied, slopes = model.core.delivered(theta, m.inputs, m.dt, list(columns))
    effort = [model.output_channels.index(f"{model.joints[place]}.effort") for place in measured]
    seen = [model.output_channels.index(channel) for channel in channels]
    return Response(
        outputs[rows][:, effort],
        applied[rows][:, measured],
        (jacobian[:, effort] - slopes[:, measured])[rows],
        outputs[rows][:, seen],
        jacobian[rows][:, seen],
    )
