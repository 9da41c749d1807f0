"""Table 5.3 of D'Imperio (2016) on the simulated leg: oil and valve of hip and knee from its own motion.

python examples/hyl/oil.py

The leg stands, and its controllers, which hold each current for a millisecond, swing hip and knee by 8 and 16 degrees
at 0.6, 1.2 and 1.8 Hz. Logged at 1 kHz with noise of 10 um, 5 N and 20 kPa; D'Imperio (2016), section 5.3.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import vpm

Array = NDArray[np.float64]

HERE = Path(__file__).resolve().parent
LEG = vpm.Model.load(HERE / "hydraulic.toml")
FREQUENCIES = (0.6, 1.2, 1.8)
#: Mean and amplitude of the references, degrees; the first second is left to the start.
SWING = {"hip": (40.0, 8.0), "knee": (-80.0, 16.0)}
SETTLED, SECONDS = 1.0, 6.0
NOISE = {"position": 10e-6, "force": 5.0, "pressure_a": 20e3, "pressure_b": 20e3}
SPOOL = (LEG.parameters["hip_drive.valve.frequency"].value, LEG.parameters["hip_drive.valve.damping"].value)
BETA, GAIN = LEG.parameters["pump.oil.bulk_modulus"].value, LEG.parameters["hip_drive.valve.flow_gain"].value
#: beta (Pa, printed as MPa) and K_v by unit command.
PUBLISHED = {
    "hip": ((1.14e9, 7.28e-8), (9.44e7, 8.72e-8), (3.36e7, 8.66e-7)),
    "knee": ((2.09e9, 9.06e-11), (7.94e8, 3.76e-10), (2.78e8, 8.41e-10)),
}
Choice = Mapping[str, object]
BEST = "pressures, instruments"
ESTIMATORS: dict[str, tuple[tuple[str, ...], Choice]] = {
    "as printed": (("force",), {"rule": "symmetric", "estimator": "differences", "weighted": False}),
    "force, corrected rule": (("force",), {"spool": SPOOL, "held": True, "extra": ("leakage",)}),
    BEST: (("pressure_a", "pressure_b"), {"spool": SPOOL, "held": True, "extra": ("leakage",)}),
}


@lru_cache(maxsize=8)
def swung(moved: str, frequency: float) -> vpm.Run:
    """The leg on its foot, one joint following a sine: with both the hip's oil boils, and no balance holds there."""
    content = tomllib.loads((HERE / "hydraulic_drop.toml").read_text(encoding="utf-8"))
    del content["plot"]
    # cos 40 deg of both links: the foot on the ground.
    content["initial"]["slider.position"] = (0.350 + 0.341) * np.cos(np.radians(40.0))
    for joint, (mean, swing) in SWING.items():
        amplitude = swing if joint == moved else 0.0
        content["references"][f"{joint}_drive"] = {
            "type": "sine",
            "mean": {"value": mean, "unit": "deg"},
            "amplitude": {"value": amplitude, "unit": "deg"},
            "frequency": frequency,
        }
    content |= {"duration": SECONDS, "runs": [{"name": "swing", "model": "hydraulic.toml"}]}
    return vpm.Scenario.from_dict(content, folder=HERE).run()["swing"]


def measured(joint: str, frequency: float, seed: int | None = 0) -> dict[str, Array]:
    """Log of one cylinder; without a seed free of noise."""
    run = swung(joint, frequency)
    kept = run.time >= SETTLED
    drive, geometry = f"{joint}_drive", vpm.CylinderGeometry.of(LEG, f"{joint}_drive")
    retracted = LEG.parameters[f"{drive}.retracted_length"].value
    log = {name: run[f"{drive}.{name}"][kept] for name in ("command", "pressure_a", "pressure_b")}
    log["position"] = run[f"{joint}_cylinder.length"][kept] - retracted - 0.5 * geometry.stroke
    log["force"] = geometry.area * (log["pressure_a"] - geometry.area_ratio * log["pressure_b"])
    if seed is not None:
        random = np.random.default_rng(seed)
        for name, std in NOISE.items():
            log[name] = log[name] + std * random.standard_normal(log[name].size)
    return log | {"time": run.time[kept]}


def estimate(joint: str, frequency: float, which: str = BEST, seed: int | None = 0) -> vpm.OilFit:
    """One estimator on one cylinder."""
    log = measured(joint, frequency, seed)
    channels, choice = ESTIMATORS[which]
    arguments: dict[str, object] = {name: log[name] for name in (*channels, "position", "command")}
    arguments |= {"supply": LEG.parameters["pump.pressure"].value, "tank": LEG.parameters["pump.tank_pressure"].value}
    geometry = vpm.CylinderGeometry.of(LEG, f"{joint}_drive")
    return vpm.identify_oil(log["time"], geometry, strict=False, **arguments, **choice)  # type: ignore[arg-type]


def main() -> None:
    """Print the table: beta and K_v by unit of a command that is 1 at 10 mA."""
    print(f"{'':28s}" + "".join(f"{f'{f} Hz':>25s}" for f in FREQUENCIES))
    for joint in SWING:
        for which in ESTIMATORS:
            fits = [estimate(joint, f, which) for f in FREQUENCIES]
            cells = "".join(f"{fit.bulk_modulus:12.3g} Pa {1e-2 * fit.flow_gain:10.3e}" for fit in fits)
            print(f"{f'{joint}, {which}':28s}{cells}")
        cells = "".join(f"{beta:12.3g} Pa {gain:10.3e}" for beta, gain in PUBLISHED[joint])
        print(f"{f'{joint}, table 5.3':28s}{cells}")
    print(f"{'simulated with':28s}" + f"{BETA:12.3g} Pa {1e-2 * GAIN:10.3e}" * 3)
    for joint in SWING:
        for f in FREQUENCIES:
            fit = estimate(joint, f)
            low, high = fit.bulk_modulus_interval
            print(f"{joint}, {f} Hz: beta {fit.bulk_modulus:.4g} Pa, 95 % from {low:.4g} to {high:.4g}")


if __name__ == "__main__":
    main()
