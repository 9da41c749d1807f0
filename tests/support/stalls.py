"""What stands still: processes that use no processor time, as those do that wait for each other.

A program of its own: ``python stalls.py COMMAND ...`` runs a command and ends it, with code 124, once it stands still.
It counts looks, not time by the clock: a machine that is busy or asleep looks as seldom as it works.
"""

import os
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

from guard import end

#: Time between two looks, s, and how many of them in a row nothing may happen.
PERIOD, LOOKS = 1.0, 900
#: Processor time of a process that does nothing but wait, s: what wakes up now and then takes less in all these looks.
WAITING = 1.0


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


class Stall:
    """Whether something stands still.

    Parameters
    ----------
    looks : int
        In how many looks in a row it may do nothing.
    waiting : float
        Processor time that is nothing, in all these looks, s.
    """

    def __init__(self, looks: int = LOOKS, waiting: float = WAITING) -> None:
        self._looks, self._waiting, self._quiet, self._spent = looks, waiting, 0, 0.0

    def is_there(self, spent: float) -> bool:
        """Whether it has stood still for so long that has spent this processor time by now, s; one look."""
        # What was waited for by another process takes its time along.
        worked = abs(spent - self._spent) > self._waiting
        self._quiet, self._spent = (0, spent) if worked else (self._quiet + 1, self._spent)
        return self._quiet >= self._looks


def watched(command: list[str], looks: int = LOOKS, period: float = PERIOD, waiting: float = WAITING) -> int:
    """Exit code of a command, 124 of one that stood still and was ended."""
    stall = Stall(looks, waiting)
    with subprocess.Popen(command) as process:
        while True:
            try:
                return process.wait(period)
            except subprocess.TimeoutExpired:
                among = processes()
            found = [number for number in (process.pid, *below(process.pid, among)) if number in among]
            if found and stall.is_there(sum(among[number].seconds for number in found)):
                print(f"{' '.join(command)}: stood still in {looks} looks and was ended", file=sys.stderr)
                end(found)
                process.wait()
                return 124


if __name__ == "__main__":
    try:
        sys.exit(watched(sys.argv[1:]))
    except KeyboardInterrupt:  # which the command has heard too
        sys.exit(130)
