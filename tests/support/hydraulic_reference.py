"""Reference values of the servo-cylinder rig: steps and chirp by a Radau method (1e-10), and closed forms.

Cylinder 16/10/80 mm, 160 bar, 7.5 l/min at 35 bar per edge and 10 mA, spool 250 Hz and 0.7, oil 1.2 GPa, lines of
2.9e-6 m^3, 3 kg, 700 N s/m, 589.927 N/m, leakage 1.7e-13 m^3/(s Pa); from rest in the middle.
"""

import json
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from places import ROOT
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.numbers import Array

#: Reference values by their id: the file that the core's tests read.
VALUES: dict[str, dict[str, Any]] = {
    entry["id"]: entry
    for entry in json.loads((ROOT / "crates/vpm-core/tests/values/hydraulic.json").read_text(encoding="utf-8"))
}


def rows(kind: str) -> tuple[tuple[float, ...], ...]:
    """Rows of a response, ``hyd.H1.step``: time (ms), pressures a and b (Pa), place (m), velocity (m/s)."""
    found = {key.removeprefix(f"{kind}.t"): e["value"] for key, e in VALUES.items() if key.startswith(f"{kind}.t")}
    return tuple((float(time.removesuffix("ms")), *value) for time, value in found.items())


#: 2 mA until 50 ms, then -2 mA.
STEP = rows("hyd.H1.step")
#: 0.5 mA sin((w0 + (w1 - w0) t / 2) t), w0 = 2 pi 1/s, w1 = 40 pi 1/s.
CHIRP = rows("hyd.H2.chirp")
REST: list[float] = VALUES["hyd.initial_pressures"]["value"]
#: Pressures a and b (Pa) and speed per current (m/(s A)) without load, out and in.
NO_LOAD_OUT, NO_LOAD_IN = VALUES["hyd.noload.extend"]["value"], VALUES["hyd.noload.retract"]["value"]
OIL_FREQUENCY: float = VALUES["hyd.natural_frequency"]["value"]

SUPPLY, TANK = 16e6, 1e5
AREA = np.pi / 4 * 0.016**2
RATIO = 1.0 - (10.0 / 16.0) ** 2
#: Force at the end of the stroke with the valve open, out and in, N.
STALL_OUT = AREA * (SUPPLY - RATIO * TANK)
STALL_IN = AREA * (RATIO * SUPPLY - TANK)


def chirp(instants: ArrayLike, amplitude: float = 0.5e-3) -> Array:
    """Current of the chirp, A."""
    time = np.asarray(instants, dtype=np.float64)
    low, high = 2.0 * np.pi, 40.0 * np.pi
    return amplitude * np.sin((low + (high - low) * time / 2.0) * time)


def held(model: Model, step: float, values: Array, **others: Array) -> Experiment:
    """Record of commands of the only actuator, each held for a step; other channels with ``__`` for the dot."""
    time = step * np.arange(len(values))
    columns = {f"{model.actuators[0]}.command": values}
    columns |= {name.replace("__", "."): column for name, column in others.items()}
    return Experiment.from_arrays(time, columns, model=model, name="bench")
