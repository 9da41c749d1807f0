"""One second of a servo-cylinder under a chirp from 2 to 50 Hz: vpm beside a loop in C, CVODES and LSODA.

python benches/peers/servo_chirp.py [--rounds N] [--markdown FILE]

Every round runs every engine. Errors are the largest of place and both pressures over rows of 10 ms, relative to the
range of each, against the loop in C in long double at 1e-15 (without a C compiler: against SciPy's DOP853 at 1e-13).
"""

from __future__ import annotations

import argparse
import ctypes
import json
import math
import shutil
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path[:0] = [str(ROOT / "benches" / "peers")]

import instruction_counts  # noqa: E402
import markdown  # noqa: E402

Array = NDArray[np.float64]
#: Runs so many times; seconds of each run, and place and pressures every 10 ms.
Engine = Callable[[int], tuple[list[float], Array]]
ROWS, REPEATS = 100, 20
SCALES = np.array([1e-2, 1e-2, 1.0, 16.0, 1e5, 1e5])
FIXED = ("linearly_implicit", "rosenbrock", "guarded")
TOLERANCES = (1e-6, 3e-7, 1e-7, 3e-8)


@dataclass
class Entry:
    """A row of the table in the making."""

    engine: str
    setting: str
    run: Engine
    seconds: list[float] = field(default_factory=list)
    rows: Array = field(default_factory=lambda: np.zeros((ROWS, 3)))


def rates(t: float, x: Array) -> Array:
    """Rates of place, spool, velocity, spool rate and pressures; see docs/hydraulics.md."""
    full, ring = 0.25 * math.pi * 0.016**2, 0.25 * math.pi * (0.016**2 - 0.010**2)
    a, b = max(x[4], 1e3), max(x[5], 1e3)
    u = min(max(x[1], -0.01), 0.01)
    gain = 7.5 / 60e3 / (0.01 * math.sqrt(35e5)) * u
    drops = np.array([16e6 - a, b - 1e5] if u > 0.0 else [a - 1e5, 16e6 - b])
    for k in range(2):
        share = drops[k] / 1e4
        if abs(share) < 1.0:
            drops[k] = 1e2 * share * (3.0 - abs(share)) / 2.0
        else:
            drops[k] = math.copysign(math.sqrt(abs(drops[k])), drops[k])
    target = 0.5e-3 * math.sin(2.0 * math.pi * (2.0 + 24.0 * t) * t)
    w, past = 2.0 * math.pi * 250.0, 1.7e-13 * (a - b)
    return np.array(
        [
            x[2],
            x[3],
            (full * a - ring * b - 700.0 * x[2] - 589.927 * x[0]) / 3.0,
            w * w * (min(max(target, -0.01), 0.01) - x[1]) - 1.4 * w * x[3],
            1.2e9 / (2.9e-6 + full * (0.04 + x[0])) * (gain * drops[0] - full * x[2] - past),
            1.2e9 / (2.9e-6 + ring * (0.04 - x[0])) * (ring * x[2] - gain * drops[1] + past),
        ]
    )


def rest() -> Array:
    """The state in which no force acts on the rod."""
    ratio = 1.0 - (10.0 / 16.0) ** 2
    pressure = (16e6 + 1e5) / (1.0 + ratio)
    return np.array([0.0, 0.0, 0.0, 0.0, ratio * pressure, pressure])


def timed(call: Callable[[], Array]) -> Engine:
    def run(repeats: int) -> tuple[list[float], Array]:
        seconds = []
        for _ in range(repeats):
            begin = time.perf_counter()
            rows = call()
            seconds.append(time.perf_counter() - begin)
        return seconds, rows

    return run


def of_vpm(program: Path, integrator: str, rate: int) -> Engine:
    def run(repeats: int) -> tuple[list[float], Array]:
        command = [str(program), integrator, str(rate), str(repeats)]
        found = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)  # noqa: S603
        return found["seconds"], np.array(found["rows"])

    return run


def compiled(folder: Path, *, long: bool = False) -> Callable[[float], Array] | None:
    """The loop in C, as a function of its tolerance."""
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        return None
    target = folder / ("long.so" if long else "plain.so")
    flags = ["-O3", "-march=native", "-shared", "-fPIC", *(["-DLONG"] if long else [])]
    source = str(ROOT / "benches" / "peers" / "servo_chirp.c")
    subprocess.run([compiler, *flags, "-o", str(target), source, "-lm"], check=True)  # noqa: S603
    loop = ctypes.CDLL(str(target)).run
    loop.restype = ctypes.c_long
    loop.argtypes = [ctypes.c_longdouble if long else ctypes.c_double, ctypes.c_int, ctypes.c_void_p]

    def run(tolerance: float) -> Array:
        rows = np.zeros((ROWS, 3))
        if loop(tolerance, ROWS, rows.ctypes.data) < 0:
            raise SystemExit(f"the loop in C did not arrive with a tolerance of {tolerance:g}")
        return rows

    return run


def of_lsoda(tolerance: float) -> Engine:
    from numba import njit
    from scipy.integrate import odeint

    law, times = njit(rates), np.linspace(0.0, 1.0, ROWS + 1)

    def call() -> Array:
        states = odeint(law, rest(), times, tfirst=True, rtol=tolerance, atol=tolerance * SCALES, mxstep=100_000)
        return np.asarray(states[1:, [0, 4, 5]])

    call()
    return timed(call)


