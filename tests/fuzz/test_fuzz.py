"""About 600 damaged files in every test run; `make fuzz CASES=100000` takes more."""

import subprocess
import sys
from pathlib import Path

import pytest


@pytest.mark.skipif(sys.platform != "linux", reason="needs processes with limits as Linux has them")
def test_damaged_input_is_refused_or_gives_finite_numbers() -> None:
    """In a program of its own, which has no threads when it forks."""
    command = [sys.executable, "-m", "fuzz", "600"]
    done = subprocess.run(command, cwd=Path(__file__).parents[1], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    counts = dict(word.split("=") for word in done.stdout.split(": ")[1].split())
    assert int(counts["refused"]) > 150
    assert int(counts["accepted"]) > 30
