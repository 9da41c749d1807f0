"""Time of a step by the number of elements of each link, side by side with Exudyn.

    python benches/peers/elements.py [--repeats 5] [--markdown FILE]

The two-link arm of `flexible_arm.py` in steps of 1 ms, from a model file through `vpm.simulate`; Exudyn runs its
geometrically exact beams of three nodes with the settings of `exudyn_arm.py`. Then the whole fast motion: each engine
takes the steps that it likes, and the fastest of ours that is no worse than Exudyn's is compared. TUDOR has links that
bend in two directions and twist.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "tests" / "support"), str(ROOT / "benches" / "peers")]

import flexible_arm  # noqa: E402
import markdown  # noqa: E402
import vpm  # noqa: E402
from reference_arm import P, log  # noqa: E402
from validation.machines import arm  # noqa: E402

ELEMENTS = (2, 5, 10, 20, 40)
STEP, SAMPLES = 1e-3, 1000
INTEGRATORS = ("additive", "crank_nicolson", "linearly_implicit")
#: Integrator and step (s) of the whole motion.
OWN = (("additive", 1e-2), ("additive", 5e-3), ("crank_nicolson", 2e-3), ("crank_nicolson", 1e-3))
TUDOR = ROOT / "examples" / "tudor" / "tudor.toml"
BOTH = (
    "The fast motion of 24 s at like accuracy: Exudyn in steps of 1 ms, beside the fastest setting of vpm that is no "
    "worse in the tip and in both strains."
)
#: Elements per link of TUDOR.
FINE = 20


def least(run: Callable[[], object], repeats: int) -> float:
    """Processor time (us) of a step: the least of all repeats, the first of which compiles."""
    times = []
    for _ in range(repeats + 1):
        begin = time.process_time()
        run()
        times.append(time.process_time() - begin)
    return 1e6 * min(times) / SAMPLES


def own(model: vpm.Model, record: vpm.Experiment, integrator: str) -> Callable[[], object]:
    """A run of as many steps as samples: machine code is made by the first."""
    start = np.zeros(model.core.n_states)
    return lambda: vpm.simulate(model, record, integrator=integrator, initial_state=start)


def exudyn(elements: int) -> float:
    from exudyn_arm import ExudynArm, fastest_solver

    duration = STEP * SAMPLES
    best = np.inf
    for renew in (False, True):
        solver = fastest_solver(elements, STEP, renew)
        for _ in range(2):
            machine = ExudynArm("fast", elements, STEP, solver, renew=renew, duration=duration)
            begin = time.process_time()
            machine.run()
            best = min(best, time.process_time() - begin)
    return 1e6 * best / SAMPLES


def growth(times: dict[int, float], low: int, high: int) -> float:
    """Power of the number of elements with which the time grows."""
    return float(np.log(times[high] / times[low]) / np.log(high / low))


def arm_table(repeats: int) -> str:
    record = log("fast", STEP)
    short = vpm.Experiment.from_arrays(
        record.time[: SAMPLES + 1], {name: record[name][: SAMPLES + 1] for name in record.channels}, name="fast"
    )
    found: dict[str, dict[int, float]] = {name: {} for name in INTEGRATORS}
    peer: dict[int, float] = {}
    for count in ELEMENTS:
        model = arm(P, f"elements({count})")
        for integrator in INTEGRATORS:
            found[integrator][count] = least(own(model, short, integrator), repeats)
        if find_spec("exudyn"):
            peer[count] = exudyn(count)
    columns = {**found, **({"Exudyn": peer} if peer else {})}
    head = ("elements per link", *(f"{name}, us" for name in columns), "Exudyn / crank_nicolson")
    rows = []
    for count in ELEMENTS:
        ratio = f"{peer[count] / found['crank_nicolson'][count]:.1f}" if peer else "not installed"
        rows.append((str(count), *(f"{times[count]:.1f}" for times in columns.values()), ratio))
    rows.append(("growth from 10 to 40", *(f"n^{growth(times, 10, 40):.2f}" for times in columns.values()), ""))
    return markdown.table(head, rows)


def accuracy_table(repeats: int) -> str:
    """The fast motion of 24 s: Exudyn in steps of 1 ms, and the fastest of ours that is no worse in any error."""
    from exudyn_arm import ExudynArm, fastest_solver

    head = ("elements", "setting of vpm", "tip of Exudyn and vpm, m", "CPU of both, ms", "ratio")
    lines = []
    for count in ELEMENTS:
        solver = fastest_solver(count, STEP, renew=False)

        def prepare(count: int = count, solver: str = solver) -> flexible_arm.Run:
            return ExudynArm("fast", count, STEP, solver, renew=False).run

        theirs = flexible_arm.measure("Exudyn", f"1 ms, {solver}", "fast", prepare, min(repeats, 2))
        rows = [
            flexible_arm.measure(
                "vpm",
                f"{integrator}, {1e3 * step:g} ms",
                "fast",
                flexible_arm.own("fast", f"elements({count})", step, integrator),
                repeats,
            )
            for integrator, step in OWN
        ]
        good = [row for row in rows if row.no_worse_than(theirs)]
        best = min(good, key=lambda row: min(row.cpu)) if good else None
        setting, tip, cpu, ratio = ("none as good", f"{theirs.tip:.1e}", f"{1e3 * min(theirs.cpu):.0f}", "")
        if best:
            setting, ratio = best.setting, f"{min(theirs.cpu) / min(best.cpu):.0f}"
            tip, cpu = f"{tip}, {best.tip:.1e}", f"{cpu}, {1e3 * min(best.cpu):.0f}"
        lines.append((str(count), setting, tip, cpu, ratio))
    return markdown.table(head, lines)


def tudor_sentence(repeats: int) -> str:
    content = vpm.Model.load(TUDOR).to_dict()
    beams = {name: {**beam, "level": f"elements({FINE})"} for name, beam in content["beams"].items()}
    model = vpm.Model.from_dict({**content, "beams": beams})
    time_ = STEP * np.arange(SAMPLES + 1)
    commands = {f"{name}.command": 0.1 * np.sin(5.0 * time_) for name in model.actuators}
    record = vpm.Experiment.from_arrays(time_, commands, model=model, name="sine")
    times = {name: least(own(model, record, name), min(repeats, 2)) for name in INTEGRATORS}
    told = ", ".join(f"{value:.0f} us by {name}" for name, value in times.items())
    return f"TUDOR with {FINE} elements per link ({len(model.coordinates)} coordinates): a step takes {told}."


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--repeats", type=int, default=5, help="runs of each setting")
    parser.add_argument("--markdown", type=Path, help="write the section of the performance page here")
    options = parser.parse_args()
    parts = [arm_table(options.repeats), tudor_sentence(options.repeats)]
    if find_spec("exudyn"):
        parts.append(f"{BOTH}\n\n{accuracy_table(options.repeats)}")
    text = "\n\n".join(parts) + "\n"
    print(text)
    if options.markdown:
        options.markdown.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
