"""Instructions of one call of rnea, crba and aba on an arm of seven joints, counted by valgrind: free of machine noise.

python benches/peers/instruction_counts.py [--markdown FILE]
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path[:0] = [str(ROOT / "benches" / "peers")]


CALLS = 1000


def program(example: str) -> Path:
    """An example of the core, compiled where cargo puts it."""
    command = [
        "cargo",
        "build",
        "--release",
        "--package",
        "vpm-core",
        "--example",
        example,
        "--message-format=json",
    ]
    done = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True)  # noqa: S603
    messages = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
    return Path(next(found["executable"] for found in messages if found.get("executable")))


def instructions(binary: Path, algorithm: str, calls: int) -> int:
    command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", str(binary), algorithm, str(calls)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)  # noqa: S603
    found = re.search(r"Collected : (\d+)", done.stderr)
    if found is None:
        raise SystemExit(f"valgrind counted nothing: {done.stderr}")
    return int(found[1])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--markdown", type=Path, help="write the section of the performance page here")
    options = parser.parse_args()
    if shutil.which("valgrind") is None:
        raise SystemExit("the counts need valgrind, which is not here; install your system's package valgrind")
    binary, lines = program("recursions"), []
    for algorithm in ("rnea", "crba", "aba"):
        count = (instructions(binary, algorithm, CALLS) - instructions(binary, algorithm, 0)) / CALLS
        lines.append(f"{algorithm} {count:.0f}")
    text = ", ".join(lines) + ".\n"
    print(text)
    if options.markdown:
        options.markdown.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
