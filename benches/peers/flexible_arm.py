"""Error and time of a flexible two-link arm, side by side with other engines.

    python benches/peers/flexible_arm.py [--repeats 5] [--quick] [--markdown FILE]

24 s of two motions; the error is that against converged motions, at 10 Hz. Other engines take part where they are
installed: pip install "vpm-dynamics[peers]".
"""

from __future__ import annotations

import argparse
import math
import statistics
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "tests" / "support"), str(ROOT / "benches" / "peers")]

import markdown  # noqa: E402
import vpm  # noqa: E402
from reference_arm import P, errors, log, tip_and_strains  # noqa: E402
from validation.machines import arm  # noqa: E402

Array = NDArray[np.float64]
Run = Callable[[], tuple[Array, Array]]

MOTIONS = ("slow", "fast")
#: Level of both links and step (s).
OWN = (
    ("strain(3)", 12.5e-3),
    ("strain(3)", 1e-2),
    ("strain(4)", 1e-2),
    ("strain(4)", 5e-3),
    ("bezier(4)", 1e-2),
    ("bezier(5)", 1e-2),
    ("bezier(5)", 5e-3),
    ("bezier(6)", 5e-3),
)
#: Elements per link, step (s), and whether each step renews the Jacobian.
EXUDYN = ((2, 2e-3, False), (2, 1e-3, False), (2, 1e-3, True), (4, 2e-3, False), (4, 1e-3, False), (4, 1e-3, True))
#: Steps (s).
MUJOCO = (1e-3, 5e-4)
#: What the arm has to reach with 24 s in 45 ms.
GOAL = {"tip": 3e-5, "strains": (4e-4, 2.5e-3), "ms": 45.0}


@dataclass(frozen=True)
class Row:
    """One engine with one setting on one motion: errors, and seconds of each repeat."""

    engine: str
    setting: str
    motion: str
    tip: float
    strains: tuple[float, float]
    wall: tuple[float, ...]
    cpu: tuple[float, ...]

    def no_worse_than(self, other: Row) -> bool:
        pairs = zip((self.tip, *self.strains), (other.tip, *other.strains), strict=True)
        return all(own <= theirs for own, theirs in pairs)

    @property
    def meets_goal(self) -> bool:
        strains = all(found <= allowed for found, allowed in zip(self.strains, GOAL["strains"], strict=True))
        return self.tip <= GOAL["tip"] and strains and 1e3 * min(self.cpu) <= GOAL["ms"]


def measure(engine: str, setting: str, motion: str, prepare: Callable[[], Run], repeats: int) -> Row:
    """Time the runs alone; what is built before is not counted."""
    wall, cpu = [], []
    for _ in range(repeats):
        run = prepare()
        begin, busy = time.perf_counter(), time.process_time()
        tip, strains = run()
        cpu.append(time.process_time() - busy)
        wall.append(time.perf_counter() - begin)
    distance, strain = errors(motion, tip, strains)
    return Row(engine, setting, motion, distance, (float(strain[0]), float(strain[1])), tuple(wall), tuple(cpu))


def own(motion: str, level: str, step: float, integrator: str = "additive") -> Callable[[], Run]:
    model, record = arm(P, level), log(motion, step)
    start = np.zeros(model.core.n_states)

    def run() -> tuple[Array, Array]:
        found = vpm.simulate(model, record, integrator=integrator, hold="cubic", initial_state=start)
        return tip_and_strains(found)

    return lambda: run


def rows(repeats: int, quick: bool) -> Iterator[Row]:
    for motion in MOTIONS:
        for level, step in OWN:
            setting = f"{level}, {1e3 * step:g} ms"
            yield measure("vpm", setting, motion, own(motion, level, step), 4 * repeats)
        if find_spec("exudyn"):
            from exudyn_arm import ExudynArm, fastest_solver

            for elements, step, renew in EXUDYN[:1] if quick else EXUDYN:
                solver = fastest_solver(elements, step, renew)

                def prepare(
                    arguments: tuple[str, int, float, str] = (motion, elements, step, solver), renew: bool = renew
                ) -> Run:
                    return ExudynArm(*arguments, renew=renew).run

                setting = f"{elements} elements, {1e3 * step:g} ms{', new Jacobian' if renew else ''}, {solver}"
                yield measure("Exudyn", setting, motion, prepare, repeats)
        if find_spec("mujoco"):
            from mujoco_arm import SEGMENTS, MujocoArm

            for step in MUJOCO[:1] if quick else MUJOCO:
                arm = MujocoArm(motion, step)
                setting = f"{SEGMENTS} segments, {1e3 * step:g} ms"
                yield measure("MuJoCo", setting, motion, lambda arm=arm: arm.run, repeats)


def table(found: list[Row], motion: str) -> str:
    """Rows of a motion, and for each peer how much faster the fastest of ours is that is no worse in any error."""
    head = ("engine, per link", "tip, m", "strain 1", "strain 2", "CPU, ms", "ratio")
    lines = []
    for row in (each for each in found if each.motion == motion):
        ratio, best = faster(row, found)
        against = "" if row.engine == "vpm" else f"{ratio:.0f} ({best.setting})" if best else "none as good"
        errors = (f"{row.tip:.1e}", *(f"{strain:.1e}" for strain in row.strains))
        lines.append((f"{row.engine}, {row.setting}", *errors, f"{1e3 * min(row.cpu):.1f}", against))
    return markdown.table(head, lines)


def faster(row: Row, found: list[Row]) -> tuple[float, Row | None]:
    """How many times as long a row takes as the fastest of ours that is no worse, and which that is."""
    ours = [own for own in found if own.engine == "vpm" and own.motion == row.motion and own.no_worse_than(row)]
    best = min(ours, key=lambda own: min(own.cpu), default=None)
    return (min(row.cpu) / min(best.cpu), best) if best else (math.nan, None)


def noise(found: list[Row]) -> str:
    """How much the load of the machine moved the times."""
    worst = max(statistics.median(row.wall) / min(row.wall) for row in found)
    return f"Medians of the wall times are up to {worst - 1.0:.0%} above the least."


def other(found: list[Row]) -> str:
    """What the slow motion gives, in a sentence."""
    ratios = [faster(row, found)[0] for row in found if row.motion == "slow" and row.engine != "vpm"]
    if not ratios:
        return "No other engine is installed."
    return f"On the slow motion the ratios are {min(ratios):.0f} to {max(ratios):.0f}."


def goal(found: list[Row]) -> str:
    """Which settings reach the goal on every motion."""
    settings = {row.setting for row in found if row.engine == "vpm"}
    good = sorted(
        setting
        for setting in settings
        if all(row.meets_goal for row in found if row.engine == "vpm" and row.setting == setting)
    )
    return (
        f"Within {GOAL['ms']:g} ms of CPU time for 24 s, tip errors of {GOAL['tip']:g} m and strain errors of "
        f"{GOAL['strains'][0]:g} and {GOAL['strains'][1]:g} are reached on both motions by: "
        f"{'; '.join(good) or 'none'}."
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--repeats", type=int, default=5, help="runs of each peer; ours runs four times as often")
    parser.add_argument("--quick", action="store_true", help="one setting of each peer")
    parser.add_argument("--markdown", type=Path, help="write the section of the performance page here")
    options = parser.parse_args()
    found = list(rows(options.repeats, options.quick))
    text = f"{table(found, 'fast')}\n\n{other(found)} {goal(found)} {noise(found)}\n"
    print(table(found, "slow"), text, sep="\n\n")
    if options.markdown:
        options.markdown.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
