"""Substitute records for machines without inverse dynamics: loops opened, sampled drives idle, joints placed."""

from __future__ import annotations

import contextlib
from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from vpm.errors import VpmError
from vpm.experiment import Experiment, joints_from_sensors
from vpm.identify import InverseDynamicsProblem
from vpm.identify.following import Following
from vpm.identify.response_along_motion import SAMPLED_TYPES, Response, free_beside_drive
from vpm.initial import joints_by_velocity, passive_joints
from vpm.model import Model
from vpm.numbers import Array
from vpm.ranking.tracked_records import TrackedRecords, Tracker

#: What tells where an actuator acts.
PLACES = ("joint", "line", "transmission")
#: Why no efforts follow where a drive answers to what a log does not tell.
BENDING = "the actuator {drive} answers to the bending of {links}"
UNSEEN = "the log does not tell the place of {joints}, and the actuator {drive} answers to it"


def why_unbalanced(model: Model, experiments: Sequence[Experiment] = ()) -> str:
    """Why a machine needs substitute records, because no efforts follow from its motion, or ""."""
    if model.loops:
        return f"the closed loops ({', '.join(model.loops)}) share efforts among them"
    for name in model.actuators:
        if (kind := model.actuator_type(name)) in SAMPLED_TYPES:
            return f"the actuator {name} (type {kind}) goes by samples of its own"
    if pair := free_beside_drive(model, model.joints):
        return BENDING.format(links=" and ".join(pair[0]), drive=pair[1])
    for experiment in experiments:
        if joints := joints_by_velocity(model, experiment.channels):
            return f"the log holds no position of {' and '.join(joints)}, only its velocity"
        if pair := _unseen_beside_drive(model, experiment):
            return UNSEEN.format(joints=" and ".join(pair[0]), drive=pair[1])
    return ""


def _unseen_beside_drive(model: Model, experiment: Experiment) -> tuple[list[str], str] | None:
    """Joints without sensor and drive, and an actuator whose effort does not follow without them; None if none."""
    passive = passive_joints(joints_from_sensors(experiment, model), model)
    followed = [name for name in model.joints if name not in passive]
    return free_beside_drive(model, followed) if followed else None


def shown(model: Model, tracked: TrackedRecords) -> InverseDynamicsProblem:
    """Motion and efforts of the records, or those of substitute records that are as large."""
    return (
        SubstituteProblem(model, tracked)
        if why_unbalanced(model, tracked.experiments)
        else ProblemOfAllJoints(model, tracked.experiments)
    )


class ProblemOfAllJoints(InverseDynamicsProblem):
    """Problem of all measured joints, for a tracker sees effects at those without a drive too.

    A spring between a motor and its load moves a hundredth of what both do: it has sizes and start values of its own.
    """

    def _shown_joints(self, model: Model) -> Collection[str]:
        return model.joints


