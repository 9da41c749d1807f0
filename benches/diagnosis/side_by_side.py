"""LISDD and vpm side by side on blind cases of a single axis: who is right, and whether that is more than chance.

    python benches/diagnosis/side_by_side.py --seeds 9100-9101 --each 1 --machine axis_linear --machine axis_rotary

Both get the nominal model, two records to fit and one to judge. LISDD looks in both ways, see `lisdd.py`. What counts
as right is what `vpm prove` counts. Cases too weak to be solved are printed and not counted.

Two methods on the same cases are compared by those that one of them alone solves (Q. McNemar, Psychometrika 12, 1947),
with the exact binomial level. `make bench-lisdd` runs this.
"""

from __future__ import annotations

import sys
import time
import warnings
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import groupby
from pathlib import Path

import numpy as np
from scipy.stats import binomtest

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path[:0] = [str(ROOT / "benches" / "peers"), str(ROOT / "tests"), str(ROOT / "tests" / "support")]

from lisdd import WAYS, lisdd  # noqa: E402

from blind import score  # noqa: E402
from blind.answer import Answer, Named  # noqa: E402
from blind.case import Case  # noqa: E402
from blind.proving import KINDS, Job, ask, jobs, make  # noqa: E402
from blind.table import failed  # noqa: E402
from markdown import table  # noqa: E402
from vpm.prove_command import numbers  # noqa: E402

MACHINES = ("axis_linear", "axis_rotary")
VPM = "vpm"
METHODS = (*(f"LISDD, {way}" for way in WAYS), VPM)

#: Answers of all methods to one case, by method.
Answers = dict[str, Answer]


def right(answer: Answer) -> bool:
    """Whether an answer is right by the rules of the proving ground."""
    return not failed(answer)


def counts(answer: Answer) -> bool:
    """Whether anybody could have been right: what is hidden stands clear of the noise, or nothing is hidden."""
    return answer.solvable or not answer.hidden


def answers(todo: Sequence[Job], limit: float) -> Iterator[Answers]:
    """What all methods answer, case by case; cases of one machine and seed are made together."""
    order = sorted(todo, key=lambda job: (MACHINES.index(job.machine), job.seed))
    for _, batch in groupby(order, key=lambda job: (job.machine, job.seed)):
        for made in make(list(batch)):
            case = made[1]
            if case is not None:
                by_vpm = ask(made, limit)
                yield {**{f"LISDD, {way}": by_lisdd(by_vpm, case, way) for way in WAYS}, VPM: by_vpm}


def by_lisdd(like: Answer, case: Case, way: str) -> Answer:
    """The answer of LISDD to the case of another answer."""
    began = time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        finding = lisdd(case.model(), case.train, case.validate, way)
    named = tuple(Named(*pair) for pair in finding.named)
    told = {"verdict": finding.verdict, "named": named, "ranking": named, "rivals": (), "error": "", "late": False}
    return replace(like, **told, seconds=time.process_time() - began)  # type: ignore[arg-type]


def line(found: Answers) -> str:
    """The answers to a case in a line."""
    case = found[VPM]
    hidden = ", ".join(f"{h.name}@{h.site}" for h in case.hidden) or case.request[0]
    strength = f" ({min(case.strengths):.2g})" if case.strengths else ""
    told = "; ".join(f"{method}: {_told(answer)}" for method, answer in found.items())
    return f"{case.machine} {case.seed} {case.kind}, {hidden}{strength} -> {told}"


def _told(answer: Answer) -> str:
    names = ", ".join(n.name for n in answer.named) or answer.verdict or answer.error[:60]
    mark = "right" if right(answer) else "wrong"
    return f"{names} [{mark if counts(answer) else 'too weak'}, {answer.seconds:.1f} s]"


def report(found: Sequence[Answers]) -> str:
    """Tables of all answers."""
    tables = [_rates(found), *(_mcnemar(found, method) for method in METHODS[:-1])]
    return "\n\n".join(tables)


def _rates(found: Sequence[Answers]) -> str:
    def row(name: str, cases: Callable[[Answer], bool], hit: Callable[[Answer], bool]) -> list[str]:
        mine = [[a[method] for a in found if cases(a[method])] for method in METHODS]
        return [name, *(str(score.rate(each, hit)) for each in mine)]

    def of_kind(kind: str) -> Callable[[Answer], bool]:
        return lambda a: a.kind == kind and counts(a)

    rows = [row(kind, of_kind(kind), right) for kind in KINDS]
    rows.append(row("all", counts, right))
    rows.append(row("single, and nothing beside it", of_kind("single"), score.alone))
    rows.append(row("false alarms", lambda a: not a.hidden, score.alarmed))
    seconds = [f"{np.median([a[method].seconds for a in found]):.2f}" for method in METHODS]
    return table(["right", *METHODS], [*rows, ["median time, s", *seconds]])


def _mcnemar(found: Sequence[Answers], method: str) -> str:
    """Fourfold table of a method and vpm, with its level."""
    pairs = [(right(a[method]), right(a[VPM])) for a in found if counts(a[VPM])]
    one, other = pairs.count((True, False)), pairs.count((False, True))
    rows = [
        [f"{method} right", str(pairs.count((True, True))), str(one)],
        [f"{method} wrong", str(other), str(pairs.count((False, False)))],
    ]
    text = table([f"{len(pairs)} cases", "vpm right", "vpm wrong"], rows)
    return f"{text}\n\nMcNemar, exact: p = {level(one, other):.2g}"


def level(one: int, other: int) -> float:
    """Level of McNemar's test, two-sided, of cases that one or the other method alone solves."""
    return float(binomtest(one, one + other).pvalue) if one + other else 1.0


def _options() -> Namespace:
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=numbers, default=(0,), help="for example 9100-9101 or 1,4,7")
    parser.add_argument("--each", type=int, default=1, help="cases of each effect; seeds are dealt out in turn")
    parser.add_argument("--machine", action="append", choices=MACHINES, help="both by default")
    parser.add_argument("--kind", action="append", choices=KINDS, help="all by default")
    parser.add_argument("--limit", type=float, default=120.0, help="longest time of one diagnosis [s]")
    parser.add_argument("--out", type=Path, help="file to which the lines go as they come, and the tables")
    return parser.parse_args()


def main() -> None:
    options = _options()
    todo = jobs(options.machine or MACHINES, (), options.seeds, (1.0,), options.kind or KINDS, options.each)
    found: list[Answers] = []

    def say(text: str) -> None:
        print(text, flush=True)
        if options.out is not None:
            with options.out.open("a", encoding="utf-8") as file:
                file.write(f"{text}\n")

    for answer in answers(todo, options.limit):
        found.append(answer)
        say(f"{len(found)}/{len(todo)}  {line(answer)}")
    say(f"\n{report(found)}")


if __name__ == "__main__":
    main()
