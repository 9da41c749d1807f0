"""Bulk modulus and gain of the valve by linear least squares, and why that fails.

Application 3 of D'Imperio (2016), chapter 5.

python examples/servo_cylinder/oil.py                 table like 5.3, what each suspect does, bias against the rate
python examples/servo_cylinder/oil.py --seeds 50      and coverage over seeds of the noise

The data come from the finest model of the bench: spool, leakage, seals, air in the oil, ripple of the supply, in steps
of 50 us, with noise and quantisation of the sensors.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import vpm
from vpm.model import Model

Array = NDArray[np.float64]

HERE = Path(__file__).resolve().parent
RIG = Model.load(HERE / "rig.toml")
GEOMETRY = vpm.CylinderGeometry.of(RIG, "servo")
SPOOL = (RIG.parameters["servo.valve.frequency"].value, RIG.parameters["servo.valve.damping"].value)
BETA = RIG.parameters["pump.oil.bulk_modulus"].value
GAIN = RIG.parameters["servo.valve.flow_gain"].value
SUPPLY, TANK = RIG.parameters["pump.pressure"].value, RIG.parameters["pump.tank_pressure"].value

#: Steps of the data, s, and their length, s: three, six and nine periods.
STEP, SECONDS = 5e-5, 5.0
FREQUENCIES = (0.6, 1.2, 1.8)
RATES = (50, 100, 200, 500, 1000, 2000, 5000, 10000)
#: Standard deviation and quantum of the sensors, SI.
NOISE = {"position": 10e-6, "force": 5.0, "pressure_a": 20e3, "pressure_b": 20e3, "supply": 20e3}
QUANTUM = {"position": 5e-6, "force": 1.0, "pressure_a": 5e3, "pressure_b": 5e3, "supply": 5e3}

Choice = Mapping[str, object]
PLAIN: Choice = {"estimator": "differences", "weighted": False}
#: One line of the pictures each: which channels are used, and how. All but the printed one know spool and leakage.
KNOWING: Choice = {"spool": SPOOL, "extra": ("leakage",)}
BOTH = ("pressure_a", "pressure_b")
ESTIMATORS: dict[str, tuple[tuple[str, ...], Choice]] = {
    "as printed: force, pa + pb = ps + pt, differences": (("force",), {**PLAIN, "rule": "symmetric"}),
    "force, corrected rule, differences": (("force",), {**PLAIN, **KNOWING}),
    "force, corrected rule, integral, instruments": (("force",), KNOWING),
    "pressures, balance of the force, differences": ((*BOTH, "force"), {**PLAIN, **KNOWING, "balance": "force"}),
    "pressures, balance of the force, instruments": ((*BOTH, "force"), {**KNOWING, "balance": "force"}),
    "pressures, differences": (BOTH, {**PLAIN, **KNOWING}),
    "pressures, filtered": (BOTH, {**KNOWING, "estimator": "filtered"}),
    "pressures, integral": (BOTH, {**KNOWING, "estimator": "integral"}),
    "pressures, integral, instruments": (BOTH, KNOWING),
}
PRINTED, BEST = next(iter(ESTIMATORS)), list(ESTIMATORS)[-1]


class Bench(NamedTuple):
    """What the bench has that a clean one has not."""

    frequency: float = 1.2  # Hz, of the motion
    air: float = 0.0  # volume of free air by that of the oil
    ripple: float = 0.0  # amplitude of the supply's, as a share
    ripple_frequency: float = 7.0  # Hz
    leakage: float = 1.7e-13  # m^3/(s Pa)
    amplitude: float = 0.8e-3  # A


@lru_cache(maxsize=64)
def motion(bench: Bench) -> dict[str, Array]:
    """Channels of the bench in steps of `STEP`, free of noise; outward currents are smaller, so that the piston "
    "does not drift."""
    content = RIG.to_dict()
    pump = content["supplies"]["pump"]
    if bench.air:
        pump["oil"]["air"] = {"fraction": bench.air}
    pump["source"] = "logged"
    content["actuators"]["servo"]["cylinder"]["internal_leakage"] = bench.leakage
    model = Model.from_dict(content)
    time = STEP * np.arange(round(SECONDS / STEP) + 1)

    def current(at: Array) -> Array:
        wave = np.sin(2.0 * np.pi * bench.frequency * at)
        return np.asarray(bench.amplitude * np.where(wave > 0.0, wave / 1.285, wave))

    supply = SUPPLY * (1.0 + bench.ripple * np.sin(2.0 * np.pi * bench.ripple_frequency * time))
    start = np.full(time.size, -0.015 / bench.frequency)
    # A command is held for a step; that of its middle stands for a current without steps.
    columns = {"servo.command": current(time + 0.5 * STEP), "pump.pressure": supply, "axis.position": start}
    log = vpm.Experiment.from_arrays(time, columns, model=model, name="bench")
    run = vpm.simulate(model, log, integrator="rosenbrock", substeps=2)
    names = {"position": "axis.position", "pressure_a": "servo.pressure_a", "pressure_b": "servo.pressure_b"}
    found = {name: run[channel] for name, channel in names.items()} | {
        "supply": supply,
        "command": current(time),
        "time": time,
    }
    found["force"] = GEOMETRY.area * (found["pressure_a"] - GEOMETRY.area_ratio * found["pressure_b"])
    return found


