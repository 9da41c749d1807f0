"""Limits of each test: its processor time, a long time by the clock as a last resort, and the end of what it started.

By the clock, a test takes as long as other work on the machine makes it; its processor time is its own.
"""

from __future__ import annotations

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

#: Processor time that a test may take for its setup, its call or its teardown, with all its processes, s.
PROCESSOR = 1200.0
#: The same by the clock, for what waits for something that never comes, s.
CLOCK = 7200.0
#: Time between two looks, and between two attempts to end a test that swallows the first, s.
PERIOD, AGAIN = 1.0, 10.0


class Process(NamedTuple):
    """A process as ``/proc`` tells of it."""

    parent: int
    seconds: float
    ended: bool


def processes() -> dict[int, Process]:
    """All processes of the machine, with the processor time of each and of what it has waited for."""
    tick, found = os.sysconf("SC_CLK_TCK"), {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            text = (folder / "stat").read_text(encoding="utf-8", errors="replace")
        except OSError:  # ended meanwhile
            continue
        # The name of the program in brackets may hold anything.
        state, parent, *fields = text.rpartition(")")[2].split()
        found[int(folder.name)] = Process(int(parent), sum(map(int, fields[9:13])) / tick, state in "ZX")
    return found


def below(top: int, among: dict[int, Process]) -> list[int]:
    """Processes that one has started, directly or not."""
    children: dict[int, list[int]] = {}
    for number, process in among.items():
        children.setdefault(process.parent, []).append(number)
    found = children.get(top, [])
    return found + [inner for number in found for inner in below(number, among)]


class Limits:
    """A plugin of pytest that ends a test beyond its limits, by name, together with its processes.

    Parameters
    ----------
    processor, clock : float
        Limits of a setup, a call or a teardown, s.
    """

    def __init__(self, processor: float = PROCESSOR, clock: float = CLOCK) -> None:
        self._limits = processor, clock
        self._begin: tuple[float, float] | None = None
        self._beyond: tuple[float, float] | None = None
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

    @staticmethod
    def _used() -> tuple[float, float]:
        """Processor time of this process and of those that it has waited for; time by the clock."""
        return sum(os.times()[:4]), time.monotonic()

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

    def _exceeded(self, begin: tuple[float, float], among: dict[int, Process]) -> str:
        """The limit that is exceeded, in words."""
        processor, clock = (now - before for now, before in zip(self._used(), begin, strict=True))
        processor += sum(among[number].seconds for number in self._started(among))
        if processor > self._limits[0]:
            return f"took more than {self._limits[0]:g} s of processor time"
        return f"took more than {self._limits[1]:g} s by the clock" if clock > self._limits[1] else ""

    def _stop(self, _number: int, _frame: FrameType | None) -> None:
        # Only within the phase that is meant: between two it would end the run.
        if self._begin is not None and self._begin is self._beyond:
            pytest.fail(self._reason)

    def _limited(self) -> Generator[None, object, object]:
        self._begin = self._used()
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
