"""Time whole diagnoses, all effects of the catalogue: an axis with one effect and with three, and a flexible arm.

The axis moves by closed forms, 25 s at 1 kHz in all, or 25 s in each of two records with three effects hidden: the load
of a measured positioning axis such as EMPS, whose logs are not in the repository. The flexible arm of two links, about
20 s at 500 Hz, is one of the proving ground's, which other code simulates. The table goes into docs/performance.md
between two marks; `make bench-diagnosis` runs this.
"""

from __future__ import annotations

import os
import platform
import sys
import time
from argparse import ArgumentParser
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path[:0] = [str(ROOT / "benches" / "peers"), str(ROOT / "tests"), str(ROOT / "tests" / "support")]

import vpm  # noqa: E402
from blind import make_cases  # noqa: E402
from model_texts import DAMPED_AXIS, changed  # noqa: E402
from run import processor  # noqa: E402

PAGE = ROOT / "docs" / "performance.md"
BEGIN, END = "<!-- begin of make bench-diagnosis -->\n", "<!-- end of make bench-diagnosis -->\n"
SECTION = """## A diagnosis

Written by `make bench-diagnosis` on {cpu}, {system}, {repeats} repeats, beside {load:.0f} processes of others.
What was found; least wall time (median, spread), CPU time of all threads.

{rows}
"""

Array = NDArray[np.float64]
Diagnose = Callable[[], vpm.Diagnosis]


def axis() -> tuple[str, Diagnose]:
    model, logs = believed_axis(), [axis_record(1, 15.0), axis_record(2, 10.0)]
    return _said("axis, coulomb_friction", logs), lambda: vpm.diagnose(model, logs[0], logs[1])


def axis_of_three() -> tuple[str, Diagnose]:
    more = {"bias": 0.15, "difference": 0.2}
    model, logs = believed_axis(), [axis_record(seed, 25.0, **more) for seed in (1, 2)]
    return _said("axis, three effects", logs), lambda: vpm.diagnose(model, logs[0], logs[1])


def believed_axis() -> vpm.Model:
    """What the user believes: mass and friction are off."""
    nominal = (
        ("value = 2.0, uncertainty = 0.2", "value = 1.8, uncertainty = 0.4"),
        ("value = 3.0, uncertainty = 1.0", "value = 2.5, uncertainty = 1.0"),
    )
    return changed(DAMPED_AXIS, *nominal)


def axis_record(seed: int, seconds: float, bias: float = 0.0, difference: float = 0.0) -> vpm.Experiment:
    """Sines by closed forms, with friction, noise of an encoder and of a drive whose command holds for a sample."""
    generator, step = np.random.default_rng(seed), 1e-3
    time = step * np.arange(round(seconds / step), dtype=np.float64)
    rates, phases = 2.0 * np.pi * generator.uniform(0.2, 2.5, 6), generator.uniform(0.0, 2.0 * np.pi, 6)

    def wave(order: int, at: Array) -> Array:
        turned = rates[:, None] * at + phases[:, None] + 0.5 * np.pi * order
        return np.asarray(np.sum((0.3 / (1.0 + rates) * rates**order)[:, None] * np.sin(turned), axis=0))

    middle = time + 0.5 * step
    speed = wave(1, middle)
    direction = np.tanh(speed / 2e-3)
    effort = 2.0 * wave(2, middle) + 3.0 * speed + 0.8 * direction
    effort += bias + 0.5 * difference * (direction + 3.0 * speed) * direction
    values = {
        "axis.position": wave(0, time) + 2e-6 * generator.standard_normal(time.size),
        "drive.command": effort + 0.02 * generator.standard_normal(time.size),
    }
    return vpm.Experiment.from_arrays(time, values, units={"axis.position": "m", "drive.command": "N"}, name=f"{seed}")


def flexible_arm() -> tuple[str, Diagnose]:
    (case,) = make_cases("flexible_arm", [("coulomb_friction", 3)])
    logs = [case.train[0], case.validate[0]]
    model = case.model()
    return _said("flexible arm, coulomb_friction", logs), lambda: vpm.diagnose(model, logs[0], logs[1])


MACHINES = (axis, axis_of_three, flexible_arm)


def _said(name: str, logs: list[vpm.Experiment]) -> str:
    spans = " + ".join(f"{log.time[-1] - log.time[0]:.0f}" for log in logs)
    return f"{name}, {spans} s at {logs[0].rate:g} Hz"


def timed(diagnose: Diagnose, repeats: int) -> tuple[list[float], float, vpm.Diagnosis]:
    walls, cpus = [], []
    for _ in range(repeats):
        wall, cpu = time.perf_counter(), time.process_time()
        why = diagnose()
        walls.append(time.perf_counter() - wall)
        cpus.append(time.process_time() - cpu)
    return walls, min(cpus), why


def main() -> None:
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--write", action="store_true", help="write the section of docs/performance.md")
    parser.add_argument("--only", choices=[make.__name__ for make in MACHINES], help="one of the machines")
    options = parser.parse_args()
    rows = []
    for make in MACHINES:
        if options.only not in {None, make.__name__}:
            continue
        name, diagnose = make()
        walls, cpu, why = timed(diagnose, options.repeats)
        found = ", ".join(f"{effect.name} at {effect.site}" for effect in why.effects) or why.verdict
        spread = f"{np.median(walls):.1f}, {max(walls) - min(walls):.1f}"
        rows.append(f"- {name}: {found}; {min(walls):.1f} s ({spread}), {cpu:.1f} s")
        print(rows[-1], flush=True)
    text = "\n".join(rows)
    system = f"{platform.system()}, Python {platform.python_version()}"
    section = SECTION.format(
        cpu=processor(), system=system, repeats=options.repeats, rows=text, load=os.getloadavg()[0]
    )
    if options.write:
        page = PAGE.read_text(encoding="utf-8")
        before, _, rest = page.partition(BEGIN)
        after = rest.partition(END)[2]
        PAGE.write_text(f"{before.rstrip()}\n\n{BEGIN}{section}{END}{after}", encoding="utf-8")


if __name__ == "__main__":
    main()
