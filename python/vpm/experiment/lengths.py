"""Positions of joints that follow from lengths of lines, where a log holds the strokes of cylinders alone."""

from collections.abc import Collection, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from vpm.errors import ExperimentError
from vpm.experiment.record import Experiment
from vpm.experiment.shafts import joints_from_shafts
from vpm.model import Model
from vpm.numbers import Array

#: Places of a joint at which the length of a line is worked out, over a turn or over the way that the length allows.
PLACES = 4097
#: Time before and after a pose in a difference quotient along its velocity, s.
STEP = 1e-5
#: A length that a joint moves by a smaller share of itself does not depend on that joint.
UNMOVED = 1e-9


def joints_from_sensors(
    experiment: Experiment, model: Model, theta: Array | None = None, *, free: Collection[str] = ()
) -> Experiment:
    """Record with positions of joints in the place of lengths of lines and angles of shafts that tell them.

    See `joints_from_lengths` and `vpm.experiment.joints_from_shafts` for parameters and errors.
    """
    return joints_from_shafts(joints_from_lengths(experiment, model, theta, free=free), model, theta, free=free)


def joints_from_lengths(
    experiment: Experiment, model: Model, theta: Array | None = None, *, free: Collection[str] = ()
) -> Experiment:
    """Record with positions of joints in the place of lengths of lines that one joint alone moves.

    The length has its extremes at dead centres, where the line passes the axis. Between two of them it tells the joint;
    those count between which the joint is at zero, as the model file draws it.

    Parameters
    ----------
    theta : ndarray, shape (P,), optional
        Values of the parameters, errors of sensors among them; by default those of the model.
    free : collection of str
        Parameters that are to be fitted to the result.
    """
    values, told = model.theta if theta is None else theta, experiment
    for joint, line in lines_that_tell(experiment, model).items():
        told = _told(told, model, values, line, joint, free)
    return told


def lines_that_tell(experiment: Experiment, model: Model) -> dict[str, str]:
    """Logged lines whose lengths tell joints without a position, by joint."""
    lacking = [joint for joint in model.joints if f"{joint}.position" not in experiment]
    logged = [line for line in model.lines if f"{line}.length" in experiment]
    if not lacking or not logged:
        return {}
    found: dict[str, str] = {}
    for line in logged:
        if _bends(model, line):
            continue
        moved = [joint for joint in model.joints if _moves(model, line, joint)]
        if len(moved) == 1 and moved[0] in lacking:
            found.setdefault(moved[0], line)
    return found


def dead_centre(model: Model, line: str, joint: str) -> float:
    """Angle of a revolute joint, next to zero, at which a line that it moves is longest or shortest, rad.

    The square of the length is a constant and a cosine of the angle from there (law of cosines), so that the angle
    mirrored at the dead centre has the same length.
    """
    squares = _lengths(model, line, joint, np.array([0.0, np.pi, 0.5 * np.pi, -0.5 * np.pi])) ** 2
    longest = np.arctan2(squares[2] - squares[3], squares[0] - squares[1])
    return float(longest - np.pi * np.round(longest / np.pi))


def _told(
    experiment: Experiment, model: Model, theta: Array, line: str, joint: str, free: Collection[str]
) -> Experiment:
    """Record with the position of a joint in the place of the length that tells it."""
    from scipy.interpolate import PchipInterpolator  # slow to import, and seldom needed

    channel, position = f"{line}.length", f"{joint}.position"
    sensor = model.sensor_of(channel)
    errors = [] if sensor is None else [one for one in model.parameter_names if one.startswith(f"{sensor}.")]
    for parameter in errors:
        if parameter in free or parameter.endswith(".delay.time"):
            raise ExperimentError(
                f"{experiment.name}: the position of {joint} does not follow from {channel} while {parameter} counts; "
                f'log the joint itself, "{position}", or keep its value',
                channel=position,
            )
    known = {one.split(".")[-2]: float(theta[model.index(one)]) for one in errors}
    length = (experiment[channel] - known.get("offset", 0.0)) / known.get("gain", 1.0)
    places, lengths = _course(model, line, joint)
    if length.min() < lengths.min() or length.max() > lengths.max():
        raise ExperimentError(
            f"{experiment.name}: {channel} goes from {length.min():.6g} to {length.max():.6g} m, but {joint} moves it "
            f"from {lengths.min():.6g} to {lengths.max():.6g} m, between its dead centres around zero; correct its "
            "unit and offset in the channel table, or the ends of the line",
            channel=channel,
        )
    order = np.argsort(lengths)
    at = PchipInterpolator(lengths[order], places[order])(length)
    rest = experiment.select([one for one in experiment.channels if one != channel])
    told = rest.with_channel(position, at, model.channel_unit(position))
    slower, retained = (
        {**one, position: one[channel]} if channel in one else one for one in (experiment.slower, experiment.retained)
    )
    return replace(told, slower=slower, retained=retained)


