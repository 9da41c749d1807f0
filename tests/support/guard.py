"""Ends what a process of the tests has started, as soon as that process is no more, however it ended.

A program of its own: ``python guard.py PID``, started by the process with that number. What that process starts, and
what these start in turn, carries its number in the environment.
"""

import os
import signal
import sys
import time
from collections.abc import Iterator
from pathlib import Path

#: Variable of the environment by which the processes of a test are known.
MARK = "VPM_TESTS_OF"
#: Time between two looks, s.
PERIOD = 0.2


def marked(owner: int) -> Iterator[int]:
    """Processes that this one has started, directly or not, and that still run."""
    words = f"{MARK}={owner}".encode()
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            if words in (folder / "environ").read_bytes().split(b"\0"):
                yield int(folder.name)
        except OSError:  # ended meanwhile, or somebody else's
            continue


def end(processes: list[int]) -> None:
    """End processes at once; those that have ended meanwhile are no matter."""
    for process in processes:
        try:
            os.kill(process, signal.SIGKILL)
        except ProcessLookupError:
            continue


if __name__ == "__main__":
    parent = int(sys.argv[1])
    while os.getppid() == parent:
        time.sleep(PERIOD)
    # Until none is left: one that was just ended may have started another.
    while left := list(marked(parent)):
        end(left)
        time.sleep(PERIOD)
