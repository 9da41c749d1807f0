"""Joints at which effects explain the gap, and others at which they do not."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from second_suite.cases import make_case
from vpm.discrepancy.diagnosis import ChannelGap
from vpm.discrepancy.judged_model import Judged, shrinkage
from vpm.discrepancy.verdict import Joints
from vpm.identify import InverseDynamicsProblem

STRUCTURED: Any = SimpleNamespace(present=True)


def gap(recalibrated: float, after: float) -> ChannelGap:
    """Of an effort of 1 N m with a noise of 0.01 N m."""
    return ChannelGap(recalibrated, recalibrated, after, 0.01, "N m", 1.0, "inverse_dynamics")


GAPS = {
    "first.effort": gap(0.5, 0.02),  # explained
    "second.effort": gap(0.6, 0.48),  # most of it is left
    "third.effort": gap(0.011, 0.011),  # nothing was missing
    "first.position (restarts)": ChannelGap(1.0, 1.0, 1.0, np.nan, "rad", 1.0, "restarts"),
}


def test_joints_are_told_apart_by_what_is_left_there() -> None:
    told = Joints.of(GAPS, STRUCTURED, {})
    assert told.closed == ("first",)
    assert told.open == {"second": pytest.approx(0.64)}
    assert told.differ
    assert told.worst == "second"


def test_what_an_observer_explains_is_closed_whatever_a_balance_leaves() -> None:
    assert Joints.of(GAPS, STRUCTURED, {"second": 0.05}).closed == ("first", "second")
    assert Joints.of(GAPS, STRUCTURED, {"second": 0.9}).open == {"second": pytest.approx(0.64)}


def test_noise_alone_leaves_no_joint_open() -> None:
    quiet: Any = SimpleNamespace(present=False)
    assert not Joints.of(GAPS, quiet, {}).open


def test_a_drive_that_swallows_its_commands_is_weaker_at_its_own_joint_alone() -> None:
    case = make_case("scara", "none", 3)
    model, records = case.model(), case.train
    problem = InverseDynamicsProblem(model, records)
    drive = next(name for name in model.actuators if model.joints_of_actuator(name) == ("elbow",))
    commands = np.concatenate([record[f"{drive}.command"] for record in records])
    deaf = model.with_effect("dead_zone", at=drive, width=float(np.quantile(np.abs(commands), 0.9)))
    one, other = (cast("Judged", SimpleNamespace(model=each)) for each in (model, deaf))
    factors = shrinkage(problem, one, other)
    for record in range(len(records)):
        at = dict(zip(problem.joints, problem.efforts(record), strict=True))
        assert np.all(factors[at["elbow"].samples] > 3.0)
        assert np.all(factors[at["shoulder"].samples] == 1.0)
    assert np.all(shrinkage(problem, other, one) == 1.0)
