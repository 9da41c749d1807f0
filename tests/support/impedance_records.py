"""Records of a spring with a damper: ellipses and landings, with and without noise."""

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]
Record = dict[str, Array]

K, C, M = 8.0e4, 3.3e3, 12.0  # N/m, N s/m, kg: about the hip of the HyL leg


def ellipse(
    k: float = K,
    c: float = C,
    amplitude: float = 5e-3,
    frequency: float = 0.5,
    cycles: float = 4.0,
    per_cycle: int = 500,
) -> Record:
    """Sine through a spring and a damper."""
    t = np.arange(round(cycles * per_cycle)) / (per_cycle * frequency)
    w = 2.0 * np.pi * frequency
    x, v = amplitude * np.sin(w * t), amplitude * w * np.cos(w * t)
    return {"time": t, "x": x, "f": k * x + c * v}


def noisy(record: Record, seed: int, of_x: float, of_f: float) -> Record:
    random = np.random.default_rng(seed)
    size = np.size(record["time"])
    return {
        "time": record["time"],
        "x": record["x"] + of_x * random.standard_normal(size),
        "f": record["f"] + of_f * random.standard_normal(size),
    }


def free_motion(k: float, c: float, seconds: float, rate: float = 1e3, gravity: float = 9.81) -> Record:
    """Mass that lands on a spring with a damper at 1 m/s, by an integrator."""
    t = np.arange(round(seconds * rate)) / rate
    found = solve_ivp(
        lambda _, y: (y[1], gravity - (k * y[0] + c * y[1]) / M),
        (0.0, seconds),
        (0.0, 1.0),
        method="DOP853",
        t_eval=t,
        rtol=1e-11,
        atol=1e-14,
    )
    return {"time": t, "x": found.y[0], "v": found.y[1], "f": k * found.y[0] + c * found.y[1]}
