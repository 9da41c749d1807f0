"""A loop at a fixed rate: its deadlines, what it reports, and what it is refused."""

import os
import time
from pathlib import Path

import pytest

from interrupting import pressed
from vpm.errors import CoreError, SimulationError
from vpm.realtime import Loop, LoopReport


def test_ticks_come_at_their_deadlines_without_drift() -> None:
    begin = time.monotonic()
    with Loop(200.0) as loop:
        ticks = list(loop.ticks(0.3))
    passed = time.monotonic() - begin
    assert passed >= 0.3
    numbers = [tick.number for tick in ticks]
    assert numbers[0] == 0
    assert numbers == sorted(set(numbers))
    # All deadlines are accounted for: woken up for, or missed.
    assert numbers[-1] == len(ticks) - 1 + sum(tick.missed for tick in ticks)
    assert all(tick.time == pytest.approx(tick.number / 200.0) and tick.late >= 0.0 for tick in ticks)


def test_work_that_takes_too_long_misses_deadlines() -> None:
    with Loop(100.0) as loop:
        loop.wait()
        time.sleep(0.035)
        tick = loop.wait()
    assert tick.missed >= 3
    report = loop.report()
    assert report.missed == tick.missed
    assert report.work["max"] >= 0.034


def test_report_tells_what_was_asked_for(tmp_path: Path) -> None:
    with Loop(1000.0, lock_memory=True, priority=10) as loop:
        for _ in loop.ticks(0.02):
            pass
    report = loop.report()
    assert report.memory_locked != "not asked"
    assert report.priority_raised != "not asked"
    assert report.wakes > 0
    assert list(report.latency.values()) == sorted(report.latency.values())
    assert LoopReport.load(report.save(tmp_path / "loop.npz")) == report
    assert "woke up" in str(report)


def test_a_closed_loop_does_not_wait() -> None:
    loop = Loop(100.0)
    loop.wait()
    loop.close()
    with pytest.raises(CoreError, match="closed"):
        loop.wait()


@pytest.mark.skipif(os.name != "posix", reason="signals as POSIX has them")
def test_other_threads_run_while_it_waits_and_a_signal_ends_the_wait() -> None:
    """The longest period, so that a busy machine lets the other thread run before the deadline."""
    loop = Loop(1.0 / 60.0)
    loop.wait()
    with pytest.raises(KeyboardInterrupt), pressed(0.1, time.monotonic):
        loop.wait()
    assert loop.report().wakes == 0  # it ended before its deadline


@pytest.mark.parametrize("rate", [0.0, -1.0, float("nan"), 1e9, 1e-3])
def test_a_rate_without_meaning_is_refused(rate: float) -> None:
    with pytest.raises(SimulationError, match="is not possible"):
        Loop(rate)


@pytest.mark.parametrize("priority", [0, 100])
def test_a_priority_without_meaning_is_refused(priority: int) -> None:
    with pytest.raises(SimulationError, match="from 1 to 99"):
        Loop(100.0, priority=priority)


def test_a_negative_time_is_refused() -> None:
    with Loop(100.0) as loop, pytest.raises(SimulationError, match="not negative"):
        next(loop.ticks(-1.0))
