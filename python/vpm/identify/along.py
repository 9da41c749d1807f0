"""What a machine does along a measured motion: the effort the motion needs, that of the drives, and what shows of them.

Nothing here integrates the motion itself, so that no error of a force adds up: every sample balances by itself, but for
what nobody measures and what therefore has to be worked out along the motion, elastic coordinates of links, joints
without a sensor, and the states inside of drives.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from vpm.errors import CoreError, DivergedError, SimulationError
from vpm.experiment import Experiment, Motion
from vpm.identify.drive_answers import apart, driven, first_drives, needed, picked, together
from vpm.identify.drive_memory import DriveMemory, Filter
from vpm.identify.hidden_motion import with_hidden
from vpm.identify.reuse import Kept
from vpm.initial import whole_motion
from vpm.model import Model, Shape
from vpm.simulate import Setup, copied_channels

Array = NDArray[np.float64]

#: Drives that go by samples of their own and remember the last ones.
SAMPLED_TYPES = ("narx", "maxwell_narx")
#: Samples per period of the highest frequency of the motion on which derivatives of what bends are taken: they are then
#: within about one percent.
SLOPE_SAMPLES = 8.0
#: Longest step where a link flies from contact to contact, s: these close within milliseconds.
IN_PLAY = 5e-4


@dataclass(frozen=True)
class Response:
    """What shows along one record, between the two ends where its filter settles, or where it is compared.

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
    return not all(model.follows_command(name) for name in model.actuators)


def bends(model: Model) -> bool:
    """Whether any of its links is elastic."""
    return bool(model.core.n_elastic)


def has_hidden(model: Model, joints: Sequence[str]) -> bool:
    """Whether it moves in ways beside the measured ``joints``: elastic links, or joints that nobody measures."""
    return bends(model) or tuple(model.joints) != tuple(joints)


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
        if line is not None or not model.follows_command(name):
            rest = f"acts on the line {line}" if line is not None else "has friction of its own"
            what = f"has type {kind}" if kind != "ideal" else rest
            raise SimulationError(
                f"no effort can be balanced along a motion that leaves {', '.join(hidden)} free while the actuator "
                f"{name} {what}; make the links rigid with model.at('rigid'), measure every joint, or identify in the "
                "mode free_run or closed_loop"
            )


def shown_channels(model: Model, joints: Sequence[str], experiments: Sequence[Experiment]) -> tuple[str, ...]:
    """What every log holds beside the balance of effort and this machine works out along the motion, or lacks.

    It lacks the coordinates that effects would split off: where a log holds the deflection of a link or of a joint that
    the machine takes for rigid, it says zero.
    """
    lacking = (channel for channel in model.deflections if all(channel in e for e in experiments))
    return (*_shown(model, joints, experiments), *lacking)


