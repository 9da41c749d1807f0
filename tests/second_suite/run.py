"""Ask a solver for the frozen cases of the second suite, and count its points.

    python -m tests.second_suite.run --list
    python -m tests.second_suite.run --solver diagnose --seeds 0 --machine belt
    python -m tests.second_suite.run --solver module.function --case belt:backlash@axis:3

A solver is a function of the model, the records to learn from and those to judge by; it answers with a list of
(effect, site). ``diagnose`` and ``rank`` are those of vpm. One process works on one core; run several side by side.
"""

import argparse
import os
import sys
from pathlib import Path

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from second_suite.cases import DEV, FRESH, MACHINES, frozen, make_case, requests  # noqa: E402  # the path comes first
from second_suite.score import Answer, answered, table  # noqa: E402
from second_suite.solvers import found  # noqa: E402


def main() -> None:
    """Read the command line, work, and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--solver", default="diagnose", help="diagnose, rank, or the dotted name of a function")
    parser.add_argument("--seeds", help=f"such as 1 or 0-2; {DEV.start}-{DEV.stop - 1} by default")
    parser.add_argument("--fresh", action="store_true", help="allow fresh seeds: only for what is finished")
    parser.add_argument("--machine", action="append", choices=sorted(MACHINES), help="one machine; all by default")
    parser.add_argument("--kind", action="append", choices=["single", "pair", "outside", "none", "parameters"])
    parser.add_argument("--case", action="append", help="MACHINE:REQUEST:SEED, instead of the frozen cases")
    parser.add_argument("--list", action="store_true", help="only say which cases there are")
    chosen = parser.parse_args()
    if chosen.case:
        jobs = [(machine, request, int(seed)) for machine, request, seed in (c.split(":") for c in chosen.case)]
    else:
        jobs = [
            (machine, request, seed)
            for machine, request, seed in frozen(_seeds(chosen.seeds) if chosen.seeds else DEV)
            if machine in (chosen.machine or MACHINES)
            and (not chosen.kind or requests(machine)[request] in chosen.kind)
        ]
    allowed = FRESH if chosen.fresh else DEV
    if strange := {seed for *_, seed in jobs} - set(allowed):
        parser.error(f"seeds {sorted(strange)} are not of {allowed}, see --fresh")
    if chosen.list:
        print("\n".join(f"{machine} {seed} {request}" for machine, request, seed in jobs), f"\n{len(jobs)} cases")
        return
    solver = found(chosen.solver)
    answers: list[Answer] = []
    for job in jobs:
        answers.append(answered(make_case(*job), solver))
        print(answers[-1].line, flush=True)
    if answers:
        print(table(answers))


def _seeds(text: str) -> range:
    low, _, high = text.partition("-")
    return range(int(low), int(high or low) + 1)


if __name__ == "__main__":
    main()
