"""``python -m fuzz CASES [FIRST [DOOR]]`` in the folder of the tests: many cases, and the seeds of what went wrong."""

import sys

from fuzz.watch import watched

STEP = 2000

if __name__ == "__main__":
    given = dict(zip(("cases", "first", "door"), sys.argv[1:], strict=False))
    begin, door, failed = int(given.get("first", 1)), given.get("door", ""), 0
    end = begin + int(given["cases"])
    for seed in range(begin, end, STEP):
        found = watched(seed, min(STEP, end - seed), door)
        failed += len(found.wrong)
        print(
            f"seeds from {seed}: {' '.join(f'{what}={count}' for what, count in sorted(found.counts.items()))}",
            flush=True,
        )
        for case, words in found.wrong.items():
            print(f"  {case}: {words}", flush=True)
    sys.exit(1 if failed else 0)
