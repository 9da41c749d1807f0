"""Programs and computations that a test stops by Ctrl-C: after some processor time, whatever else the machine does."""

import _thread
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from stalls import processes

#: Time between two looks, s.
PERIOD = 0.02


@contextmanager
def running(command: Sequence[str], cwd: Path | None = None) -> Iterator[subprocess.Popen[str]]:
    """A program with pipes for what it says; it ends with the block, whatever happens there."""
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=cwd) as process:
        try:
            yield process
        finally:
            process.kill()


def work(process: subprocess.Popen[str], seconds: float) -> None:
    """Wait until a program has spent so much more processor time, or has ended."""
    if sys.platform != "linux":  # tells nothing of the time of others in a simple way
        time.sleep(seconds)
        return
    begin = spent(process)
    while process.poll() is None and spent(process) - begin < seconds:
        time.sleep(PERIOD)


def spent(process: subprocess.Popen[str]) -> float:
    """Processor time of a program that runs, or was not yet waited for, s."""
    return processes()[process.pid].seconds


@contextmanager
def pressed(seconds: float, clock: Callable[[], float] = time.process_time) -> Iterator[None]:
    """Ctrl-C as soon as the block has taken so much processor time; none after the block."""
    begin, over = clock(), threading.Event()

    def press() -> None:
        while not over.wait(PERIOD):
            if clock() - begin > seconds:
                # Ends a sleep of the main thread too, where the system can do that.
                os.kill(os.getpid(), signal.SIGINT) if os.name == "posix" else _thread.interrupt_main()
                return

    thread = threading.Thread(target=press)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()