def of_cvodes(tolerance: float) -> Engine:
    """CVODES of the SUNDIALS, with exact Jacobians of compiled code, in states that are divided by their sizes."""
    import casadi as ca

    t, y = ca.SX.sym("t"), ca.SX.sym("y", 6)
    x = y * SCALES
    full, ring = 0.25 * math.pi * 0.016**2, 0.25 * math.pi * (0.016**2 - 0.010**2)
    a, b, u = ca.fmax(x[4], 1e3), ca.fmax(x[5], 1e3), ca.fmin(ca.fmax(x[1], -0.01), 0.01)

    def root(drop: ca.SX) -> ca.SX:
        share = drop / 1e4
        turbulent = ca.sign(drop) * ca.sqrt(ca.fmax(ca.fabs(drop), 1.0))
        return ca.if_else(ca.fabs(share) < 1.0, 1e2 * share * (3.0 - ca.fabs(share)) / 2.0, turbulent)

    gain = 7.5 / 60e3 / (0.01 * math.sqrt(35e5)) * u
    into_a = gain * root(ca.if_else(u > 0.0, 16e6 - a, a - 1e5))
    out_of_b = gain * root(ca.if_else(u > 0.0, b - 1e5, 16e6 - b))
    w, past = 2.0 * math.pi * 250.0, 1.7e-13 * (a - b)
    target = 0.5e-3 * ca.sin(2.0 * math.pi * (2.0 + 24.0 * t) * t)
    law = ca.vertcat(
        x[2],
        x[3],
        (full * a - ring * b - 700.0 * x[2] - 589.927 * x[0]) / 3.0,
        w * w * (target - x[1]) - 1.4 * w * x[3],
        1.2e9 / (2.9e-6 + full * (0.04 + x[0])) * (into_a - full * x[2] - past),
        1.2e9 / (2.9e-6 + ring * (0.04 - x[0])) * (ring * x[2] - out_of_b + past),
    )
    options = {"reltol": tolerance, "abstol": tolerance, "max_num_steps": 1_000_000}
    if shutil.which("gcc"):
        options |= {"jit": True, "compiler": "shell", "jit_options": {"flags": ["-O3", "-march=native"]}}
    times = np.linspace(0.0, 1.0, ROWS + 1)
    solver = ca.integrator("chirp", "cvodes", {"t": t, "x": y, "ode": law / SCALES}, 0.0, times[1:], options)

    def call() -> Array:
        states = np.array(solver(x0=rest() / SCALES)["xf"]).T * SCALES
        return np.asarray(states[:, [0, 4, 5]])

    return timed(call)


def reference(folder: Path) -> Array:
    exact = compiled(folder, long=True)
    if exact is not None:
        return exact(1e-15)
    from scipy.integrate import solve_ivp

    times = np.linspace(0.0, 1.0, ROWS + 1)
    found = solve_ivp(rates, (0.0, 1.0), rest(), "DOP853", times, rtol=1e-13, atol=1e-13 * SCALES)
    return np.asarray(found.y.T[1:, [0, 4, 5]])


def entries(folder: Path) -> tuple[list[Entry], list[str]]:
    """All rows to measure, and a sentence for each engine that is not there."""
    program, missing = instruction_counts.program("servo_chirp"), []
    rows = [Entry("vpm", f"{name}, 1 kHz", of_vpm(program, name, 1000)) for name in FIXED]
    rows += [Entry("vpm", f"adaptive({t:g})", of_vpm(program, f"adaptive({t:g})", ROWS)) for t in TOLERANCES]
    loop = compiled(folder)
    if loop is None:
        missing.append("No C compiler is installed, so the loop in C was not measured.")
    else:
        rows += [Entry("C", f"Dormand-Prince, {t:g}", timed(partial(loop, t))) for t in (4e-7, 1e-8, 3e-9)]
    if find_spec("casadi"):
        rows += [Entry("CVODES", f"{t:g}", of_cvodes(t)) for t in (1e-7, 1e-8, 1e-9)]
    else:
        missing.append("CasADi is not installed, so its CVODES was not measured.")
    if find_spec("scipy") and find_spec("numba"):
        rows += [Entry("LSODA", f"{t:g}", of_lsoda(t)) for t in (1e-7, 1e-8, 1e-9)]
    else:
        missing.append("SciPy or Numba is not installed, so LSODA was not measured.")
    return rows, missing


def error(rows: Array, exact: Array) -> float:
    """Largest difference, relative to the largest change of each column."""
    return float(np.max(np.abs(rows - exact).max(axis=0) / np.abs(exact - exact[0]).max(axis=0)))


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--markdown", type=Path, help="write the section of the performance page here")
    options = parser.parse_args()
    with TemporaryDirectory() as name:
        folder = Path(name)
        exact = reference(folder)
        found, missing = entries(folder)
        for _ in range(options.rounds):
            for entry in found:
                seconds, entry.rows = entry.run(REPEATS)
                entry.seconds += seconds
    lines = []
    for entry in found:
        errors = f"{error(entry.rows, exact):.1e}"
        lines.append((f"{entry.engine}, {entry.setting}", errors, f"{1e3 * min(entry.seconds):.2f}"))
    worst = max(statistics.median(entry.seconds) / min(entry.seconds) for entry in found)
    noise = f"Medians are up to {worst - 1.0:.0%} above the least."
    text = "\n\n".join([markdown.table(("engine, setting", "error", "wall, ms"), lines), noise, *missing]) + "\n"
    print(text)
    if options.markdown:
        options.markdown.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
