"""Write docs/performance.md: run the benchmarks beside other engines and put their tables into one page."""

from __future__ import annotations

import platform
import shutil
import subprocess
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).resolve().parent.parent.parent

#: Where the section begins that another benchmark writes.
DIAGNOSIS = "<!-- begin of make bench-diagnosis -->"

PAGE = """# Performance beside other engines

With this page you can judge how fast and how exact vpm is beside other engines, and measure it again. It is written
by `make peers`; do not edit. Times depend on the machine and its load, ratios less so.

```console
$ make peers
$ make bench-counts
```

Measured on {cpu}, {system}, with {versions}.
CPU and wall times are the least of all repeats; ratios are those of CPU time.

## A flexible arm

Two flexible links under control, 24 s, results at 10 Hz; the table has the fast motion. Errors are root mean squares
against a converged motion: of the tip in m, of the strains relative to their own. The ratio is to the fastest setting
of vpm that is no worse in any error.

{flexible_arm}
Exudyn: geometrically exact elements of three nodes, symbolic references, modified Newton with the loosest tolerance
that keeps its accuracy, one thread, the fastest of three solvers. Its beams stretch and shear and have rotary
inertia, a part of its error. MuJoCo: rigid segments with hinges. vpm: `additive` with the hold `cubic`, without the
first run, which makes machine code in a tenth of a second.

## Elements

The same arm in steps of 1 ms with more and more finite elements per link (geometrically exact, linear in the curvature;
Exudyn: quadratic, three nodes), processor time of a step. `crank_nicolson` and `linearly_implicit` have order 2,
`additive` has order 4.

{elements}
## A servo-cylinder

One second of the servo-cylinder of [hydraulics.md](hydraulics.md) under a current of 0.5 mA from 2 to 50 Hz. Errors
are the largest of position and pressures over rows of 10 ms, relative to their range, against the loop in C in long
double at 1e-15. Engines take turns.

{servo_chirp}
vpm runs the general laws with exact Jacobians; the loop in C (`benches/peers/servo_chirp.c`) is written for this one
cylinder, away from its ends and from vapour. CVODES comes with CasADi, compiled; LSODA with SciPy, its right-hand
side compiled by Numba. `make chirp` repeats this table.

## A NARX model

A simulation of a model of 20 terms, time of one step, on ready arrays. sysidentpy and the loop in Python run 1000
samples, the others 20 000.

{narx}
## A rigid arm of seven joints

One call from Python, on prepared buffers and ready arrays; then a whole record in one call.

{rigid_chain}
Instructions of one call inside the core, counted by valgrind: {instruction_counts}"""


def installed(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"


def processor() -> str:
    lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines() if Path("/proc/cpuinfo").exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return f"{names[0]}, {len(names)} threads" if names else platform.processor()


def section(name: str, folder: Path) -> str:
    if name == "instruction_counts" and shutil.which("valgrind") is None:
        return "valgrind is not installed, so nothing was counted.\n"
    target = folder / f"{name}.md"
    command = [sys.executable, str(ROOT / "benches" / "peers" / f"{name}.py"), "--markdown", str(target)]
    subprocess.run(command, check=True, cwd=ROOT)  # noqa: S603
    return target.read_text(encoding="utf-8")


def main() -> None:
    with TemporaryDirectory() as folder:
        names = ("flexible_arm", "elements", "servo_chirp", "narx", "rigid_chain", "instruction_counts")
        sections = {name: section(name, Path(folder)) for name in names}
    engines = {"vpm": "vpm-dynamics", "Exudyn": "exudyn", "MuJoCo": "mujoco", "Pinocchio": "pin"}
    engines |= {"CasADi": "casadi", "SciPy": "scipy", "Numba": "numba", "sysidentpy": "sysidentpy"}
    versions = ", ".join(f"{name} {installed(package)}" for name, package in engines.items())
    system = f"{platform.system()}, Python {platform.python_version()}"
    target = ROOT / "docs" / "performance.md"
    # The section of `make bench-diagnosis` stays as it is.
    diagnosis = target.read_text(encoding="utf-8").partition(DIAGNOSIS)
    page = PAGE.format(cpu=processor(), system=system, versions=versions, **sections)
    target.write_text("\n".join([page, diagnosis[1] + diagnosis[2]]) if diagnosis[1] else page, encoding="utf-8")


if __name__ == "__main__":
    main()
