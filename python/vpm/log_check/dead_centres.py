"""Joints that follow from a cylinder's length, and the side of its dead centre on which the model file has them.

Two angles have one length. That of the model file is where the joint has zero (`vpm.experiment.joints_from_lengths`);
nobody chooses it on purpose, and the other one makes other weights and levers.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from vpm.errors import VpmError
from vpm.experiment import Experiment, joints_from_lengths
from vpm.experiment.lengths import dead_centre, lines_that_tell
from vpm.log_check.finding import Finding
from vpm.log_check.settings import Settings
from vpm.log_check.shares import Judge
from vpm.model import Model
from vpm.numbers import rough_percent

#: Digits of the zero that is proposed, rad: somewhere in the motion will do.
_DIGITS = 1


def beyond_dead_centres(judge: Judge, record: Experiment, settings: Settings) -> tuple[Experiment, list[Finding]]:
    """Record with angles on the right side of their dead centres, and a finding for each that was on the other one.

    An angle is on the other side if the efforts of its joint say so: the model, with parameters and friction fitted,
    leaves more than a doubtful share of them, and beyond the dead centre at most a tenth of that.
    """
    tellers = {
        joint: line
        for joint, line in lines_that_tell(record, judge.model).items()
        if judge.model.channel_unit(f"{joint}.position") == "rad"
    }
    findings: list[Finding] = []
    try:
        told = joints_from_lengths(record, judge.model) if tellers else record
    except VpmError:  # whoever uses the record says it
        return record, []
    left = dict(judge.efforts_read(told)) if tellers else {}
    for joint, line in tellers.items():
        position = f"{joint}.position"
        if left.get(position, 0.0) <= settings.doubtful:
            continue
        centre = dead_centre(judge.model, line, joint)
        turned = told.with_channel(position, 2.0 * centre - told[position], "rad")
        turned = replace(turned, slower=told.slower, retained=told.retained)
        after = dict(judge.efforts_read(turned))
        if after.get(position, 1.0) > settings.better * left[position] or sum(after.values()) > sum(left.values()):
            continue
        findings.append(_finding(judge.model, record, turned, (joint, line), centre, (left[position], after[position])))
        told, left = turned, after
    return (told, findings) if findings else (record, [])


def _finding(
    model: Model,
    record: Experiment,
    turned: Experiment,
    names: tuple[str, str],
    centre: float,
    share: tuple[float, float],
) -> Finding:
    """Finding of a joint that is beyond its dead centre."""
    (joint, line), angle = names, turned[f"{names[0]}.position"]
    sentence = (
        f"{joint} is beyond the dead centre of {line} at {centre:.3g} rad, from {angle.min():.3g} to {angle.max():.3g} "
        f"rad: of its effort the model leaves {rough_percent(share[0])} unexplained on the side of zero, and "
        f"{rough_percent(share[1])} there"
    )
    repair = _repair(model, joint, round(float(np.mean(angle)), _DIGITS))
    return Finding("side", (f"{line}.length",), (record.name,), sentence, repair, True, share=share)


def _repair(model: Model, joint: str, zero: float) -> str:
    """Repair of a joint beyond its dead centre: a joint frame whose zero is there; bodies on it stay as they are."""
    entry = model.to_dict()["joints"][joint]
    if "dh" in entry:
        return f"add {zero:g} rad to theta of {joint}"
    before = Rotation.from_euler("xyz", entry.get("rotation", [0.0, 0.0, 0.0]))
    after = before * Rotation.from_rotvec(zero * np.asarray(entry["axis"], dtype=np.float64))
    roll, pitch, yaw = after.as_euler("xyz")
    same = np.array([[roll, pitch, yaw], [roll - np.pi, np.pi - pitch, yaw - np.pi]])
    same -= 2.0 * np.pi * np.round(same / (2.0 * np.pi))
    shortest = same[np.argmin(np.linalg.norm(same, axis=1))]
    numbers = ", ".join(f"{number + 0.0:.4g}" for number in np.round(shortest, 4))
    return f"give the joint {joint} a zero on that side: rotation = [{numbers}]"
