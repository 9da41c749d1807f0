"""Diagnose cases of the second suite and count what was named.

    python tests/second_suite/run.py --machine belt --effect backlash --effect none --seeds 0-2 --json out.json
    python tests/second_suite/run.py --list

``--diagnose`` takes the dotted name of anything that is called like `vpm.diagnose` and answers like it, so that two
implementations can be scored on the same cases.
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from second_suite.cases import MACHINES, make_case, requests  # noqa: E402  # the path comes first
from second_suite.score import Answer, answered, table, to_dict  # noqa: E402

Job = tuple[str, str, int]


def main() -> None:
    """Read the command line, work, and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--machine", action="append", choices=sorted(MACHINES), help="one machine; all by default")
    parser.add_argument("--effect", action="append", help="effect, effect@site, none, parameters, or several with +")
    parser.add_argument("--kind", action="append", choices=["single", "pair", "outside", "none", "parameters"])
    parser.add_argument("--seeds", default="0", help="such as 0, 0-4 or 1,3")
    parser.add_argument("--workers", type=int, default=1, help="processes, each on one core")
    parser.add_argument("--json", type=Path, help="file for all answers")
    parser.add_argument("--diagnose", default="vpm.diagnose", help="dotted name of the diagnosis")
    parser.add_argument("--list", action="store_true", help="only say which cases there are")
    chosen = parser.parse_args()
    jobs = list(_jobs(chosen.machine, chosen.effect, chosen.kind, _seeds(chosen.seeds)))
    if chosen.list:
        print("\n".join(f"{machine:8} {request} (seed {seed})" for machine, request, seed in jobs))
        return
    answers: list[Answer] = []
    for answer in _answers(jobs, partial(worked, diagnose=chosen.diagnose), chosen.workers):
        answers.append(answer)
        print(_line(answer), flush=True)
        if chosen.json is not None:
            chosen.json.write_text(json.dumps([to_dict(a) for a in answers], indent=1) + "\n", encoding="utf-8")
    if answers:
        print(table(answers))


def worked(job: Job, diagnose: str) -> Answer:
    """Make one case and diagnose it."""
    began = time.process_time()
    case = make_case(*job)
    return answered(case, _found(diagnose), time.process_time() - began)


def _found(dotted: str) -> Callable[..., Any]:
    module, _, function = dotted.rpartition(".")
    found = getattr(importlib.import_module(module), function)
    # One core for each diagnosis: the processor's time is counted.
    return partial(found, workers=1) if dotted == "vpm.diagnose" else partial(found)


def _answers(jobs: list[Job], work: Callable[[Job], Answer], workers: int) -> Iterator[Answer]:
    if workers == 1:
        yield from map(work, jobs)
        return
    with ProcessPoolExecutor(workers) as pool:
        yield from pool.map(work, jobs)


def _jobs(
    machines: list[str] | None, effects: list[str] | None, kinds: list[str] | None, seeds: list[int]
) -> Iterator[Job]:
    for machine in machines or MACHINES:
        for seed in seeds:
            for request, kind in requests(machine).items():
                fits = effects is None or any(e in {request, request.partition("@")[0]} for e in effects)
                if fits and (kinds is None or kind in kinds):
                    yield machine, request, seed


def _seeds(text: str) -> list[int]:
    found: list[int] = []
    for part in text.split(","):
        low, _, high = part.partition("-")
        found += range(int(low), int(high or low) + 1)
    return found


def _line(a: Answer) -> str:
    mark = "!" if a.error else ("+" if a.good else "-") if a.solvable else "~"
    strengths = "/".join(f"{s:.0f}" for s in a.strengths) or "-"
    named = ", ".join(f"{effect}@{site}" for effect, site in a.named) or "-"
    return f"{mark} {a.machine} {a.request} {a.seed} [{strengths}] {a.error or a.verdict}: {named} ({a.seconds:.1f} s)"


if __name__ == "__main__":
    main()
