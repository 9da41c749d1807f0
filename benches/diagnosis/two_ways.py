"""Names by a ranking beside names by the search, on blind cases of machines with oil and with links that bend.

    python benches/diagnosis/two_ways.py --machine flexible_arm --seeds 9700-9702 --out two_ways.json

Both get the same cases, on one core. What counts as right is what `vpm prove` counts. Cases too weak to be solved are
printed and not counted.
"""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Iterator, Sequence
from itertools import groupby
from pathlib import Path
from typing import TypeAlias
from unittest.mock import patch

import numpy as np

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path[:0] = [
    str(ROOT / "benches" / "diagnosis"),
    str(ROOT / "benches" / "peers"),
    str(ROOT / "tests"),
    str(ROOT / "tests" / "support"),
]

from side_by_side import counts, level, right  # noqa: E402

from blind.answer import Answer  # noqa: E402
from blind.proving import KINDS, Job, ask, jobs, line, make, save_json  # noqa: E402
from blind.score import rate  # noqa: E402
from markdown import table  # noqa: E402
from vpm import naming  # noqa: E402
from vpm.prove_command import numbers  # noqa: E402

MACHINES = ("flexible_arm", "servo_cylinder", "hydraulic_leg")
#: Ways to names, and what keeps a machine from a ranking in each.
WAYS = {"search": "names by the search are compared", "ranking": ""}
Pair: TypeAlias = tuple[Answer, Answer]


def answers(todo: Sequence[Job], limit: float, ways: Sequence[str]) -> Iterator[list[Answer]]:
    """Answers in each way, case by case; cases of one machine and seed are made together."""
    order = sorted(todo, key=lambda job: (job.machine, job.seed))
    for _, batch in groupby(order, key=lambda job: (job.machine, job.seed)):
        for made in make(list(batch)):
            found = []
            for way in ways:
                with patch.object(naming, "why_not_ranked", lambda *_, why=WAYS[way]: why):
                    found.append(ask(made, limit))
            yield found


def report(found: Sequence[Pair]) -> str:
    """A row for each machine: how often each way is right, on how many cases they differ, and times."""
    rows = []
    for machine in dict.fromkeys(old.machine for old, _ in found):
        mine = [pair for pair in found if pair[0].machine == machine and counts(pair[0])]
        told = [(right(old), right(new)) for old, new in mine]
        better, worse = told.count((False, True)), told.count((True, False))
        seconds = np.array([(old.seconds, new.seconds) for old, new in mine])
        rates = [str(rate([pair[way] for pair in mine], right)) for way in (0, 1)]
        times = [f"{np.median(seconds[:, way]):.1f}, {seconds[:, way].sum():.0f}" for way in (0, 1)]
        ratio = f"{np.exp(np.mean(np.log(seconds[:, 1] / seconds[:, 0]))):.2f}"
        rows.append([machine, *rates, str(better), str(worse), f"{level(better, worse):.2g}", *times, ratio])
    head = ["machine", "search", "ranking", "better", "worse", "p", "search, s", "ranking, s", "ratio of times"]
    return table(head, rows)


def _options() -> Namespace:
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=numbers, default=(0,), help="for example 9100-9101 or 1,4,7")
    parser.add_argument("--each", type=int, default=1, help="cases of each effect; seeds are dealt out in turn")
    parser.add_argument("--machine", action="append", choices=MACHINES, help="all by default")
    parser.add_argument("--effect", action="append", default=[], help="all by default")
    parser.add_argument("--kind", action="append", choices=KINDS, help="all by default")
    parser.add_argument("--way", action="append", choices=tuple(WAYS), help="both by default")
    parser.add_argument("--take", type=int, help="so many of the cases of a machine, evenly")
    parser.add_argument("--limit", type=float, default=300.0, help="longest time of one diagnosis [s]")
    parser.add_argument("--out", type=Path, help="file for the answers, those of one way after the other")
    return parser.parse_args()


def main() -> None:
    options = _options()
    ways = tuple(options.way or WAYS)
    todo = []
    for machine in options.machine or MACHINES:
        mine = jobs((machine,), options.effect, options.seeds, (1.0,), options.kind or KINDS, options.each)
        step = len(mine) / min(options.take or len(mine), len(mine))
        todo += [mine[int(place)] for place in np.arange(0.0, len(mine), step)]
    found: list[list[Answer]] = []
    for several in answers(todo, options.limit, ways):
        found.append(several)
        for way, answer in zip(ways, several, strict=True):
            print(f"{len(found)}/{len(todo)} {way:8s} {line(answer)}", flush=True)
        if options.out is not None:
            save_json([answer for one in found for answer in one], options.out)
    if len(ways) > 1:
        print(f"\n{report([(old, new) for old, new in found])}")


if __name__ == "__main__":
    main()
