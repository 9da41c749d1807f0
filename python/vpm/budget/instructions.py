"""Machine instructions of a step, counted by valgrind: the same on every run, whatever else the machine does.

A process of its own makes a few steps and a process more makes many; the difference is that of the steps alone.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from vpm.errors import SimulationError
from vpm.model import Model
from vpm.numbers import Array
from vpm.simulate import Setup

#: Steps of the one process.
FEW = 100
#: Computing time of the steps that the other process makes more, s: enough to hide what two interpreters differ by.
WORK = 0.2
LEAST, MOST = 100, 500_000
#: Environment that makes two runs of the interpreter alike.
FIXED = {"PYTHONHASHSEED": "0", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}


def count_instructions(
    model: Model,
    rate: float,
    setup: Setup,
    inputs: Array,
    seconds: float,
    tell: Callable[[str], None] | None = None,
    *,
    compiled: bool = False,
) -> float:
    """Instructions of a step that takes about so many ``seconds``; ``compiled`` to machine code, if it is to be.

    Raises
    ------
    SimulationError
        There is no valgrind, or it counted nothing.
    """
    if shutil.which("valgrind") is None:
        raise SimulationError(
            "instructions are counted by valgrind, which is not here; install your system's package valgrind"
        )
    if tell:
        tell("counting the instructions of a step with valgrind")
    method = setup.method(model, bounded=True)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "steps.npz"
        np.savez(
            path,
            description=model.description(),
            theta=model.theta,
            state=model.state(),
            inputs=inputs,
            method=method,
            time_step=1.0 / rate,
            substeps=setup.substeps,
            compiled=compiled,
        )
        more = int(min(max(WORK / seconds, LEAST), MOST))
        running = [_start(path, count) for count in (FEW, FEW + more)]
        few, many = (_collected(process) for process in running)
    return (many - few) / more


def _start(path: Path, count: int) -> subprocess.Popen[str]:
    command = [
        "valgrind",
        "--tool=callgrind",
        "--callgrind-out-file=/dev/null",
        sys.executable,
        "-P",
        str(Path(__file__).with_name("watched.py")),
        str(path),
    ]
    environment = {**os.environ, **FIXED}
    return subprocess.Popen(  # noqa: S603
        [*command, str(count)], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, env=environment
    )


def _collected(process: subprocess.Popen[str]) -> int:
    _, said = process.communicate()
    found = re.search(r"Collected : (\d+)", said)
    if process.returncode or found is None:
        raise SimulationError(f"valgrind counted nothing ({said.strip().splitlines()[-1:]}); count on another machine")
    return int(found[1])
