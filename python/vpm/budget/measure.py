"""Times single steps of a model along a command, and says what they are made of."""

import os
import platform
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from vpm.budget.report import REST, BudgetReport, Stage
from vpm.budget.steps import Timed, commands, start_state, time_steps
from vpm.errors import SimulationError
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.numbers import Array
from vpm.realtime import QUANTILES, Loop
from vpm.simulate import AUTOMATIC, Setup

#: States along the way at which the stages are timed.
STATES = 32

#: Steps of the first of two processes whose instructions are counted.
FEW = 100
#: Computing time of the steps that the second one makes more, s: enough to hide what two interpreters differ by.
WORK = 0.2
LEAST, MOST = 100, 500_000
#: Environment that makes two runs of the interpreter alike.
FIXED = {"PYTHONHASHSEED": "0", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}


def budget(
    model: Model,
    *,
    rate: float = 1000.0,
    share: float = 0.2,
    steps: int = 1_000_000,
    integrator: str = AUTOMATIC,
    substeps: int = 1,
    experiment: Experiment | None = None,
    latency: float = 0.0,
    instructions: bool = False,
    priority: int | None = None,
    compiled: bool = True,
    tell: Callable[[str], None] | None = None,
) -> BudgetReport:
    """Measure single steps of a model along a command.

    Parameters
    ----------
    rate : float
        Steps per second that the controller asks for, Hz.
    share : float
        Share of the period that a step may take at its 99.9 % quantile.
    steps : int
        How many steps to time.
    integrator, substeps
        See :class:`vpm.simulate.Setup`; ``auto`` takes steps whose time has a bound.
    experiment : Experiment, optional
        Its commands drive the model, over and over (from its beginning, where contacts or oil do not let any motion
        follow any other); without it a sum of sines at one unit of command does.
    latency : float
        Time, s, to watch how late an idle loop at this rate wakes up; never part of the step times. 0 for not at all.
    instructions : bool
        Count the machine instructions of a step with valgrind, which takes a minute.
    priority : int, optional
        Time the steps as a controller runs: before all ordinary threads, with this priority of ``SCHED_FIFO`` (1 to
        99), if permitted; ``machine`` says whether it was.
    compiled : bool
        Time steps by machine code, as those of the C library and of ``vpm.Simulation(..., compiled=True)`` are; a
        machine that has none is evaluated directly, and the report says why.
    tell : callable, optional
        Told now and then how far it is.

    Raises
    ------
    SimulationError
        A setting has no meaning, the commands do not lead through a simulation, or valgrind is asked for and not there.
    """
    if not rate > 0.0:
        raise SimulationError(f"a rate of {rate:g} Hz is not possible; give a positive number")
    if steps < 1000:
        raise SimulationError(f"{steps} steps are too few for a 99.9 % quantile; time at least 1000")
    if not latency >= 0.0:
        raise SimulationError(f"latency is {latency:g} s; give a time that is not negative")
    setup = Setup(integrator, substeps)
    inputs = commands(model, rate, experiment)
    start = start_state(model, experiment)
    try:
        timed = time_steps(
            model,
            rate,
            setup,
            steps,
            inputs,
            states=STATES,
            tell=tell,
            priority=priority,
            start=start,
            compiled=compiled,
        )
    except SimulationError as error:
        if experiment is not None or not inputs.any():
            raise
        raise SimulationError(
            f"{error}; sums of sines drove it, so give a record of its own commands, experiment= (--log)"
        ) from error
    median = float(np.median(timed.seconds))
    counted = count_instructions(model, rate, setup, inputs, median, tell, compiled=compiled) if instructions else None
    return BudgetReport(
        model_name=model.name,
        integrator=setup.method(model, bounded=True),
        rate=rate,
        steps=steps,
        quantiles={name: float(np.quantile(timed.seconds, q)) for name, q in QUANTILES.items()},
        share=share,
        overruns=int(np.count_nonzero(timed.seconds > 1.0 / rate)),
        stages=_stages(timed),
        allocations=timed.allocations,
        memory=timed.memory,
        instructions=counted,
        latency=_latency(rate, latency, tell) if latency > 0.0 else {},
        machine=describe() + _rank(rate, priority),
        direct=timed.direct,
    )


def _rank(rate: float, priority: int | None) -> str:
    """Priority of the measured thread in words, such as ", at priority 80"; or empty."""
    if priority is None:
        return ""
    with Loop(rate, priority=priority) as loop:
        answer = loop.report().priority_raised
    return f", at priority {priority}" if answer == "yes" else f", at ordinary priority ({answer})"


def _stages(timed: Timed) -> tuple[Stage, ...]:
    """Measured stages of a step, and what the median step takes beside them."""
    parts = [Stage(name, seconds * calls, calls) for name, seconds, calls in timed.stages]
    rest = float(np.median(timed.seconds)) - sum(part.seconds for part in parts)
    return (*parts, Stage(REST, max(rest, 0.0), 1.0))


def _latency(rate: float, seconds: float, tell: Callable[[str], None] | None) -> dict[str, float]:
    """Measured latency: how late a real-time loop without work wakes up."""
    if tell:
        tell(f"watching an idle loop for {seconds:g} s")
    with Loop(rate) as loop:
        for _ in loop.ticks(seconds):
            pass
        return loop.report().latency


def describe() -> str:
    """Machine in words: processor, cores, operating system, and readiness for real time."""
    return ", ".join(part for part in (_processor(), _cores(), _system()) if part)


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def _cores() -> str:
    count = os.cpu_count() or 1
    try:
        load = f" under a load of {os.getloadavg()[0]:.1f}"
    except OSError:
        load = ""
    return f"{count} core{'' if count == 1 else 's'}{load}"


def _system() -> str:
    kernel = f"{platform.system()} {platform.release().partition('-')[0]}"
    realtime = Path("/sys/kernel/realtime")
    if platform.system() != "Linux":
        return kernel
    return kernel + (" with real-time patches" if realtime.is_file() else " without real-time patches")


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
    """Instructions of a step that takes about so many ``seconds``; ``compiled`` to machine code, if it is to be."""
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
