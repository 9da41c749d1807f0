"""Limits of each test: its processor time, looks in which it may stand still, and the end of what it started.

By the clock, a test takes as long as other work on the machine makes it; its processor time is its own.
"""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Generator
from multiprocessing.resource_tracker import _resource_tracker as tracker
from pathlib import Path
from types import FrameType
from typing import NamedTuple

import pytest

from guard import MARK, end, marked
from stalls import LOOKS, PERIOD, Process, Stall, below, processes

#: Processor time that a test may take for its setup, its call or its teardown, with all its processes, s.
PROCESSOR = 1200.0
#: Time between two attempts to end a test that swallows the first, s.
AGAIN = 10.0


class Begun(NamedTuple):
    """Where a phase of a test began: processor time until then, s, and whether it stands still since."""

    used: float
    stall: Stall


def used() -> float:
    """Processor time of this process and of those that it has waited for, s."""
    return sum(os.times()[:4])


class Limits:
    """A plugin of pytest that ends a test beyond its limits, by name, together with its processes.

    Parameters
    ----------
    processor : float
        Of a setup, a call or a teardown, s.
    looks : int
        In how many looks in a row it may stand still.
    """

    def __init__(self, processor: float = PROCESSOR, looks: int = LOOKS) -> None:
        self._limits = processor, looks
        # Objects, for two phases may begin at the same processor time.
        self._begin: Begun | None = None
        self._beyond: Begun | None = None
        self._reason = ""
        self._kept = self._started_guard()
        signal.signal(signal.SIGUSR1, self._stop)
        threading.Thread(target=self._watch, name="limits", daemon=True).start()

    def _started_guard(self) -> subprocess.Popen[bytes]:
        environment = {name: value for name, value in os.environ.items() if name != MARK}
        os.environ[MARK] = str(os.getpid())
        command = [sys.executable, "-I", "-S", str(Path(__file__).with_name("guard.py")), str(os.getpid())]
        # In a session of its own, so that no signal of the terminal ends it before its work.
        nothing = subprocess.DEVNULL
        return subprocess.Popen(
            command, env=environment, start_new_session=True, stdin=nothing, stdout=nothing, stderr=nothing
        )

    def _started(self, among: dict[int, Process]) -> list[int]:
        """What the tests have started and what still runs, orphans too, without the helpers of all of them."""
        own = os.getpid()
        found = {*below(own, among), *marked(own)} - {self._kept.pid, getattr(tracker, "_pid", None)}
        return [number for number in found if number in among and not among[number].ended]

    def _watch(self) -> None:
        told = 0.0
        while True:
            time.sleep(PERIOD)
            begin, now = self._begin, time.monotonic()
            if begin is None or (begin is self._beyond and now - told < AGAIN):
                continue
            among = processes()
            if reason := self._exceeded(begin, among):
                self._reason, self._beyond, told = reason, begin, now
                end(self._started(among))  # first, since the test may wait for them
                signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGUSR1)

    def _exceeded(self, begin: Begun, among: dict[int, Process]) -> str:
        """The limit that is exceeded, in words."""
        spent = used() - begin.used + sum(among[number].seconds for number in self._started(among))
        if spent > self._limits[0]:
            return f"took more than {self._limits[0]:g} s of processor time"
        # Without the time of these looks.
        return f"stood still in {self._limits[1]} looks" if begin.stall.is_there(spent - time.thread_time()) else ""

    def _stop(self, _number: int, _frame: FrameType | None) -> None:
        # Only within the phase that is meant: between two it would end the run.
        if self._begin is not None and self._begin is self._beyond:
            pytest.fail(self._reason)

    def _limited(self) -> Generator[None, object, object]:
        self._begin = Begun(used(), Stall(self._limits[1]))
        try:
            return (yield)
        finally:
            self._begin = None

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_setup(self) -> Generator[None, object, object]:
        return (yield from self._limited())

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self) -> Generator[None, object, object]:
        return (yield from self._limited())

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_teardown(self) -> Generator[None, object, object]:
        try:
            return (yield from self._limited())
        finally:
            end(self._started(processes()))

    def pytest_unconfigure(self) -> None:
        end(self._started(processes()))
        self._kept.kill()
        self._kept.wait()
