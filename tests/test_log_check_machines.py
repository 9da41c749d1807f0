"""Mistakes planted into logs of the machines of the proving ground, with and without an effect that is missing."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest

from blind import proving
from blind.case import Case
from vpm import Experiment, LogCheck, check_log

pytestmark = pytest.mark.nightly

Change = Callable[[Experiment], Experiment]
MACHINES = ("axis_linear", "axis_rotary", "arm2r", "servo_cylinder", "hydraulic_leg", "flexible_arm")
#: Machines whose cases are made and checked fast, on which logs without a mistake are counted.
MANY = MACHINES[:4]


def scaled(names: list[str], factor: float) -> Change:
    def change(log: Experiment) -> Experiment:
        data = np.array(log.data)
        data[:, [log.channels.index(name) for name in names]] *= factor
        return replace(log, data=data)

    return change


def exchanged(names: list[str]) -> Change:
    def change(log: Experiment) -> Experiment:
        data, places = np.array(log.data), [log.channels.index(name) for name in names]
        data[:, places] = data[:, places[::-1]]
        return replace(log, data=data)

    return change


def late(name: str, seconds: float) -> Change:
    def change(log: Experiment) -> Experiment:
        data, place, count = np.array(log.data), log.channels.index(name), round(seconds / log.dt)
        data[count:, place], data[:count, place] = log.data[:-count, place], log.data[0, place]
        return replace(log, data=data)

    return change


def faster(factor: float) -> Change:
    return lambda log: replace(log, time=factor * log.time)


def mistakes(log: Experiment) -> Iterator[tuple[str, Change]]:
    """Each with the channel that has to be named."""
    units = dict(zip(log.channels, log.units, strict=True))
    positions, commands, pressures, strains = (
        [name for name in log.channels if part in name] for part in (".position", ".command", ".pressure", ".strain")
    )
    turning = units[positions[0]] == "rad"
    unit = 180.0 / np.pi if turning else 1e3
    yield commands[0], scaled(commands[:1], 1e3)
    yield commands[-1], scaled(commands[-1:], 1e-3)
    yield commands[0], scaled(commands[:1], 10.0)
    yield commands[0], scaled(commands[:1], -1.0)
    yield positions[0], scaled(positions[:1], unit)
    yield positions[-1], scaled(positions[-1:], 1.0 / unit)
    yield positions[-1], scaled(positions[-1:], -1.0)
    yield commands[-1], late(commands[-1], 0.02)
    yield positions[0], late(positions[0], 0.02)
    yield "time", faster(1e3)
    yield "time", faster(1e-3)
    if turning:
        yield positions[0], scaled(positions[:1], 0.5 / np.pi)
    if len(positions) > 1:
        yield positions[1], scaled(positions, unit)
        yield positions[0], exchanged(positions[:2])
        yield commands[0], exchanged(commands[:2])
    if pressures:
        yield pressures[0], scaled(pressures[:1], 1e-5)
        yield pressures[0], exchanged(pressures[:2])
    if strains:
        yield strains[0], scaled(strains[:1], 1e6)
        yield strains[-1], scaled(strains[-1:], -1.0)


def cases(machine: str, kind: str, seeds: range) -> list[Case]:
    jobs = proving.jobs([machine], (), seeds, (1.0,), (kind,), 1)
    return [case for job, case, *_ in proving.make(jobs) if case is not None]


def names_it(found: LogCheck, channel: str) -> bool:
    told = [one for one in found.findings if one.kind in {"unit", "scale", "sign", "swap", "clock", "delay"}]
    return bool(told) and channel in told[0].sentence.partition(";")[0]


@pytest.mark.parametrize("machine", MACHINES)
def test_names_planted_mistakes_in_the_first_sentence(machine: str) -> None:
    clean, *_ = cases(machine, "none", range(9330, 9331))
    faulty = cases(machine, "single", range(9331, 9332))
    planted = [
        (case, *mistake)
        for place, mistake in enumerate(mistakes(clean.train[0]))
        for case in (clean, faulty[place % len(faulty)])
    ]
    right = [names_it(check_log(case.model(), change(case.train[0])), channel) for case, channel, change in planted]
    assert np.mean(right) >= 0.9  # of all machines together 0.95, see docs/log_check.md


@pytest.mark.parametrize("machine", MANY)
def test_finds_no_mistake_where_there_is_none(machine: str) -> None:
    several = [case for kind in ("single", "none") for case in cases(machine, kind, range(9340, 9341))]
    wrong = [case for case in several if check_log(case.model(), case.train).mistakes]
    assert len(several) > 20
    assert len(wrong) <= 1
