"""Cost of many diagnoses by processes of this machine: one beside two, and what a task costs beside its diagnosis.

Each is of an axis with dry friction that was simulated without vpm, read from files by the workers.

    python benches/diagnosis/many.py --count 40 --rounds 3
"""

from __future__ import annotations

import argparse
import os
import resource
import sys
import tempfile
import time
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path

import vpm
from vpm.many_diagnoses import Case, diagnose_many
from vpm.sending import packed
from vpm.tasks import processes

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests" / "support"))

#: Effects that are tried: a diagnosis takes a fifth of a second.
QUICK = {"effects": ["coulomb_friction"], "limit": 1, "check": False, "names": "search"}


def cases(folder: Path, count: int) -> list[Case]:
    """Axes of different friction, in files."""
    from synthetic import Truth, nominal, simulate_axis

    found = []
    for seed in range(count):
        logs = simulate_axis(Truth(coulomb=4.0 + 0.01 * seed), 2, 2.0, 2 * seed)
        loaded = [vpm.Experiment.load(log.to_csv(folder / f"{seed}_{n}.csv")) for n, log in enumerate(logs)]
        found.append(Case(nominal(), loaded[0], loaded[1], f"axis {seed}"))
    return found


@dataclass(frozen=True)
class Cost:
    """Seconds: by the clock and of processors of the workers and of this process, and what workers take to begin."""

    clock: float
    workers: float
    here: float
    beginning: float


def timed(todo: list[Case], count: int) -> Cost:
    """What each diagnosis costs by so many processes that have begun before."""
    first = spent()
    with processes(count) as pool:
        diagnose_many(todo[: 2 * count], executor=pool, **QUICK)
    begun = spent() - first
    with processes(count) as pool:
        diagnose_many(todo[: 2 * count], executor=pool, **QUICK)
        clock, here = time.perf_counter(), time.process_time()
        diagnose_many(todo, executor=pool, **QUICK)
        clock, here = time.perf_counter() - clock, time.process_time() - here
    each = (spent() - first - 2.0 * begun) / len(todo)
    return Cost(clock / len(todo), each, here / len(todo), (begun - 2 * count * each) / count)


def spent() -> float:
    """Processor time of the processes of this one that have ended, s."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main() -> None:
    """Print the figures in ms, of each the least of all rounds, then the most."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--rounds", type=int, default=3)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        todo = cases(Path(folder), asked.count)
        sent = len(packed(partial(vpm.diagnose, todo[0].model, *todo[0].records)))
        rounds = [(timed(todo, 1), timed(todo, 2)) for _ in range(asked.rounds)]
    for count, costs in zip((1, 2), zip(*rounds, strict=True), strict=True):
        for part in fields(Cost):
            values = [1e3 * getattr(cost, part.name) for cost in costs]
            print(f"{count} processes, {part.name}: {min(values):.1f} ms ({max(values):.1f})")
    print(f"{sent} bytes are sent; load of the machine {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
