"""Lines that the tests run, by room of the package and of the core: the table of ``make coverage``.

::

    python covered.py python.json core.json     # exit code 1 below the bound

The first is what ``coverage json`` writes, the second a summary of ``cargo llvm-cov --json``. Needs nothing but Python.
"""

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

#: Share of the lines of the package, and of those of the core, that the tests have to run, %.
BOUND = 90.0


class Lines(NamedTuple):
    """Lines that can run, and those that did."""

    all: int
    run: int

    def __str__(self) -> str:
        return f"{self.all:7d} {self.run:7d} {self.percent:6.1f} %"

    @property
    def percent(self) -> float:
        """Share of the lines that ran; nothing is missing where there are none."""
        return 100.0 * self.run / self.all if self.all else 100.0


def of_python(text: dict[str, Any]) -> Iterator[tuple[str, Lines]]:
    """Files of the package."""
    for name, file in text["files"].items():
        yield name, Lines(file["summary"]["num_statements"], file["summary"]["covered_lines"])


def of_core(text: dict[str, Any]) -> Iterator[tuple[str, Lines]]:
    """Files of the core."""
    for file in text["data"][0]["files"]:
        lines = file["summary"]["lines"]
        yield file["filename"], Lines(lines["count"], lines["covered"])


def room(name: str, top: str) -> str:
    """The folder of a file below the top one, or its own name; commands are one room. Empty for files elsewhere."""
    parts = Path(name.partition(top)[2]).parts
    if len(parts) != 1:
        return parts[0] if parts else ""
    own, _, kind = Path(parts[0]).stem.rpartition("_")
    return "commands" if own and kind == "command" else parts[0]


def rooms(files: Iterator[tuple[str, Lines]], top: str) -> dict[str, Lines]:
    """Lines by room."""
    found: dict[str, Lines] = {}
    for name, lines in files:
        if where := room(name, top):
            before = found.get(where, Lines(0, 0))
            found[where] = Lines(before.all + lines.all, before.run + lines.run)
    return found


def main(python: Path, core: Path) -> int:
    """Print the table. Exit code 1 where the package or the core is below the bound."""
    enough = True
    for path, read, top in ((python, of_python, "python/vpm/"), (core, of_core, "crates/vpm-core/src/")):
        found = rooms(read(json.loads(path.read_text(encoding="utf-8"))), top)
        whole = Lines(sum(lines.all for lines in found.values()), sum(lines.run for lines in found.values()))
        print(f"{top:28}   lines     run")
        for where, lines in sorted(found.items(), key=lambda entry: entry[1].percent):
            print(f"  {where:26}{lines}")
        print(f"  {'all':26}{whole}\n")
        if not found or whole.percent < BOUND:
            print(f"tests run {whole.run} of {whole.all} lines of {top}, less than {BOUND:g} %", file=sys.stderr)
            enough = False
    return 0 if enough else 1


if __name__ == "__main__":
    sys.exit(main(*map(Path, sys.argv[1:])))
