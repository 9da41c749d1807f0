"""Reference values of the servo-cylinder rig: steps and chirp by a Radau method (1e-10), and closed forms.

Cylinder 16/10/80 mm, 160 bar, 7.5 l/min at 35 bar per edge and 10 mA, spool 250 Hz and 0.7, oil 1.2 GPa, lines of
2.9e-6 m^3, 3 kg, 700 N s/m, 589.927 N/m, leakage 1.7e-13 m^3/(s Pa); from rest in the middle. Rows: time (ms),
pressures a and b (Pa), place (m), velocity (m/s).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vpm.experiment import Experiment
from vpm.model import Model

Array = NDArray[np.float64]

#: 2 mA until 50 ms, then -2 mA.
STEP = (
    (1, 7012121.795, 8635112.044, 8.465676088e-06, 0.03529871373),
    (2, 7836093.767, 6403637.949, 0.0001267232224, 0.2195824032),
    (5, 3824013.489, 6162335.733, 0.0009883654441, 0.1885790856),
    (10, 3862065.927, 4705776.926, 0.002140457461, 0.2225574486),
    (20, 3673928.383, 4658682.657, 0.004488316951, 0.2349591581),
    (50, 3683428.681, 4652190.75, 0.01151250647, 0.2340387241),
    (51, 1992634.409, 6764863.01, 0.01173405134, 0.1781410065),
    (55, 7476145.194, 11035659.09, 0.01095534896, -0.1183878978),
    (60, 7356427.71, 13168182.29, 0.01010906294, -0.1601774126),
    (100, 7432611.954, 13182390.77, 0.003099671935, -0.1750911751),
)
#: 0.5 mA sin((w0 + (w1 - w0) t / 2) t), w0 = 2 pi 1/s, w1 = 40 pi 1/s.
CHIRP = (
    (100, 3119582.086, 4768962.542, 0.002979519979, 0.05721158708),
    (200, 4273983.001, 7132276.426, 0.006620728248, -0.02093142047),
    (300, 4914601.976, 7702433.371, 0.005057868143, 0.05349375285),
    (500, 7459684.956, 12333795.06, 0.006811092073, -0.0309269253),
    (750, 6890474.184, 10934168.3, 0.008726395444, 0.03543805692),
    (1000, 3813393.484, 6331588.956, 0.01162950524, 0.01063706603),
    (1250, 6755362.449, 10579504.12, 0.01273161495, 0.03379502095),
    (1500, 6384213.418, 10487457.02, 0.01481472868, -0.03895875723),
    (1750, 6082817.309, 10056426.28, 0.01680552625, -0.0462054121),
    (2000, 6549868.378, 10397117.88, 0.01858023083, -0.008891637287),
)
REST = (6096116.505, 10003883.5)
#: Pressures a and b (Pa) and speed per current (m/(s A)) without load, out and in.
NO_LOAD_OUT, NO_LOAD_IN = (3002144.57, 4926596.218, 119.8069453), (7969302.532, 13077829.8, 93.22110898)
OIL_FREQUENCY = 238.5998701

SUPPLY, TANK = 16e6, 1e5
AREA = np.pi / 4 * 0.016**2
RATIO = 1.0 - (10.0 / 16.0) ** 2
#: Force at the end of the stroke with the valve open, out and in, N.
STALL_OUT = AREA * (SUPPLY - RATIO * TANK)
STALL_IN = AREA * (RATIO * SUPPLY - TANK)


def chirp(time: Array, amplitude: float = 0.5e-3) -> Array:
    """Current of the chirp, A."""
    low, high = 2.0 * np.pi, 40.0 * np.pi
    return amplitude * np.sin((low + (high - low) * time / 2.0) * time)


def held(model: Model, step: float, values: Array, **others: Array) -> Experiment:
    """Record of commands of the only actuator, each held for a step; other channels with ``__`` for the dot."""
    time = step * np.arange(len(values))
    columns = {f"{model.actuators[0]}.command": values}
    columns |= {name.replace("__", "."): column for name, column in others.items()}
    return Experiment.from_arrays(time, columns, model=model, name="bench")