def _shown(model: Model, joints: Sequence[str], experiments: Sequence[Experiment]) -> tuple[str, ...]:
    if not has_own_drives(model) and not has_hidden(model, joints):
        return ()
    efforts = {f"{name}.effort" for name in model.joints}
    if has_own_drives(model):
        lengths = {
            c
            for c in model.output_channels
            if c.rpartition(".")[0] in {*model.joints, *model.lines, *model.transmissions}
        }
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
    memory: DriveMemory | None = None,
    kept: Kept | None = None,
    origin: Array | None = None,
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
        Outputs to give, see `shown_channels`; the same in all calls with one ``kept``.
    memory : DriveMemory, optional
        Of what drives answered before to this motion. With it, all is given as it is compared: filtered, and only at
        the samples that the filter retains.
    kept : Kept, optional
        Remembers how links bend along this record.
    origin : ndarray, shape (P,), optional
        How links bend and what drives do is taken from the tangent at these values, not worked out at ``theta``.

    Raises
    ------
    DivergedError
        What is worked out along the motion left the finite numbers.
    """
    from vpm._core import Diverged

    near = kept or Kept()
    try:
        if has_own_drives(model) and not has_hidden(model, m.joints):
            remembered = memory or DriveMemory(lambda values: values[m.kept])
            return _with_drives(model, theta, m, experiment, (columns, channels), remembered, origin)
        if has_own_drives(model):
            bare = _unsplit(Shape(model), m.joints)
            if bare is not None and shows_drives_alone(model, channels):
                remembered = memory or DriveMemory(lambda values: values[m.kept])
                return _with_known_drives(model, bare, theta, m, experiment, (columns, channels), (remembered, near))
            answer = _with_both(model, theta, m, experiment, (columns, channels), near)
        elif has_hidden(model, m.joints):
            remembered = memory or DriveMemory(lambda values: values[m.kept])
            swing = partial(_swung, m=m, known=near)
            return Response(*with_hidden(model, theta, m, (columns, channels), (remembered, near, origin), swing))
        else:
            answer = _rigid(model, theta, m, columns, channels)
        return answer if memory is None else _filtered(answer, memory.keep)
    except Diverged as error:
        time = float(m.time[0]) + len(error.outputs) * m.dt
        raise DivergedError(f"{experiment.name}: {error}", time=time) from None
    except (CoreError, np.linalg.LinAlgError) as error:
        if not has_hidden(model, m.joints):
            raise
        # No place of rest, or no mass matrix: with these numbers the machine cannot follow the motion.
        raise DivergedError(f"{experiment.name}: {error}", time=float(m.time[m.kept][0])) from None


def _filtered(answer: Response, keep: Filter) -> Response:
    """The same at the samples that are compared."""
    parts = (answer.required, answer.applied, answer.seen, answer.balance, answer.slopes)
    widths = [int(np.prod(part.shape[1:])) for part in parts]
    # All side by side: each pass of the filter begins with the same solution of its equations at rest.
    flat = [part.reshape(len(part), width) for part, width in zip(parts, widths, strict=True)]
    kept = np.split(keep(np.concatenate(flat, axis=1)), np.cumsum(widths)[:-1], axis=1)
    sides = [side.reshape(len(side), *part.shape[1:]) for side, part in zip(kept, parts, strict=True)]
    required, applied, seen, balance, slopes = sides
    return Response(required, applied, balance, seen, slopes)


def _rigid(model: Model, theta: Array, m: Motion, columns: Sequence[int], channels: Sequence[str]) -> Response:
    required, applied, jacobian = model.core.inverse_dynamics(
        theta, m.position, m.velocity, m.acceleration, m.inputs, m.dt, list(columns)
    )
    rows = m.kept
    nothing = np.zeros((len(m.time[rows]), len(channels)))
    slopes = np.zeros((*nothing.shape, len(columns)))
    return Response(required[rows], applied[rows], jacobian[rows], nothing, slopes)


def shows_drives_alone(model: Model, channels: Sequence[str]) -> bool:
    """Whether none of the channels is of anything but drives: a load cell, say, feels the machine as well."""
    return all(channel.rpartition(".")[0] in model.actuators for channel in channels)


def _with_drives(
    model: Model,
    theta: Array,
    m: Motion,
    experiment: Experiment,
    wanted: tuple[Sequence[int], Sequence[str]],
    memory: DriveMemory,
    origin: Array | None,
) -> Response:
    """Drives with states of their own, on the joints' motion.

    The effort that the motion needs and what the drives do along it do not depend on each other.
    """
    columns, channels = wanted
    if shows_drives_alone(model, channels):
        outputs, by_drives = apart(model, theta, m, experiment, wanted, memory, origin)
    else:
        outputs, by_drives = together(model, theta, m, experiment, wanted, memory)
    required, slopes = needed(model, theta, m, columns, memory)
    balance = slopes - by_drives[:, len(channels) :]
    seen = by_drives[:, : len(channels)]
    return Response(required, outputs[:, len(channels) :], balance, outputs[:, : len(channels)], seen)


@lru_cache(maxsize=128)
def _unsplit(shape: Shape, joints: tuple[str, ...]) -> tuple[Model, NDArray[np.int64]] | None:
    """A machine without the effects that split its joints, if it has the measured ``joints`` then, and its parameters.

    The motor side of a split joint keeps the measured motion and the drives: these answer as in the machine as it was.
    """
    bare = model = shape.model
    for effect in model.effects:
        candidate = bare.without_effect(*effect.key)
        bare = candidate if len(candidate.joints) < len(bare.joints) else bare
    if bends(model) or tuple(bare.joints) != joints:
        return None
    return bare, np.array([model.index(name) for name in bare.parameter_names], dtype=np.int64)


def _with_known_drives(
    model: Model,
    unsplit: tuple[Model, NDArray[np.int64]],
    theta: Array,
    m: Motion,
    experiment: Experiment,
    wanted: tuple[Sequence[int], Sequence[str]],
    known: tuple[DriveMemory, Kept],
) -> Response:
    """Drives with states of their own on measured joints, behind which hang others that effects have split off."""
    (bare, places), (columns, channels), (memory, near) = unsplit, wanted, known
    own = {int(place): number for number, place in enumerate(places)}
    felt = [number for number, column in enumerate(columns) if column in own]
    asked = [own[columns[number]] for number in felt]
    outputs, by_drives = apart(bare, theta[places], m, experiment, (asked, channels), memory)
    effort = [model.output_channels.index(f"{joint}.effort") for joint in m.joints]
    values, slopes = _hidden(model, theta, m, columns, near)
    required = memory.keep(values[:, effort])
    balance = np.zeros((*required.shape, len(columns)))
    if columns:
        balance += memory.keep(slopes[:, effort].reshape(len(slopes), -1)).reshape(balance.shape)
    balance[:, :, felt] -= by_drives[:, len(channels) :]
    seen = np.zeros((len(required), len(channels), len(columns)))
    seen[:, :, felt] = by_drives[:, : len(channels)]
    return Response(required, outputs[:, len(channels) :], balance, outputs[:, : len(channels)], seen)


def _with_both(
    model: Model,
    theta: Array,
    m: Motion,
    experiment: Experiment,
    wanted: tuple[Sequence[int], Sequence[str]],
    known: Kept,
) -> Response:
    """Drives with states of their own on measured joints, behind which others hang that nobody measures.

    Such drives feel the measured motion alone: what they deliver does not depend on the hidden one.
    """
    columns, channels = wanted
    required, slopes = _hidden(model, theta, m, columns, known)
    whole = whole_motion(model, experiment, theta, m.cutoff)
    internal = first_drives(model, theta, m, experiment)
    outputs, jacobian = driven(model, theta, whole, experiment, columns, internal)
    rows, joints = m.kept, [place for place, joint in enumerate(model.joints) if joint in m.joints]
    effort = [model.output_channels.index(f"{model.joints[place]}.effort") for place in joints]
    drives = [len(model.output_channels) + place for place in joints]
    return Response(
        required[rows][:, effort],
        outputs[rows][:, drives],
        (slopes[:, effort] - jacobian[:, drives])[rows],
        *picked(model, outputs, jacobian, rows, channels),
    )


def _swung(model: Model, theta: Array, columns: Sequence[int], m: Motion, known: Kept) -> tuple[Array, Array]:
    """As `_hidden`, with derivatives on fewer samples where gauges hold links: each costs as much as the outputs.

    What rings freely would lose its phase by that.
    """
    every, hold = int(1.0 / (SLOPE_SAMPLES * m.cutoff * m.dt)), known.hold
    if not columns or hold is None or every < 2:
        return _hidden(model, theta, m, columns, known)
    from scipy.interpolate import CubicSpline

    outputs, _ = _hidden(model, theta, m, (), known)
    quantities = ("position", "velocity", "acceleration", "time")
    few = replace(m, **{name: getattr(m, name)[::every] for name in quantities}, dt=every * m.dt)
    _, slopes = _hidden(model, theta, few, columns, Kept(replace(hold, rate=hold.rate[::every]), known.departure))
    grid, places = every * np.arange(len(few.time)), np.arange(len(m.time))
    return outputs, np.asarray(CubicSpline(grid, slopes)(np.minimum(places, grid[-1])))


def _hidden(model: Model, theta: Array, m: Motion, columns: Sequence[int], known: Kept) -> tuple[Array, Array]:
    outputs, _, jacobian = guided(model, theta, m, columns, known)
    return outputs, jacobian


def guided(model: Model, theta: Array, m: Motion, columns: Sequence[int], known: Kept) -> tuple[Array, Array, Array]:
    """Outputs along the motion of the measured joints, all else free or held by gauges, states, and derivative."""
    hold, coordinates = known.hold, len(model.coordinates)
    setup = Setup()
    measured = [place for place, joint in enumerate(model.joints) if joint in m.joints]
    passive = [place for place in range(len(model.joints)) if place not in measured]
    motion = np.zeros((3, len(m.time), len(model.joints)))
    for order, values in enumerate((m.position, m.velocity, m.acceleration)):
        motion[order][:, measured] = values
    method = "linearly_implicit" if has_own_drives(model) else setup.method(model, guided=True)
    plays = any(effect.type.has_play for effect in model.effects)
    substeps = max(setup.substeps, math.ceil(m.dt / IN_PLAY - 1e-6)) if plays else setup.substeps
    strains = hold.arguments(model) if hold else (None, None)
    stepping = (m.dt, substeps, method, list(columns), passive, *strains, 0, known.departure)
    outputs, states, jacobian = model.core.simulate_prescribed(theta, motion[0], motion[1], motion[2], *stepping)
    return outputs, states[:, : 2 * coordinates], jacobian
