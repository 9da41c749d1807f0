"""Time of a step of machines with closed loops, beside the same machines with stiff bushings in the place of the loops.

Run with ``python benches/loops.py``. Printed are medians of several rounds and half the range of their middle half.
"""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

from vpm import Model, Simulation

ROUNDS, STEPS = 9, 400
#: N/m and N m/rad of the bushings, with a damping that lets their vibrations die out.
STIFF, DAMPED = 1e7, 1e3


def bushed(model: Model) -> Model:
    """The machine with bushings in the place of its loops."""
    content = model.to_dict()
    free = {"spherical": (0, 1, 2), "revolute": (), "rigid": ()}
    content["bushings"] = {}
    for name, loop in content.pop("loops").items():
        stiffness, damping = np.full(6, STIFF), np.full(6, DAMPED)
        turning = list(free[loop["type"]])
        if loop["type"] == "revolute":
            turning = [int(np.argmax(np.abs(loop["axis"])))]
        stiffness[turning], damping[turning] = 0.0, 0.0
        content["bushings"][name] = {
            "a": loop["a"],
            "b": loop["b"],
            "stiffness": stiffness.tolist(),
            "damping": damping.tolist(),
        }
    return Model.from_dict(content)


def microseconds(model: Model, state: np.ndarray, integrator: str, *, compiled: bool) -> tuple[float, float]:
    """Median time of a step and half the range of the middle half of the rounds, us."""
    simulation = Simulation(model, 1e-3, integrator=integrator, state=state, compiled=compiled)
    command, rounds = np.zeros(len(model.inputs)), []
    for _ in range(ROUNDS):
        begin = time.process_time()
        for _ in range(STEPS):
            simulation.step(command)
        rounds.append((time.process_time() - begin) / STEPS * 1e6)
    low, middle, high = np.percentile(rounds, (25, 50, 75))
    return float(middle), float(0.5 * (high - low))


def main() -> None:
    """Print the table."""
    folder = Path(__file__).parents[1] / "examples" / "loops"
    print("machine        coordinates        integrator  code        loops, us     bushings, us")
    for name in ("parallelogram", "karl", "hyq_leg"):
        model = Model.load(folder / f"{name}.toml")
        state = model.state()
        for integrator, compiled in (("rk4", False), ("linearly_implicit", False), ("linearly_implicit", True)):
            loops = microseconds(model, state, integrator, compiled=compiled)
            stiff = None if integrator == "rk4" else microseconds(bushed(model), state, integrator, compiled=compiled)
            said = "too stiff" if stiff is None else f"{stiff[0]:8.1f} +- {stiff[1]:4.1f}"
            code = "yes" if compiled else "no"
            mine = f"{loops[0]:8.1f} +- {loops[1]:4.1f}"
            print(f"{name:14s} {len(model.coordinates):11d} {integrator:>17s} {code:>5s} {mine:>16s} {said:>16s}")


if __name__ == "__main__":
    main()
