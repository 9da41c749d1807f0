"""``python -m fuzz CASES [FIRST]`` in the folder of the tests: many cases, and the seeds of what went wrong."""

import sys

from fuzz.watch import watched

STEP = 2000

if __name__ == "__main__":
    cases, first = int(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 1
    failed = 0
    for begin in range(first, first + cases, STEP):
        found = watched(begin, min(STEP, first + cases - begin))
        failed += len(found.wrong)
        print(f"seeds from {begin}: {dict(found.counts)}", flush=True)
        for seed, words in found.wrong.items():
            print(f"  {seed}: {words}", flush=True)
    sys.exit(1 if failed else 0)
