"""A servo-cylinder under a step of its current: with a stiff supply and with one that sags, to the end of its stroke.

python examples/servo_cylinder/run.py [FOLDER]
"""

import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import vpm

HERE = Path(__file__).resolve().parent
STEP = 1e-4  # s
SHOWN = (0.010, 0.050, 0.100, 0.200)  # s
#: A long hose behind a small accumulator.
SAGGING = {"source": "sagging", "resistance": 2e10, "capacitance": 5e-12}


def main(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    rig = vpm.Model.load(HERE / "rig.toml")
    content = rig.to_dict()
    content["supplies"]["pump"] |= SAGGING
    time = STEP * np.arange(2501)
    current = np.where(time < 0.05, 2e-3, np.where(time < 0.1, -2e-3, 10e-3))
    figure = Figure(figsize=(8.0, 8.0), layout="constrained")
    axes = figure.subplots(4, 1, sharex=True)
    print(
        f"{'supply':10s} {'time ms':>8s} {'place mm':>9s} {'side a bar':>11s} {'side b bar':>11s} {'supply bar':>11s}"
    )
    for name, model, line in (("constant", rig, "-"), ("sagging", vpm.Model.from_dict(content), "--")):
        log = vpm.Experiment.from_arrays(time, {"servo.command": current}, model=model, name=name)
        run = vpm.simulate(model, log, integrator="rosenbrock", substeps=4)  # the end is stiff
        place, supply = 1e3 * run["axis.position"], 1e-5 * run["pump.pressure"]
        sides = {side: 1e-5 * run[f"servo.pressure_{side}"] for side in "ab"}
        for row in np.searchsorted(time, np.array(SHOWN) - 0.5 * STEP):
            shown = (1e3 * time[row], place[row], sides["a"][row], sides["b"][row], supply[row])
            print(f"{name:10s} {shown[0]:8.0f} {shown[1]:9.3f} {shown[2]:11.3f} {shown[3]:11.3f} {shown[4]:11.3f}")
        for axis, values in zip(axes, (place, sides["a"], sides["b"], supply), strict=True):
            axis.plot(1e3 * time, values, line, label=name)
    for axis, label in zip(axes, ("place [mm]", "side a [bar]", "side b [bar]", "supply [bar]"), strict=True):
        axis.set_ylabel(label)
    axes[-1].set_xlabel("time [ms]")
    axes[0].legend()
    figure.savefig(folder / "step.png")
    print(f"wrote {folder / 'step.png'}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "folder", type=Path, nargs="?", default=Path("servo-cylinder-plots"), help="where the pictures go"
    )
    main(parser.parse_args().folder)