def line_rates(model: Model, line: str, joints: Sequence[str], position: Array, velocity: Array) -> Array:
    """Rates (N,) of the length of a line along a motion (N, joints), m/s, by difference quotients."""
    bones = _bones(model, line)
    known = [name for name in bones.joints if name in joints]
    places, columns = ([of.index(name) for name in known] for of in (bones.joints, list(joints)))
    lengths = []
    for shift in (-STEP, STEP):
        q = np.zeros((len(position), len(bones.joints)))
        q[:, places] = (position + shift * velocity)[:, columns]
        start, end = (bones.forward_kinematics(marker, q)[:, :3, 3] for marker in ("start", "end"))
        lengths.append(np.linalg.norm(end - start, axis=1))
    return np.asarray((lengths[1] - lengths[0]) / (2.0 * STEP))


@lru_cache(maxsize=64)
def _course(model: Model, line: str, joint: str) -> tuple[Array, Array]:
    """Places of a joint around zero between dead centres, and the lengths of a line there, which rise or fall."""
    here = float(_lengths(model, line, joint, np.zeros(1))[0])
    # Two ends that slide apart by a way are apart by at least that way less their distance at zero.
    reach = np.pi if model.channel_unit(f"{joint}.position") == "rad" else 100.0 * max(here, 1.0)
    places = np.linspace(-reach, reach, PLACES)
    slopes = np.diff(_lengths(model, line, joint, places)) > 0.0
    middle = PLACES // 2
    turns = np.flatnonzero(np.diff(slopes)) + 1
    low = int(max(turns[turns < middle], default=0))
    high = int(min(turns[turns > middle], default=PLACES - 1))
    fine = np.linspace(places[low], places[high], PLACES)
    lengths = _lengths(model, line, joint, fine)
    rising = lengths[-1] > lengths[0]
    steady = np.diff(lengths) > 0.0 if rising else np.diff(lengths) < 0.0
    inside = np.append(steady, True) & np.append(True, steady)  # a grid point beside a dead centre may lie beyond it
    return fine[inside], lengths[inside]


@lru_cache(maxsize=64)
def _moves(model: Model, line: str, joint: str) -> bool:
    """Whether a joint moves the length of a line."""
    lengths = _lengths(model, line, joint, np.array([-0.4, 0.0, 0.7]))
    return bool(np.ptp(lengths) > UNMOVED * lengths.max())


def _lengths(model: Model, line: str, joint: str, places: Array) -> Array:
    """Lengths of a line with one joint at places and the others at zero, m."""
    bones = _bones(model, line)
    q = np.zeros((places.size, len(bones.joints)))
    q[:, bones.joints.index(joint)] = places
    start, end = (bones.forward_kinematics(marker, q)[:, :3, 3] for marker in ("start", "end"))
    return np.asarray(np.linalg.norm(end - start, axis=1))


@lru_cache(maxsize=64)
def _bends(model: Model, line: str) -> bool:
    """Whether a link that bends lies between the ends of a line."""
    content = model.to_dict()
    joints = {joint["child"]: joint for joint in content["joints"].values()}

    def links(place: dict[str, Any]) -> set[tuple[str, float | None]]:
        on = {(place["parent"], place.get("at"))} if model.levels.get(place["parent"], "rigid") != "rigid" else set()
        mounted = joints.get(place["parent"], content.get("beams", {}).get(place["parent"]))
        return on if mounted is None else on | links(mounted)

    ends = content["lines"][line]
    return links(ends["from"]) != links(ends["to"])


@lru_cache(maxsize=64)
def _bones(model: Model, line: str) -> Model:
    """Bodies, joints and rigid links of a model, with both ends of a line as markers."""
    content = (model.at("rigid") if model.beams else model).to_dict()
    ends = (content["lines"][line][end] for end in ("from", "to"))
    places = ({{"point": "translation"}.get(key, key): value for key, value in end.items()} for end in ends)
    kept = {key: part for key, part in content.items() if key in {"name", "gravity", "bodies", "joints", "beams"}}
    return Model.from_dict({**kept, "markers": dict(zip(("start", "end"), places, strict=True))})