def measured(bench: Bench, rate: float, seed: int | None = 0) -> dict[str, Array]:
    """What sensors log at a rate (Hz); without a seed free of noise and quantisation."""
    stride = round(1.0 / (rate * STEP))
    channels = {name: values[::stride] for name, values in motion(bench).items()}
    if seed is not None:
        random = np.random.default_rng(seed)
        for name, std in NOISE.items():
            noisy = channels[name] + std * random.standard_normal(channels[name].size)
            channels[name] = QUANTUM[name] * np.round(noisy / QUANTUM[name])
    return channels


def estimate(record: Mapping[str, Array], which: str = BEST, *, supply: bool = False, **changes: object) -> vpm.OilFit:
    """One estimator on a record; without `supply` the pressure of the pump is taken for its nominal one."""
    channels, choice = ESTIMATORS[which]
    arguments: dict[str, object] = {name: record[name] for name in (*channels, "position", "command")}
    arguments |= {"supply": record["supply"] if supply else SUPPLY, "tank": TANK, "strict": False, **choice, **changes}
    return vpm.identify_oil(record["time"], GEOMETRY, **arguments)  # type: ignore[arg-type]


#: The regression as printed where nothing is wrong with it but what a suspect does, and the best one.
BARE = "pressures, balance of the force, differences"


class Suspect(NamedTuple):
    """One thing that may be wrong, all others being right."""

    bench: Bench = Bench()
    rate: float = 2000.0  # Hz
    seed: int | None = None
    rule: str | None = None  # of the pressures, if they are not measured
    late: float = 0.0  # s, by which the log holds the command too late
    dead: float = 1.0  # dead volumes believed, by the true ones
    changes: tuple[tuple[str, object], ...] = ()


SUSPECTS: dict[str, Suspect] = {
    "nothing": Suspect(),
    "samples at 100 Hz": Suspect(rate=100.0),
    "noise and quantisation, 100 Hz": Suspect(rate=100.0, seed=0),
    "noise and quantisation, 1 kHz": Suspect(rate=1000.0, seed=0),
    "noise and quantisation, 10 kHz": Suspect(rate=10000.0, seed=0),
    "pressures by pa + pb = ps + pt": Suspect(rule="symmetric"),
    "pressures by the corrected rule": Suspect(rule="steady"),
    "leakage left out": Suspect(changes=(("extra", ()),)),
    "lag of the spool left out": Suspect(changes=(("spool", None),)),
    "command logged 0.1 ms late": Suspect(late=1e-4),
    "command logged 1 ms late": Suspect(late=1e-3),
    "command logged 1 ms early": Suspect(late=-1e-3),
    "dead volumes believed 20 % larger": Suspect(dead=1.2),
    "air, 0.5 %": Suspect(Bench(air=0.005)),
    "air, 2 %": Suspect(Bench(air=0.02)),
    "air, 2 %, with its column": Suspect(Bench(air=0.02), changes=(("extra", ("leakage", "air")),)),
    "ripple of 2 %, supply taken as constant": Suspect(Bench(ripple=0.02)),
    "ripple of 5 %, supply taken as constant": Suspect(Bench(ripple=0.05)),
    "ripple of 5 %, supply measured": Suspect(Bench(ripple=0.05), changes=(("measured", True),)),
}


def tried(suspect: Suspect, which: str) -> vpm.OilFit | None:
    """An estimator on what a suspect leaves of a record; None where the estimator has no use for it."""
    record = measured(suspect.bench, suspect.rate, suspect.seed)
    channels, choice = ESTIMATORS[which]
    choice = dict(choice) | dict(suspect.changes)
    known = bool(choice.pop("measured", False))
    extra = choice["extra"]
    if choice.get("balance") == "force" and isinstance(extra, tuple) and "air" in extra:
        return None
    if suspect.rule is not None:
        if which == BEST:
            return None
        channels, choice = ("force",), {**choice, "rule": suspect.rule}
    command = np.interp(record["time"] - suspect.late, motion(suspect.bench)["time"], motion(suspect.bench)["command"])
    volume = {"line_a": suspect.dead * GEOMETRY.line_a, "line_b": suspect.dead * GEOMETRY.line_b}
    geometry = vpm.CylinderGeometry(GEOMETRY.area, GEOMETRY.area_ratio, GEOMETRY.stroke, **volume)
    arguments: dict[str, object] = {name: record[name] for name in (*channels, "position")}
    arguments |= {"supply": record["supply"] if known else SUPPLY, "tank": TANK, "strict": False, **choice}
    return vpm.identify_oil(record["time"], geometry, command=command, **arguments)  # type: ignore[arg-type]


