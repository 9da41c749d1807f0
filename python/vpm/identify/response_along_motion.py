"""Response of a machine along a measured motion: required efforts, efforts of drives, and other outputs.

Nothing here integrates the motion itself, so that no error of a force adds up: every sample balances by itself, but for
what nobody measures and what therefore has to be worked out along the motion, elastic coordinates of links, joints
without a sensor, and the states inside of drives.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from vpm.errors import CoreError, DivergedError, SimulationError
from vpm.experiment import Experiment, Motion
from vpm.identify.drives import first_drives, picked, shown_and_efforts
from vpm.identify.following import Following, Pair
from vpm.identify.parts import Bending, Drives, Part, bending, carried, drives_of, of_joints_alone, whole
from vpm.initial import whole_motion
from vpm.model import Model
from vpm.numbers import Array
from vpm.simulate import Setup, copied_channels

#: Drives that go by samples of their own and remember the last ones.
SAMPLED_TYPES = ("narx", "maxwell_narx")
#: Samples per period of the highest frequency of the motion on which derivatives of what bends are taken: they are then
#: within about one percent.
SLOPE_SAMPLES = 8.0
#: Longest step where a link flies from contact to contact, s: these close within milliseconds.
IN_PLAY = 5e-4


@dataclass(frozen=True)
class Response:
    """Response along one record: efforts required and applied, other outputs, and their derivatives."""

    #: Shape (n, joints); effort that the motion needs at each measured joint, and that the drives deliver there, N or N
    #: m.
    required: Array
    applied: Array
    balance: Array  #: Shape (n, joints, columns); derivative of required - applied.
    seen: Array  #: Shape (n, channels); outputs beside the motion.
    slopes: Array  #: Shape (n, channels, columns); their derivative.


def has_own_drives(model: Model) -> bool:
    """Whether drives have states of their own, so that their response does not follow from the command alone."""
    return not all(model.follows_command(name) for name in model.actuators)


def bends(model: Model) -> bool:
    """Whether any link of a model is elastic and responds by bending."""
    return bool(model.core.n_elastic)


def joints_with_play(model: Model) -> set[str]:
    """Joints of a model whose two sides move without each other within a gap."""
    return {effect.at for effect in model.effects if effect.type.has_play}


def answers_at_once(model: Model) -> bool:
    """Whether efforts follow from each sample of a motion: links are rigid, and drives have no states of their own."""
    return not bends(model) and not has_own_drives(model)


def has_hidden(model: Model, joints: Sequence[str]) -> bool:
    """Whether a model has motion beside the measured ``joints``: elastic links or unmeasured joints."""
    return bends(model) or tuple(model.joints) != tuple(joints)


def check_along(model: Model, joints: Sequence[str]) -> None:
    """Raise an error for a machine without a response along a measured motion, because efforts do not follow."""
    if model.loops:
        raise SimulationError(
            f"no effort can be balanced along a motion, for the closed loops ({', '.join(model.loops)}) share efforts "
            "among them; compare in the mode restarts or free_run"
        )
    for name in model.actuators:
        if model.actuator_type(name) in SAMPLED_TYPES:
            raise SimulationError(
                f"no effort can be balanced along a motion for the actuator {name} (type {model.actuator_type(name)}), "
                "which goes by samples of its own; compare in the mode free_run or closed_loop"
            )
    if pair := free_beside_drive(model, joints):
        hidden, name = pair
        kind, line = model.actuator_type(name), model.line_of_actuator(name)
        rest = f"acts on the line {line}" if line is not None else "has friction of its own"
        what = f"has type {kind}" if kind != "ideal" else rest
        unseen = any(one in model.joints for one in hidden)
        repairs = ["make the links rigid with model.at('rigid')"] * bends(model) + ["measure every joint"] * unseen
        raise SimulationError(
            f"no effort can be balanced along a motion that leaves {', '.join(hidden)} free while the actuator "
            f"{name} {what}; {', '.join(repairs)}, or identify in the mode free_run or closed_loop"
        )


def free_beside_drive(model: Model, joints: Sequence[str]) -> tuple[list[str], str] | None:
    """What no measured joint tells, elastic links and other joints, and a drive whose effort needs it; None if none.

    A drive that feels the measured joints alone answers to their motion. Others are states of one system with what is
    free.
    """
    if not has_hidden(model, joints):
        return None
    apart = of_joints_alone(model, tuple(joints)) is not None
    for name in model.actuators:
        if model.line_of_actuator(name) is not None or not (apart or model.follows_command(name)):
            hidden = [beam for beam in model.beams if model.levels[beam] != "rigid"]
            return [*hidden, *(joint for joint in model.joints if joint not in joints)], name
    return None


def shown_channels(model: Model, joints: Sequence[str], experiments: Sequence[Experiment]) -> tuple[str, ...]:
    """Channels that every log holds and the response along the motion gives beside efforts.

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
    known: Following | None = None,
    origin: Array | None = None,
) -> Response:
    """Response of a machine to a measured motion and to its commands.

    - ``model``: may have joints that ``m`` does not hold: nobody measured them, and they move freely
    - ``theta``: shape (P,)
    - ``experiment``: tells what drives held at the beginning
    - ``channels``: outputs to give, see `shown_channels`; the same in all calls with one ``known``
    - ``known``: how the record is followed, and what was answered to it before. With it, all is given as it is
      compared: filtered, and only at the samples that the filter retains.
    - ``origin``: shape (P,), how links bend or what drives do is taken from the tangent at these values, not worked out
      at ``theta``
    """
    from vpm._core import Diverged

    asked = Asked(
        model, theta, m, experiment, tuple(columns), known or Following(lambda values: values[m.kept]), origin
    )
    try:
        return _responded(asked, channels)
    except Diverged as error:
        time = float(m.time[0]) + len(error.outputs) * m.dt
        raise DivergedError(f"{experiment.name}: {error}", time=time) from None
    except (CoreError, np.linalg.LinAlgError) as error:
        if not has_hidden(model, m.joints):
            raise
        # No place of rest, or no mass matrix: with these numbers the machine cannot follow the motion.
        raise DivergedError(f"{experiment.name}: {error}", time=float(m.time[m.kept][0])) from None


