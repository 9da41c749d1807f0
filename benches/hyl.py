"""The hydraulic HyL leg dropped from 50 mm: how many simulated seconds in a second, beside the error, per integrator.

Two servo-cylinders, contact with friction, force controllers at 1 kHz: the machine of `examples/hyl/hydraulic.toml`.

python benches/hyl.py [MODEL]
"""

from __future__ import annotations

import sys
import time
import tomllib
from pathlib import Path

import numpy as np

import vpm

HYL = Path(__file__).resolve().parent.parent / "examples" / "hyl"
SECONDS, REPEATS = 0.5, 7
#: Integrator and steps per sample of 1 ms.
CHOICES = (
    ("guarded", 1),
    ("adaptive(1e-2)", 1),
    ("adaptive(1e-3)", 1),
    ("adaptive(1e-5)", 1),
    ("adaptive", 1),
    ("adaptive(1e-8)", 1),
    ("linearly_implicit", 1),
    ("linearly_implicit", 2),
    ("linearly_implicit", 8),
    ("rosenbrock", 8),
    ("rk4", 2),
    ("rk4", 3),
    ("rk4", 4),
    ("rk4", 8),
    ("rk4", 16),
)
EXACT = "adaptive(1e-11)"
CHANNELS = ("slider.position", "hip_drive.force", "knee_drive.force", "foot.normal_force", "knee_drive.pressure_a")


def main(file: str) -> None:
    """Print a table: time and errors of every choice."""
    content = tomllib.loads((HYL / "hydraulic_drop.toml").read_text(encoding="utf-8"))
    content.pop("plot")
    entry = {"name": "drop", "model": file}
    scenario = vpm.Scenario.from_dict({**content, "duration": SECONDS, "runs": [entry]}, folder=HYL)
    model = scenario.models["drop"]
    experiment, mode, start = scenario.experiment(model), scenario.mode(model), scenario.initial_state(model)

    def run(integrator: str, substeps: int) -> vpm.Run:
        return vpm.simulate(model, experiment, mode, initial_state=start, integrator=integrator, substeps=substeps)

    exact = run(EXACT, 1)
    print("| integrator | steps per ms | times real time | " + " | ".join(f"error of `{c}`" for c in CHANNELS) + " |")
    print("| --- | --- | --- |" + " --- |" * len(CHANNELS))
    for integrator, substeps in CHOICES:
        try:
            found, best = run(integrator, substeps), np.inf
            for _ in range(REPEATS):
                begin = time.process_time()
                run(integrator, substeps)
                best = min(best, time.process_time() - begin)
        except vpm.VpmError as error:
            print(f"| {integrator} | {substeps} | {error} |")
            continue
        errors = [np.abs(found[c] - exact[c]).max() / np.ptp(exact[c]) for c in CHANNELS]
        cells = [integrator, str(substeps), f"{SECONDS / best:.0f}", *(f"{error:.1e}" for error in errors)]
        print("| " + " | ".join(cells) + " |")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "hydraulic.toml")