class SubstituteProblem(ProblemOfAllJoints):
    """Problem on substitute records: loops opened, all joints measured, sampled drives without effort.

    Motions are those of the machine, and efforts as large as its inertia needs. That is enough for natural sizes and
    for where fits begin, and nothing is judged by it. Where loops are closed, joints that a log shows take what all
    joints lack: forces of the loops do no work, and a ripple would be lost beside them.
    """

    def __init__(self, model: Model, tracked: TrackedRecords) -> None:
        self._closed = model if model.loops else None
        self._independent = [channel.rpartition(".")[0] for channel in tracked.drawn_joints]
        self._rates: dict[int, Array] = {}
        super().__init__(opened(model), _completed(model, tracked))

    def _answer(
        self,
        model: Model,
        theta: Array,
        record: int,
        columns: Sequence[int] = (),
        origin: Array | None = None,
        known: Following | None = None,
    ) -> Response:
        other = _opened_at(model, theta)
        places = [other.index(model.parameter_names[column]) for column in columns]
        tangent = None if origin is None else _opened_at(model, origin).theta
        answer = super()._answer(other, other.theta, record, places, tangent, known)
        return answer if self._closed is None else self._of_loops(self._closed, answer, record)

    def _of_loops(self, closed: Model, answer: Response, record: int) -> Response:
        """Substitute efforts on the joints that are measured: those of all joints that move with them.

        By the principle of virtual work (H. Goldstein, *Classical Mechanics*, 2nd ed., section 1-4) the effort of each
        joint counts by its speed per speed of the measured one.
        """
        if record not in self._rates:
            self._rates[record] = self._speeds(closed, record)
        rates = self._rates[record]
        places = [closed.joints.index(name) for name in self._independent]

        def moved(efforts: Array) -> Array:
            whole = efforts.copy()
            whole[:, places] = np.einsum("nji,nj...->ni...", rates, efforts)
            return whole

        return replace(
            answer, required=moved(answer.required), applied=moved(answer.applied), balance=moved(answer.balance)
        )

    def _speeds(self, closed: Model, record: int) -> Array:
        """Speeds (n, joints, k) of substitute joints per speed of each measured one; none where loops are singular."""
        motion = self.motions[record]
        found = np.zeros((len(motion.retained), len(closed.joints), len(self._independent)))
        for speeds, position in zip(found, motion.position[motion.retained], strict=True):
            q = np.zeros(len(closed.coordinates))
            q[: len(closed.joints)] = position
            for column, name in enumerate(self._independent):
                held = {other: float(other == name) for other in self._independent}
                with contextlib.suppress(VpmError):
                    speeds[:, column] = closed.loops.velocities(q, held)[: len(closed.joints)]
        return found


def opened(model: Model) -> Model:
    """Substitute machine: its loops are opened, and drives without effort act at the freed joints.

    Links that move a drive by bending are rigid there.
    """
    if not why_unbalanced(model):
        return model
    if free_beside_drive(model, model.joints):
        model = model.at("rigid")
    content = model.to_dict()
    for gone in ("loops", "channels"):  # logged columns may be those of loops
        content.pop(gone, None)
    actuators = content.setdefault("actuators", {})
    for name, actuator in actuators.items():
        if model.actuator_type(name) in SAMPLED_TYPES:
            place = {key: actuator[key] for key in PLACES if key in actuator}
            actuators[name] = {"type": "ideal", "gain": 0.0, **place}
    if model.loops:
        driven = {*model.driven_joints, *model.added_joints}
        idle = [joint for joint in model.joints if joint not in driven]
        actuators |= {_idle(joint): {"type": "ideal", "gain": 0.0, "joint": joint} for joint in idle}
    return Model.from_dict(content)


def _opened_at(model: Model, theta: Array) -> Model:
    """Substitute machine at other values of the parameters."""
    return opened(model.with_parameters(dict(zip(model.parameter_names, theta.tolist(), strict=True))))


def _idle(joint: str) -> str:
    """Name of an idle drive in a substitute machine."""
    return f"{joint}_idle"


def _completed(model: Model, tracked: TrackedRecords) -> list[Experiment]:
    """Substitute records with positions of all joints; a tracker estimates unmeasured ones."""
    lacking = {joint for one in tracked.experiments for joint in joints_by_velocity(model, one.channels)}
    if model.loops or any(_unseen_beside_drive(model, one) for one in tracked.experiments):
        lacking = set(model.joints) - set(model.added_joints)
    if not lacking:
        return list(tracked.experiments)
    fast = Tracker(max(tracked.settings.bands), fine=False)
    motions = tracked.states(model, fast)
    added = [name for name in opened(model).actuators if name not in model.actuators]
    records = []
    for record, motion in zip(tracked.experiments, motions, strict=True):
        whole = record
        for place, joint in enumerate(model.joints):
            channel = f"{joint}.position"
            if channel not in record and joint in lacking:
                whole = whole.with_channel(channel, motion[:, place], model.channel_unit(channel))
        for name in added:
            whole = whole.with_channel(f"{name}.command", np.zeros(len(record.time)), "1")
        records.append(whole)
    return records