@dataclass(frozen=True)
class Asked:
    """Model, parameters and record for a response along a motion."""

    model: Model
    theta: Array
    m: Motion
    experiment: Experiment
    columns: tuple[int, ...]
    known: Following
    origin: Array | None


def _responded(ask: Asked, channels: Sequence[str]) -> Response:
    """Response along the motion as a sum: required efforts, drive efforts and other outputs."""
    model, own, hidden = ask.model, has_own_drives(ask.model), has_hidden(ask.model, ask.m.joints)
    if not own and not hidden:
        return _rigid(ask, channels)
    if own and hidden:
        ask = replace(ask, origin=None)  # where drives and what they swing come together there is no tangent
    # What is no channel of a drive shows in a run of drives, as long as no link bends.
    of_drives = [c for c in channels if own and (not bends(model) or shows_drives_alone(model, [c]))]
    others = [c for c in channels if c not in of_drives]
    needs = _bent(ask, others) if hidden else _carried(ask)
    drives = _driven(ask, of_drives) if own else _delivered(ask)
    order = [[*of_drives, *others].index(c) for c in channels]
    ours, theirs = slice(len(of_drives)), slice(len(others))
    seen = np.concatenate([drives[0][:, ours], needs[0][:, theirs]], axis=1)[:, order]
    slopes = np.concatenate([drives[1][:, ours], needs[1][:, theirs]], axis=1)[:, order]
    joints = [-place for place in range(len(ask.m.joints), 0, -1)]
    balance = needs[1][:, joints] - drives[1][:, joints]
    return Response(needs[0][:, joints], drives[0][:, joints], balance, seen, slopes)


def _rigid(ask: Asked, channels: Sequence[str]) -> Response:
    m, joints = ask.m, len(ask.m.joints)
    motion = (m.position, m.velocity, m.acceleration, m.inputs, m.dt)
    required, applied, slopes = ask.model.core.inverse_dynamics(ask.theta, *motion, list(ask.columns))
    efforts, balance = ask.known.filtered(np.hstack([required, applied]), slopes)
    nothing = np.zeros((len(efforts), len(channels)))
    return Response(
        efforts[:, :joints], efforts[:, joints:], balance, nothing, np.zeros((*nothing.shape, len(ask.columns)))
    )