def suspects() -> dict[str, dict[str, vpm.OilFit | None]]:
    """What each suspect does to either estimator."""
    return {name: {which: tried(each, which) for which in (BARE, BEST)} for name, each in SUSPECTS.items()}


def against_rate(which: str, frequency: float = 1.2, seeds: int = 3) -> Array:
    """Rows of rate (Hz), mean of true beta by found beta, and mean relative error of K_v."""
    rows = []
    for rate in RATES:
        fits = [estimate(measured(Bench(frequency), rate, seed), which) for seed in range(seeds)]
        rows.append([rate, _mean(fits, "compliance") * BETA, _mean(fits, "flow_gain") / GAIN - 1.0])
    return np.array(rows)


def _mean(fits: list[vpm.OilFit], name: str) -> float:
    return float(np.mean([fit[name] for fit in fits]))


def coverage(which: str, seeds: int, rate: float = 1000.0) -> tuple[float, float]:
    """Share of seeds in which the truth lies inside the 95 % interval: of beta, and of K_v."""
    hits = np.zeros(2)
    for seed in range(seeds):
        fit = estimate(measured(Bench(), rate, seed), which)
        for k, truth in enumerate((1.0 / BETA, GAIN)):
            hits[k] += fit.intervals[k, 0] <= truth <= fit.intervals[k, 1]
    return float(hits[0] / seeds), float(hits[1] / seeds)


def table(rate: float = 1000.0, seed: int = 0) -> None:
    """Print the estimates in the layout of table 5.3, K_v by unit of a command that is 1 at 10 mA, at one rate (Hz)."""
    print(f"{'':52s}" + "".join(f"{f'{f} Hz':>25s}" for f in FREQUENCIES))
    for which in ESTIMATORS:
        fits = [estimate(measured(Bench(f), rate, seed), which) for f in FREQUENCIES]
        cells = "".join(f"{fit.bulk_modulus:12.3g} Pa {1e-2 * fit.flow_gain:10.3e}" for fit in fits)
        print(f"{which:52s}{cells}")
    print(f"{'simulated with':52s}" + f"{BETA:12.3g} Pa {1e-2 * GAIN:10.3e}" * 3)
    print(f"{'table 5.3, hip':52s}" + "".join(f"{b:12.3g} Pa {k:10.3e}" for b, k in zip(*PUBLISHED, strict=True)))


#: Table 5.3 of D'Imperio (2016), hip: beta in Pa (printed as MPa) and K_v at the three frequencies.
PUBLISHED = (1.14e9, 9.44e7, 3.36e7), (7.28e-8, 8.72e-8, 8.66e-7)


def main(seeds: int) -> None:
    """Print the tables."""
    print("beta and K_v, samples at 1 kHz with noise and quantisation")
    table()
    print("\ntrue beta / found beta, and error of K_v, at 1.2 Hz")
    print(f"{'suspect':44s}{'plain':>20s}{'integral, instruments':>26s}")
    for name, fits in suspects().items():
        cells = [
            f"{fit['compliance'] * BETA:10.3f} {100 * (fit.flow_gain / GAIN - 1):+8.2f} %" if fit else f"{'-':>20s}"
            for fit in fits.values()
        ]
        print(f"{name:44s}{cells[0]:>20s}{cells[1]:>26s}")
    print("\ntrue beta / found beta and error of K_v against the sampling rate, 1.2 Hz, with noise")
    print(f"{'':52s}" + "".join(f"{rate:>9d} Hz" for rate in RATES))
    for which in ESTIMATORS:
        rows = against_rate(which)
        print(f"{which:52s}" + "".join(f"{row[1]:12.3f}" for row in rows))
        print(f"{'':52s}" + "".join(f"{100 * row[2]:+10.2f} %" for row in rows))
    if seeds:
        beta, gain = coverage(BEST, seeds)
        print(f"truth inside its own 95 % interval in {seeds} seeds: beta {100 * beta:.0f} %, K_v {100 * gain:.0f} %")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=0, help="seeds of the coverage")
    main(parser.parse_args().seeds)
