"""Runs cases in processes of their own, so that an end of a process is a finding too."""

import os
import resource
import signal
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from fuzz.cases import case
from vpm.errors import VpmError

#: Processor time (s) and memory beyond that of the interpreter (bytes) that a case may take.
SECONDS, MEMORY = 10.0, 2 << 30
#: Cases that a process takes.
BATCH = 200


@dataclass
class Findings:
    """What went wrong, by the seed of the case; and how many cases were refused."""

    wrong: dict[int, str] = field(default_factory=dict)
    counts: Counter[str] = field(default_factory=Counter)


def watched(first: int, count: int, door: str = "") -> Findings:
    """Go through the cases of seeds from ``first`` on, through one door or all."""
    found = Findings()
    seed, end = first, first + count
    with tempfile.TemporaryFile() as told:
        while seed < end:
            last = min(seed + BATCH, end)
            ended = _batch(range(seed, last), told.fileno(), door)
            reached = seed - 1
            for at, what, words in _lines(told.fileno()):
                reached = at
                if what != "begun":
                    found.counts[what] += 1
                if what == "wrong":
                    found.wrong[at] = words
                elif what == "begun":
                    begun = words
            if ended:
                found.wrong[reached] = f"{begun}: the process ended with {_name(ended)}"
            seed = reached + 1 if ended else last
    return found


def _batch(seeds: range, told: int, door: str) -> int:
    """End of a process that goes through some cases."""
    os.ftruncate(told, 0)
    os.lseek(told, 0, os.SEEK_SET)
    child = os.fork()
    if child:
        return os.waitpid(child, 0)[1]
    try:
        limit = _size() + MEMORY
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        with tempfile.TemporaryDirectory() as folder:
            for seed in seeds:
                _one(seed, Path(folder), told, door)
    finally:
        os._exit(0)


def _one(seed: int, folder: Path, told: int, door: str) -> None:
    # Ends the process where Python is not asked any more.
    signal.setitimer(signal.ITIMER_PROF, 2.0 * SECONDS)
    begin = time.process_time()
    steps = case(seed, folder, door)
    name = next(steps)
    _say(told, seed, "begun", name)
    try:
        next(steps, None)
        what, words = "accepted", ""
    except VpmError as error:
        what, words = "refused", ""
        if not str(error).strip():
            what, words = "wrong", f"{name}: an error without words"
        elif _short_of_memory(error):
            what = "refused_for_memory"
    except Exception as error:  # noqa: BLE001  # whatever it is, it is what is looked for
        place = traceback.extract_tb(error.__traceback__)[-1]
        words = f"{name}: {type(error).__name__}: {str(error)[:200]} ({Path(place.filename).name}:{place.lineno})"
        what = "wrong"
    spent = time.process_time() - begin
    if spent > SECONDS:
        what, words = "wrong", f"{name}: {spent:.0f} s of processor time ({what})"
    _say(told, seed, what, words)


def _short_of_memory(error: BaseException | None) -> bool:
    """Whether an error comes from a lack of memory."""
    return error is not None and (isinstance(error, MemoryError) or _short_of_memory(error.__cause__))


def _say(told: int, seed: int, what: str, words: str) -> None:
    os.write(told, f"{seed}\t{what}\t{' '.join(words.split())}\n".encode("utf-8", "replace"))


def _lines(told: int) -> Iterator[tuple[int, str, str]]:
    os.lseek(told, 0, os.SEEK_SET)
    with os.fdopen(os.dup(told), encoding="utf-8", errors="replace") as file:
        for line in file:
            seed, what, words = line.rstrip("\n").split("\t")
            yield int(seed), what, words


def _size() -> int:
    """Address space of this process, bytes."""
    pages = Path("/proc/self/statm").read_text(encoding="utf-8").split()[0]
    return int(pages) * resource.getpagesize()


def _name(ended: int) -> str:
    return signal.Signals(os.WTERMSIG(ended)).name if os.WIFSIGNALED(ended) else f"code {os.WEXITSTATUS(ended)}"
