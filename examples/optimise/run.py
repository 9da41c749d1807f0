"""Motions that use the elasticity: a flexible arm, TUDOR, and the jump of the hydraulic leg.

python examples/optimise/run.py arm|tudor|jump [FOLDER]

Each finds its motion, says how exact it is, and draws it. The arms are compared with the fastest motion of rigid links,
played on the flexible machine.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from time import perf_counter

import matplotlib as mpl
import numpy as np

import vpm
from vpm.optimise import Optimum, Task

mpl.use("Agg")

HERE = Path(__file__).resolve().parent
MODELS = {"arm": HERE / "arm.toml", "tudor": HERE.parent / "tudor" / "tudor.toml"}
TASKS = {"arm": HERE / "turn.toml", "tudor": HERE / "tudor.toml", "jump": HERE / "jump.toml"}
#: Detail of links that shows what the search does not know.
FINER = "bezier(5)"
#: What vibrates.
GAUGE = {"arm": "root.strain", "tudor": "gauge_1.strain"}


def tell(text: str) -> None:
    """Every 25th iteration of a search."""
    words = text.rsplit("iteration ", maxsplit=1)[-1]
    if words.split(":")[0].isdigit() and int(words.split(":")[0]) % 25 == 0:
        print(f"  {text}", flush=True)


def residual(found: Optimum, model: vpm.Model, gauge: str) -> float:
    """Strain from crest to trough behind the end of the motion, as a slow drift of the joints leaves it."""
    run = found.play(model)
    behind = run.time >= found.duration + 2.0 * (found.time[1] - found.time[0])
    strain = run[gauge][behind]
    drift = np.polyval(np.polyfit(run.time[behind], strain, 2), run.time[behind])
    return float(np.ptp(strain - drift))


def arm(name: str, folder: Path) -> None:
    """The fastest motion with the elasticity beside that of rigid links."""
    task = Task.load(TASKS[name])
    whole = vpm.Model.load(MODELS[name])
    model, start = task.machine(whole), perf_counter()
    found = vpm.optimise(whole, task, progress=tell)
    print(f"{found}\n  found in {perf_counter() - start:.0f} s")
    content = task.content
    content.pop("level", None)
    known = {*model.at("rigid").state_names, *model.at("rigid").output_channels}
    content["limits"] = {key: value for key, value in content["limits"].items() if key.removesuffix(".rate") in known}
    stiff = vpm.optimise(model.at("rigid"), content)
    print(f"rigid links: {stiff.duration:.4f} s, flexible links: {found.duration:.4f} s")
    left = [residual(one, model, GAUGE[name]) for one in (found, stiff)]
    share = 100.0 * left[0] / left[1]
    print(f"residual strain {left[0]:.3g} beside {left[1]:.3g} of the motion of rigid links: {share:.3f} %")
    finer = residual(found, whole.at(FINER), GAUGE[name])
    print(f"played on links of {FINER}, whose modes the search did not know: {100.0 * finer / left[1]:.1f} %")
    keep(found, name, folder)


def jump(folder: Path) -> None:
    """The leg from its crouch to the apex of its flight."""
    start = perf_counter()
    found = vpm.optimise(vpm.Model.load(HERE.parent / "hyl" / "hydraulic.toml"), TASKS["jump"], progress=tell)
    print(f"{found}\n  found in {perf_counter() - start:.0f} s")
    height = found["slider.position"][found.time <= found.duration]
    print(f"the hip rises from {height[0]:.4f} m to {height[-1]:.4f} m")
    stance = found.durations["stance"]
    for drive in ("hip_drive", "knee_drive"):
        pressed = found[f"{drive}.pressure_a"][found.time <= stance]
        print(
            f"{drive}: chamber a from {1e-5 * pressed[0]:.0f} bar, at most {1e-5 * pressed.max():.0f} bar in the stance"
        )
    keep(found, "jump", folder)


def keep(found: Optimum, name: str, folder: Path) -> None:
    """The log and the picture."""
    found.to_csv(folder / f"{name}.csv")
    found.plot().savefig(folder / f"{name}.png", dpi=150)


def main() -> None:
    """Run one of them."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("which", choices=TASKS)
    parser.add_argument("folder", type=Path, nargs="?", default=Path())
    given = parser.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    if given.which == "jump":
        jump(given.folder)
    else:
        arm(given.which, given.folder)


if __name__ == "__main__":
    main()
