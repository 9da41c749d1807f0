"""What workers do in the tests of tasks: functions of a module that every process can import."""

import os
import signal
import time
from pathlib import Path


def double(number: int) -> int:
    return 2 * number


def slow(number: int, seconds: float) -> int:
    time.sleep(seconds)
    return number


def die(marker: Path | None = None) -> str:
    """End this process as one that ran out of memory ends; with a marker only the first time."""
    if marker is not None and marker.exists():
        return "survived"
    if marker is not None:
        marker.touch()
    os.kill(os.getpid(), signal.SIGKILL)
    return "never"


def late(marker: Path) -> str:
    """Be late the first time."""
    if not marker.exists():
        marker.touch()
        raise TimeoutError("no answer in time")
    return "in time"