def _carried(ask: Asked) -> Pair:
    """Required effort at the joints along the motion, all of which were measured."""
    part = ask.known.memo.once(("carried", ask.model.structure), partial(carried, ask.model))
    return ask.known.answer(part, ask.theta, ask.columns, partial(_required, part.model, ask.m))


def _required(model: Model, m: Motion, theta: Array, columns: Sequence[int]) -> Pair:
    efforts, slopes = model.core.required(theta, m.position, m.velocity, m.acceleration, m.dt, list(columns))
    return efforts, slopes


def _bent(ask: Asked, channels: Sequence[str]) -> Pair:
    """Outputs and joint efforts along the motion where links bend or unmeasured joints move."""
    known, origin, split = ask.known, ask.origin, None
    if not has_own_drives(ask.model):
        split = bending_of(ask.model, ask.m.joints, known)
        if split is None:
            # A compliant joint has no tangent, but laws on its measured side do not feel that either.
            split, origin = bending_of(ask.model, ask.m.joints, known, wound=True), None
    part = split.bare if split else whole(ask.model)
    read = read_where_bent(ask.m.joints, channels)

    def swing(values: Array, columns: Sequence[int]) -> Pair:
        return picked(part.model, *_swung(part.model, values, columns, ask.m, known), slice(None), read)

    values, slopes = known.answer(part, ask.theta, ask.columns, swing, read, origin)
    if split is None or split.laws is None or split.shell is None:
        return values, slopes
    laws, shell, width = split.laws, split.shell, len(channels)
    every = ask.theta[laws.places].tobytes()
    more, added = known.answer(laws, ask.theta, ask.columns, partial(_of_laws, ask, laws.model, shell), every)
    return (
        np.hstack([values[:, :width], values[:, width:] + more]),
        np.concatenate([slopes[:, :width], slopes[:, width:] + added], axis=1),
    )


def read_where_bent(joints: Sequence[str], channels: Sequence[str]) -> tuple[str, ...]:
    """Outputs read from a response with bending links, in their order."""
    return (*channels, *(f"{joint}.effort" for joint in joints))


def bending_of(model: Model, joints: tuple[str, ...], known: Following, *, wound: bool = False) -> Bending | None:
    """`vpm.identify.parts.bending`, built once for the responses of all models of one structure."""
    return known.memo.once(("bending", model.structure, joints, wound), partial(bending, model, joints, wound=wound))


def _of_laws(ask: Asked, laws: Model, shell: Part, theta: Array, columns: Sequence[int]) -> Pair:
    """Efforts of joint laws along the motion of a rigid machine (n, joints), and their derivative."""
    efforts, slopes = _required(laws, ask.m, theta, columns)
    names = [laws.parameter_names[column] for column in columns]
    common = [place for place, name in enumerate(names) if name in shell.model.parameter_names]
    asked = [shell.model.index(names[place]) for place in common]
    less, own = _required(shell.model, ask.m, ask.theta[shell.places], asked)
    slopes[:, :, common] -= own
    return efforts - less, slopes


def _delivered(ask: Asked) -> Pair:
    """Efforts along the motion of drives without states, on the measured joints."""
    efforts, slopes = ask.model.core.delivered(ask.theta, ask.m.inputs, ask.m.dt, list(ask.columns))
    measured = [place for place, joint in enumerate(ask.model.joints) if joint in ask.m.joints]
    return ask.known.filtered(efforts[:, measured], slopes[:, measured])


def shows_drives_alone(model: Model, channels: Sequence[str]) -> bool:
    """Whether all given channels are responses of drives alone; a load cell also measures the machine."""
    return all(channel.rpartition(".")[0] in model.actuators for channel in channels)


def _driven(ask: Asked, channels: Sequence[str]) -> Pair:
    """Outputs and joint efforts along the motion of drives with states of their own."""
    model, joints = ask.model, ask.m.joints
    drives = None
    if shows_drives_alone(model, channels):
        drives = ask.known.memo.once(("drives", model.structure, joints), partial(drives_of, model, joints))
    return _together(ask, channels) if drives is None else _one_by_one(ask, channels, drives)


