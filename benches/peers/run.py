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

Written by `make peers`; do not edit. Times depend on the machine and on what else runs on it, ratios less so.

```console
$ make peers
$ make bench-counts
```

Measured on {cpu}, {system}, with
{versions}.
Wall time is the least of all repeats, then median and spread (largest less least); CPU time is that of the process, the
least of all repeats, and ratios are ratios of CPU time.

## A flexible arm

Two flexible links under control, 24 s of a slow and a fast motion; one call from Python that runs the whole motion,
with results at 10 Hz. Errors are root mean squares over all samples against converged motions: of the tip in m, of the
strains beside the clamps relative to their own root mean square. The last column says how many times faster the
fastest setting of vpm is that is no worse than this row in the tip and in both strains.

{flexible_arm}
Exudyn runs geometrically exact beam elements of three nodes, compiled without range checks, with symbolic functions for
the references, a modified Newton method with the loosest tolerance that keeps its accuracy (1e-4), with and without a
new Jacobian in each step, one thread, and the fastest of three linear solvers. Its beams can stretch and shear and
their sections have rotary inertia, which is not so in the reference and in vpm: a part of its error. MuJoCo runs rigid
segments with elastic hinges, implicit in the damping. vpm runs the arm of a model file by `vpm.simulate`, with the
integrator `additive` and the hold `cubic`, its links at the level that stands there. The first of the repeats records
its equations and makes machine code of them, which takes a tenth of a second; the least of all repeats is without.

## Elements

The same arm in steps of 1 ms with more and more finite elements per link (geometrically exact, linear in the curvature;
Exudyn: quadratic, three nodes), processor time of a step. `crank_nicolson` and `linearly_implicit` have order 2,
`additive` has order 4.

{elements}
## A servo-cylinder

One second of the servo-cylinder of [hydraulics.md](hydraulics.md), six states, under a current of 0.5 mA from 2 to
50 Hz. Errors are the largest of place and both pressures over rows of 10 ms, relative to the range of each, against the
loop in C in long double at a tolerance of 1e-15. All engines take turns in one run; the time is that of one second.

{servo_chirp}
vpm runs in Rust, with the time of the chirp as a seventh state, from the general laws with exact Jacobians. The loop
in C (`benches/peers/servo_chirp.c`) is the explicit pair of Dormand and Prince, written for this one cylinder, which is
hardly stiff as long as it stays away from its ends and from vapour. CVODES comes with CasADi, with exact Jacobians and
compiled expressions; LSODA with SciPy, its right-hand side compiled by Numba and called through Python. `make chirp`
repeats this table alone.

## A NARX model

A free run of a model of 20 terms, time of one step. All engines take turns in one run, on ready arrays of their own.
The difference is the largest to vpm, on values of about one. sysidentpy's `predict` and the loop in Python run 1000
samples, the others 20 000.

{narx}
## A rigid arm of seven joints

One call from Python, on prepared buffers and ready arrays; then a whole record in one call.

{rigid_chain}
Instructions of one call inside the core, counted by valgrind, which no other load on the machine disturbs:

{instruction_counts}"""


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
