"""What a log check need not work out: it is known before, or cannot change what is found."""

from collections import OrderedDict
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

import vpm
from places import EXAMPLES
from test_log_check_late_reading import MODEL, turned
from vpm.discrepancy.parallel_candidates import Failure
from vpm.identify import InverseDynamicsProblem, drives, response_along_motion
from vpm.identify.following import Built
from vpm.initial import initial_state
from vpm.log_check.correction import Correction
from vpm.log_check.explanation import _is_reached, _Trial
from vpm.log_check.settings import Settings
from vpm.log_check.shares import Judge, Shares
from vpm.ranking import tracked_records
from vpm.simulate import Setup

RIG = vpm.Model.load(EXAMPLES / "servo_cylinder" / "rig.toml")
PRESSURES = ("servo.pressure_a", "servo.pressure_b")


@cache
def driven() -> vpm.Experiment:
    """Record of 3 s of a cylinder whose valve lets half as much through as the model file says."""
    time, gain = 1e-3 * np.arange(3000), "servo.valve.flow_gain"
    command = 3e-4 * np.sin(2.0 * np.pi * time) + 1e-4 * np.sin(6.2 * np.pi * time)
    asked = vpm.Experiment.from_arrays(time, {"servo.command": command}, model=RIG)
    run = vpm.simulate(RIG.with_parameters({gain: 0.5 * RIG.parameters[gain].value}), asked)
    shown = {name: run[name] for name in ("axis.position", *PRESSURES)}
    return vpm.Experiment.from_arrays(time, {"servo.command": command, **shown}, model=RIG)


def judge(model: vpm.Model, record: vpm.Experiment) -> Judge:
    return Judge(model, Settings(), Setup(), [record])


@pytest.mark.parametrize("factor", [2.0, 0.5, -1.0, 1e-5])
@pytest.mark.parametrize("wrong", [PRESSURES[:1], PRESSURES[1:], PRESSURES])
def test_a_wrong_pressure_leaves_a_quarter_of_what_it_gives(wrong: tuple[str, ...], factor: float) -> None:
    record = driven()
    for name in wrong:
        record = record.with_channel(name, factor * record[name], "Pa")
    left = judge(RIG, record).pressures_read(record)
    assert set(left) == set(PRESSURES)
    assert min(left.values()) >= 0.25


def test_pressures_that_give_what_a_motion_needs_are_in_no_other_unit() -> None:
    """A valve that lets too little through moves the pressures of its model, and not the efforts of the record."""
    one = judge(RIG, driven())
    left, read = one.measured(driven()), one.pressures_read(driven())
    assert max(read.values()) < 1e-3
    assert one.doubtful(left) >= set(PRESSURES)
    assert one.doubtful(replace(left, pressures=read)) == {"axis.position"}


def test_a_delay_is_not_refined_from_a_start_that_promises_less_than_was_reached() -> None:
    left = {share: Shares({"axis.position": share}, np.zeros(1)) for share in (0.5, 0.01, 0.002, 0.001)}
    late, other = (Correction((name,), delay=0.01) for name in ("axis.position", "axis.velocity"))
    found = [_Trial(late, left[0.5], left[0.002])]
    assert _is_reached((replace(late, delay=0.02), left[0.01]), found)
    assert not _is_reached((replace(late, delay=0.02), left[0.001]), found)
    assert not _is_reached((other, left[0.01]), found)
    assert not _is_reached(Failure("no run"), found)


def test_drives_answer_once_for_sizes_and_derivatives(monkeypatch: pytest.MonkeyPatch) -> None:
    run, runs, place = drives.driven, [0], RIG.index("servo.valve.flow_gain")

    def counted(*given: Any, **named: Any) -> Any:
        runs[0] += 1
        return run(*given, **named)

    monkeypatch.setattr(drives, "driven", counted)
    built: Built = OrderedDict()
    problem = InverseDynamicsProblem(RIG, [driven()], first=(RIG.theta, [place]), built=built)
    problem.evaluate(RIG, RIG.theta, [place])
    assert runs == [1]
    monkeypatch.setattr(response_along_motion, "carried", lambda *_: pytest.fail("parts were built again"))
    InverseDynamicsProblem(RIG, [driven()], built=built).evaluate(RIG, RIG.theta, [place])


def test_a_tracked_record_begins_where_its_log_does(monkeypatch: pytest.MonkeyPatch) -> None:
    record, begun = turned(0), [0]

    def counted(*given: Any) -> Any:
        begun[0] += 1
        return initial_state(*given)

    for place in (tracked_records, vpm.observer.filtering):
        monkeypatch.setattr(place, "initial_state", counted)
    one = judge(MODEL, record)
    one.measured(record)
    one.measured(record, 1.1 * one.model.theta)
    assert begun == [1]