def _one_by_one(ask: Asked, channels: Sequence[str], drives: Drives) -> Pair:
    """Response along the motion of drives that do not influence each other, one after the other."""
    start, m, rows = ask.theta if ask.origin is None else ask.origin, ask.m, len(channels)
    internal = first_drives(drives.bare.model, start[drives.bare.places], m, ask.experiment)
    answers = []
    for part in drives.parts:
        read = [channel for channel in channels if channel.rpartition(".")[0] in part.model.actuators]
        pushed = replace(m, inputs=m.inputs[:, part.inputs])
        places = [*(channels.index(channel) for channel in read), *range(rows, rows + len(m.joints))]
        answers.append((places, _run(ask, part, pushed, read, internal[part.states], ask.origin)))
    samples = len(answers[0][1][0])
    total = np.zeros((samples, rows + len(m.joints)))
    derivative = np.zeros((*total.shape, len(ask.columns)))
    for places, (values, slopes) in answers:
        total[:, places] += values
        derivative[:, places] += slopes
    return total, derivative


def _together(ask: Asked, channels: Sequence[str]) -> Pair:
    """Response along the motion of all drives of a machine together."""
    model, m = ask.model, ask.m
    motion = whole_motion(model, ask.experiment, ask.theta, m.cutoff) if has_hidden(model, m.joints) else m
    internal = first_drives(model, ask.theta, m, ask.experiment)
    values, slopes = _run(ask, whole(model), motion, channels, internal, None)
    measured = [place for place, joint in enumerate(model.joints, len(channels)) if joint in m.joints]
    kept = [*range(len(channels)), *measured]
    return values[:, kept], slopes[:, kept]


def _run(ask: Asked, part: Part, m: Motion, channels: Sequence[str], internal: Array, origin: Array | None) -> Pair:
    """Outputs and joint efforts of one part's drives along the motion, from given first states."""
    known = ask.known
    work = partial(
        shown_and_efforts,
        part.model,
        m=m,
        experiment=ask.experiment,
        channels=channels,
        internal=internal,
        integrator=known.integrator,
    )
    more = (known.commands, known.integrator, *channels, internal.tobytes())
    return known.answer(part, ask.theta, ask.columns, work, more, origin)


def _swung(model: Model, theta: Array, columns: Sequence[int], m: Motion, known: Following) -> Pair:
    """Outputs of `guided` along the motion, with derivatives on fewer samples where gauges hold links.

    What rings freely would lose its phase by that.
    """
    every, hold = int(1.0 / (SLOPE_SAMPLES * m.cutoff * m.dt)), known.hold
    if not columns or hold is None or every < 2:
        outputs, _, jacobian = guided(model, theta, m, columns, known)
        return outputs, jacobian
    from scipy.interpolate import CubicSpline

    outputs, _, _ = guided(model, theta, m, (), known)
    quantities = ("position", "velocity", "acceleration", "time")
    few = replace(m, **{name: getattr(m, name)[::every] for name in quantities}, dt=every * m.dt)
    _, _, slopes = guided(model, theta, few, columns, replace(known, hold=replace(hold, rate=hold.rate[::every])))
    grid, places = every * np.arange(len(few.time)), np.arange(len(m.time))
    return outputs, np.asarray(CubicSpline(grid, slopes)(np.minimum(places, grid[-1])))


def guided(
    model: Model, theta: Array, m: Motion, columns: Sequence[int], known: Following
) -> tuple[Array, Array, Array]:
    """Outputs along the motion of the measured joints, with all else free or held by gauges; states, derivatives."""
    hold, coordinates = known.hold, len(model.coordinates)
    setup = Setup()
    measured = [place for place, joint in enumerate(model.joints) if joint in m.joints]
    passive = [place for place in range(len(model.joints)) if place not in measured]
    motion = np.zeros((3, len(m.time), len(model.joints)))
    for order, values in enumerate((m.position, m.velocity, m.acceleration)):
        motion[order][:, measured] = values
    method = "linearly_implicit" if has_own_drives(model) else setup.method(model, guided=True)
    plays = bool(joints_with_play(model))
    substeps = max(setup.substeps, math.ceil(m.dt / IN_PLAY - 1e-6)) if plays else setup.substeps
    strains = hold.arguments(model) if hold else (None, None)
    stepping = (m.dt, substeps, method, list(columns), passive, *strains, 0, known.departure)
    outputs, states, jacobian = model.core.simulate_prescribed(theta, motion[0], motion[1], motion[2], *stepping)
    return outputs, states[:, : 2 * coordinates], jacobian
