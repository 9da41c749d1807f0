"""The servo-cylinder of the reference values, solved without vpm: states and exact rates at the samples of a log.

Without ends of the stroke: at 0.6 Hz the piston passes 40 mm, as in the reference values of the pressure rule.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import vpm
from hydraulic_reference import AREA, RATIO, SUPPLY, TANK, VALUES

Array = NDArray[np.float64]

BETA, GAIN, LEAKAGE = 1.2e9, float(VALUES["hyd.Kv"]["value"]), 1.7e-13
SPOOL = (2.0 * np.pi * 250.0, 0.7)
GEOMETRY = vpm.CylinderGeometry(AREA, RATIO, 0.08, 2.9e-6, 2.9e-6)
FREQUENCIES = (0.6, 1.2, 1.8)


def _root(drop: float) -> float:
    return float(np.sign(drop) * np.sqrt(abs(drop)))


def rates(state: Array, current: float) -> list[float]:
    """Rates of pressures a and b, place, velocity, spool and spool's rate; 4.11 and 4.12 corrected, 4.16."""
    pa, pb, x, v, spool, spool_rate = state
    if spool > 0.0:
        into_a, out_of_b = GAIN * spool * _root(SUPPLY - pa), GAIN * spool * _root(pb - TANK)
    else:
        into_a, out_of_b = GAIN * spool * _root(pa - TANK), GAIN * spool * _root(SUPPLY - pb)
    leak = LEAKAGE * (pa - pb)
    va, vb = 2.9e-6 + AREA * (0.04 + x), 2.9e-6 + RATIO * AREA * (0.04 - x)
    force = AREA * (pa - RATIO * pb)
    return [
        BETA / va * (into_a - AREA * v - leak),
        BETA / vb * (-out_of_b + RATIO * AREA * v + leak),
        v,
        (force - 700.0 * v - 589.927 * x) / 3.0,
        spool_rate,
        SPOOL[0] ** 2 * (current - spool) - 2.0 * SPOOL[1] * SPOOL[0] * spool_rate,
    ]


@lru_cache(maxsize=16)
def solved(frequency: float, step: float = 1e-3, seconds: float = 1.7) -> dict[str, Array]:
    """Sine of 0.8 mA from rest in the middle."""

    def command(time: float) -> float:
        return float(0.8e-3 * np.sin(2.0 * np.pi * frequency * time))

    time = step * np.arange(round(seconds / step) + 1)
    side_b = (SUPPLY + TANK) / (1.0 + RATIO)
    found = solve_ivp(
        lambda t, y: rates(y, command(t)),
        (0.0, time[-1]),
        [RATIO * side_b, side_b, 0.0, 0.0, 0.0, 0.0],
        method="LSODA",
        rtol=1e-10,
        atol=[1e-3, 1e-3, 1e-13, 1e-12, 1e-15, 1e-12],
        t_eval=time,
        max_step=2e-3,
    )
    states = found.y
    slopes = np.array([rates(states[:, k], command(t)) for k, t in enumerate(time)]).T
    names = ("pressure_a", "pressure_b", "position", "velocity", "spool", "spool_rate")
    columns = dict(zip(names, states, strict=True)) | {
        f"{name}_slope": slope for name, slope in zip(names, slopes, strict=True)
    }
    current = np.array([command(t) for t in time])
    force = AREA * (columns["pressure_a"] - RATIO * columns["pressure_b"])
    return columns | {"time": time, "command": current, "force": force}


def seen(frequency: float, seed: int | None = None, step: float = 1e-3) -> dict[str, Array]:
    """Log of the spool and the sensors; with a seed 10 um, 5 N and 20 kPa of noise, rounded to 5 um, 1 N and 5 kPa."""
    log = dict(solved(frequency, step))
    if seed is not None:
        random = np.random.default_rng(seed)
        noise = {"position": (10e-6, 5e-6), "force": (5.0, 1.0), "pressure_a": (2e4, 5e3), "pressure_b": (2e4, 5e3)}
        for name, (std, quantum) in noise.items():
            noisy = log[name] + std * random.standard_normal(log[name].size)
            log[name] = quantum * np.round(noisy / quantum)
    return log


def found(log: dict[str, Array], *channels: str, **changes: object) -> vpm.OilFit:
    """Estimate from the spool, the place and channels of a log."""
    arguments: dict[str, object] = {name: log[name] for name in (*channels, "position")}
    arguments |= {"command": log["spool"], "supply": SUPPLY, "tank": TANK, "strict": False, **changes}
    return vpm.identify_oil(log["time"], GEOMETRY, **arguments)  # type: ignore[arg-type]


def sum_rule_bias(frequency: float) -> tuple[float, float]:
    """Relative error of K_v, and beta (Pa), of the printed regression with the printed rule, without noise."""
    fit = found(seen(frequency), "force", rule="symmetric", estimator="differences", weighted=False)
    return fit.flow_gain / GAIN - 1.0, fit.bulk_modulus
