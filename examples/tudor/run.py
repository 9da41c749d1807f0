"""TUDOR under its servos: six motions of joints 2 and 3, with the efforts that gravity asks for fed forward.

python examples/tudor/run.py [FOLDER]
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray

from vpm.experiment import Experiment
from vpm.model import Model
from vpm.simulate import Run, simulate

mpl.use("Agg")
from matplotlib import pyplot as plt

Array = NDArray[np.float64]
Motion = Callable[[Array], Array]

HERE = Path(__file__).resolve().parent
DURATION = 24.0
SAMPLE = 0.004
#: Poses at which the efforts against gravity are worked out, per motion; in between they are interpolated.
POSES = 240


def slow(time: Array) -> Array:
    """From 0 to 0.9 rad and back, twice in the run."""
    return np.asarray(0.45 * (1.0 - np.cos(2.0 * np.pi * time / 12.0)))


def fast(time: Array) -> Array:
    """From 0 to 0.2 rad and back in a second."""
    return np.asarray(0.1 * (1.0 - np.cos(2.0 * np.pi * time)))


#: The shapes are printed (thesis, figure 3.10), amplitudes and frequencies are not: those here are chosen.
MOTIONS: dict[str, tuple[str, Motion, Motion]] = {
    "a": ("both joints slow", slow, slow),
    "b": ("joint 3 faster than joint 2", slow, fast),
    "c": ("joint 2 faster than joint 3", fast, slow),
    "d": ("both joints fast", fast, fast),
    "e": ("opposite, slow", slow, lambda time: -slow(time)),
    "f": ("opposite, fast", fast, lambda time: -fast(time)),
}


def record(model: Model, second: Motion, third: Motion, duration: float = DURATION) -> Experiment:
    """References of the servos, and as disturbances of their commands the efforts that hold the arm at each pose."""
    time = np.arange(round(duration / SAMPLE) + 1) * SAMPLE
    joints = np.column_stack([np.zeros(time.size), second(time), third(time)])
    coarse = np.linspace(0, time.size - 1, round(POSES * duration / DURATION) + 1).astype(int)
    efforts = np.array([model.equilibrium(q)[1] for q in joints[coarse]])
    values = {}
    for column, name in enumerate(("motor_1", "motor_2", "motor_3")):
        values[f"{name}.reference"] = joints[:, column]
        values[f"{name}.disturbance"] = np.interp(time, time[coarse], efforts[:, column])
    return Experiment.from_arrays(time, values, model=model, name="motion")


def follow(model: Model, second: Motion, third: Motion, duration: float = DURATION) -> Run:
    """The arm under its servos, from its rest at the first pose."""
    experiment = record(model, second, third, duration)
    state = np.zeros(model.core.n_states)
    start = np.array([0.0, experiment["motor_2.reference"][0], experiment["motor_3.reference"][0]])
    state[: len(model.coordinates)] = model.equilibrium(start)[0]
    return simulate(model, experiment, "closed_loop", initial_state=state)


def main(folder: Path) -> None:
    """Simulate all motions and draw strains and tip of each."""
    folder.mkdir(parents=True, exist_ok=True)
    model = Model.load(HERE / "tudor.toml")
    for letter, (words, second, third) in MOTIONS.items():
        run = follow(model, second, third)
        half = run.time > 0.5 * DURATION
        for gauge in ("gauge_1", "gauge_2"):
            strain = 1e6 * run[f"{gauge}.strain"][half]
            middle, swing = 0.5 * (strain.max() + strain.min()), 0.5 * np.ptp(strain)
            print(f"{letter} {words}: {gauge} mean {middle:.1f}, amplitude {swing:.2f} µm/m")
        path = folder / f"motion_{letter}.png"
        draw(run, f"{letter}: {words}", path)
        print(f"wrote {path}")


def draw(run: Run, title: str, path: Path) -> None:
    """Joints, strains and tip over time."""
    figure, axes = plt.subplots(3, 1, figsize=(9, 8), sharex=True, layout="constrained")
    for name in ("joint_2", "joint_3"):
        axes[0].plot(run.time, run[f"{name}.position"], label=name)
    for name in ("gauge_1", "gauge_2"):
        axes[1].plot(run.time, 1e6 * run[f"{name}.strain"], label=name)
    for name in ("x", "z"):
        axes[2].plot(run.time, run[f"tip.{name}"], label=f"tip {name}")
    for axis, label in zip(axes, ("joints, rad", "strain, µm/m", "tip, m"), strict=True):
        axis.set_ylabel(label)
        axis.legend(loc="upper right")
    axes[-1].set_xlabel("time, s")
    axes[0].set_title(title)
    figure.savefig(path, dpi=110)
    plt.close(figure)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?", default=Path("tudor-plots"), help="where the pictures go")
    main(parser.parse_args().folder)
