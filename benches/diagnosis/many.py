"""Time of many diagnoses by processes of this machine: one beside two, and what a task costs beside its diagnosis.

Each is of an axis with dry friction that was simulated without vpm, read from files by the workers.

    python benches/diagnosis/many.py --count 40 --rounds 3
"""

from __future__ import annotations

import argparse
import statistics
import sys
import tempfile
import time
from functools import partial
from pathlib import Path

import vpm
from vpm.many import Case, diagnose_many
from vpm.sending import packed
from vpm.tasks import outcomes, processes

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests"))

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


def timed(todo: list[Case], count: int) -> float:
    """Seconds for each diagnosis by so many processes that have begun before."""
    with processes(count) as pool:
        diagnose_many(todo[: 2 * count], executor=pool, **QUICK)
        begin = time.perf_counter()
        diagnose_many(todo, executor=pool, **QUICK)
        return (time.perf_counter() - begin) / len(todo)


def idle(count: int) -> float:
    """Seconds that a task takes which does nothing."""
    with processes(1) as pool:
        outcomes([time.time], pool)
        begin = time.perf_counter()
        outcomes([time.time] * count, pool)
        return (time.perf_counter() - begin) / count


def main() -> None:
    """Print the figures, each with the least and the most of its rounds."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--rounds", type=int, default=3)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        todo = cases(Path(folder), asked.count)
        sent = len(packed(partial(vpm.diagnose, todo[0].model, *todo[0].records)))
        rounds = [(timed(todo, 1), timed(todo, 2), idle(200)) for _ in range(asked.rounds)]
    one, two, empty = zip(*rounds, strict=True)
    for name, values in (("1 process", one), ("2 processes", two), ("a task that does nothing", empty)):
        middle = 1e3 * statistics.median(values)
        print(f"{name}: {middle:.2f} ms ({1e3 * min(values):.2f} ... {1e3 * max(values):.2f})")
    print(f"2 processes are {statistics.median(one) / statistics.median(two):.2f} times as fast; {sent} bytes are sent")


if __name__ == "__main__":
    main()
