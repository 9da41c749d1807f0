"""Grey-box identification of the servo-cylinder on its bench: six physical parameters from two pressures and a place.

python examples/servo_cylinder/greybox.py                 one record of each input, table of estimates
python examples/servo_cylinder/greybox.py --tests 5       table 5.4 in its own layout, five records of each input
python examples/servo_cylinder/greybox.py --seeds 100     how often the truth lies inside its own 95 % interval

The data are simulated in steps a quarter as long as those of the fitted model, with noise and quantisation.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vpm.experiment import Experiment
from vpm.identify import Fit, Fitting, identify
from vpm.model import Model
from vpm.simulate import Setup, simulate

Array = NDArray[np.float64]

HERE = Path(__file__).resolve().parent
STEP = 1e-3  # s
#: Steps of the fitted model, and of the one that the data come from.
FITTED, TRUE = Setup("rk4", 4), Setup("rk4", 16)

#: Parameters of the listing (D'Imperio 2016, appendix A) and where it starts them.
LISTING = {
    "Be": ("pump.oil.bulk_modulus", 1e8),
    "Kvc": ("servo.valve.flow_gain", 1e-6),
    "ML": ("slide.mass", 3.0),
    "BL": ("axis.friction.viscous", 1.0),
    "KL": ("axis.spring.stiffness", 589.927),
    "Cli": ("servo.cylinder.internal_leakage", 1.7e-13),
}
FREE = tuple(name for name, _ in LISTING.values())
#: Bounds of the listing in SI; Kvc and Cli begin above zero, where a logarithm can begin.
BOUNDS = {
    "pump.oil.bulk_modulus": (1e5, 2e10),
    "servo.valve.flow_gain": (1e-9, 2e-4),
    "slide.mass": (0.01, 10.0),
    "axis.friction.viscous": (0.1, 1e3),
    "axis.spring.stiffness": (100.0, 1e9),
    "servo.cylinder.internal_leakage": (1e-18, 1e-5),
}
#: From the listing's start (oil twelve times too soft, hardly any friction) one fit of all six ends in a wrong valley.
STARTS = 12
#: Standard deviation and quantum of the sensors: place in m, pressures in Pa.
NOISE = {"axis.position": 20e-6, "servo.pressure_a": 20e3, "servo.pressure_b": 20e3}
QUANTUM = {"axis.position": 5e-6, "servo.pressure_a": 5e3, "servo.pressure_b": 5e3}


def rig() -> Model:
    """The bench with the true parameters."""
    return Model.load(HERE / "rig.toml")


def listing(free: Sequence[str] = FREE) -> Model:
    """The bench with free parameters where the listing starts them."""
    return rig().with_parameters({name: value for name, value in LISTING.values() if name in free})


def chirp(seconds: float, amplitude: float = 0.5e-3) -> Array:
    """Current (A) that sweeps from 1 to 20 Hz."""
    t = np.arange(round(seconds / STEP) + 1) * STEP
    low, high = 2.0 * np.pi, 40.0 * np.pi
    return np.asarray(amplitude * np.sin((low + (high - low) * t / (2.0 * seconds)) * t))


def random_gaussian(seconds: float, amplitude: float = 2e-3, seed: int = 0) -> Array:
    """Current (A) of independent normal values, each held for 5 ms."""
    count = round(seconds / STEP) + 1
    values = np.random.default_rng(seed).standard_normal(count // 5 + 1)
    return np.asarray(amplitude * np.repeat(values, 5)[:count])


def measured(current: Array, *, seed: int | None = 0, name: str = "bench", setup: Setup = TRUE) -> Experiment:
    """Record of the true bench from rest in the middle; without a seed free of noise and quantisation."""
    model, t = rig(), np.arange(len(current)) * STEP
    log = Experiment.from_arrays(t, {"servo.command": current}, model=model, name=name)
    run = simulate(model, log, integrator=setup.integrator, substeps=setup.substeps)
    channels = {"servo.command": current}
    random = np.random.default_rng(seed)
    for channel, noise in NOISE.items():
        channels[channel] = run[channel]
        if seed is not None:
            noisy = run[channel] + noise * random.standard_normal(len(t))
            channels[channel] = QUANTUM[channel] * np.round(noisy / QUANTUM[channel])
    return Experiment.from_arrays(t, channels, model=model, name=name)


def pressures_at_rest() -> dict[str, float]:
    """First state of every record: at rest in the middle, pressures as after a long rest with the valve shut."""
    model = rig()
    return dict(zip(model.state_names, map(float, model.state(None)), strict=True))


def fitted(record: Experiment, free: Sequence[str] = FREE, starts: int = 1, model: Model | None = None) -> Fit:
    """Output-error fit in free run, logarithms of the parameters, channels weighted by their estimated noise."""
    settings = Fitting(
        log=True,
        noise="estimated",
        bounds={name: BOUNDS[name] for name in free},
        known_states=pressures_at_rest(),
        starts=starts,
    )
    return identify(model or listing(free), record, free, mode="free_run", setup=FITTED, fitting=settings)


def off(share: float = 0.3) -> Model:
    """The bench with all free parameters too small by a share of their true value."""
    model = rig()
    return model.with_parameters({name: (1.0 - share) * model.parameters[name].value for name in FREE})


def table(fits: dict[str, Fit]) -> None:
    """Estimates in the layout of table 5.4, with 95 % intervals and the truth; both in the units of the table."""
    print(f"{'input':24s}{'beta/1e7 Pa':>24s}{'K_v/1e-5':>26s}")
    scales = (("pump.oil.bulk_modulus", 1e7), ("servo.valve.flow_gain", 1e-5))
    for label, fit in fits.items():
        cells = []
        for name, scale in scales:
            k = fit.names.index(name)
            cells.append(f"{fit.values[k] / scale:12.5f} +- {1.96 * fit.std[k] / scale:8.5f}")
        print(f"{label:24s}{cells[0]:>24s}{cells[1]:>26s}")
    truth = rig().parameters
    cells = [f"{truth[name].value / scale:12.5f}" for name, scale in scales]
    print(f"{'simulated with':24s}{cells[0] + ' ' * 12:>24s}{cells[1] + ' ' * 12:>26s}")


def five_tests(tests: int = 5) -> None:
    """Table 5.4 in its own layout: a row for each test, all six parameters free, from the listing's start."""
    print(f"{'test':6s}{'chirp beta/1e7':>18s}{'K_v/1e-5':>12s}{'Gaussian beta/1e7':>20s}{'K_v/1e-5':>12s}")
    for test in range(1, tests + 1):
        cells = []
        for current in (chirp(5.0, 0.2e-3), random_gaussian(0.5, seed=test)):
            fit = fitted(measured(current, seed=test), starts=STARTS)
            cells += [fit[FREE[0]] / 1e7, fit[FREE[1]] / 1e-5]
        print(f"{test:<6d}{cells[0]:18.3f}{cells[1]:12.5f}{cells[2]:20.3f}{cells[3]:12.5f}", flush=True)


def coverage(seeds: int, seconds: float = 0.5) -> Array:
    """Share of seeds (6,) in which the truth lies inside its own 95 % interval; every fit starts 30 % off."""
    truth = np.array([rig().parameters[name].value for name in FREE])
    hits = np.zeros(len(FREE))
    start = off()
    for seed in range(seeds):
        low, high = fitted(measured(random_gaussian(seconds), seed=seed), model=start).intervals.T
        hits += (low <= truth) & (truth <= high)
    return hits / seeds


def main(seeds: int) -> None:
    """Print recovery without noise, the table with noise, all six parameters, and coverage."""
    two = FREE[:2]
    clean = fitted(measured(chirp(0.5), seed=None, setup=FITTED), two)
    truth = rig().parameters
    worst = max(abs(clean[name] / truth[name].value - 1.0) for name in two)
    print(f"without noise, two parameters from the listing's start: largest relative error {worst:.1e}")
    fits = {}
    for label, current in (("chirp, 5 s", chirp(5.0, 0.2e-3)), ("random Gaussian, 0.5 s", random_gaussian(0.5))):
        record = measured(current, seed=1, name=label)
        fits[f"{label}: two"] = fitted(record, two)
        fits[f"{label}: six"] = six = fitted(record, starts=STARTS)
        print(f"{label}: all six from the listing's start: {six.agreeing} of {STARTS} starts agree")
        began = time.perf_counter()
        alone = fitted(record, model=off())
        spent = time.perf_counter() - began
        print(f"{label}: all six from 30 % off in {spent:.2f} s and {alone.evaluations} evaluations")
    table(fits)
    for label in (label for label in fits if label.endswith("six")):
        fit = fits[label]
        print(label)
        for short, (name, _) in LISTING.items():
            k = fit.names.index(name)
            apart = (fit.values[k] - truth[name].value) / fit.std[k]
            print(
                f"  {short:4s}{fit.values[k]:13.6g} +- {1.96 * fit.std[k]:9.2g} {fit.units[k]:18s}{apart:+5.1f} std off"
            )
        for sentence in fit.warnings:
            print(f"  {sentence}")
    if seeds:
        shares = ", ".join(f"{short} {100 * s:.0f} %" for short, s in zip(LISTING, coverage(seeds), strict=True))
        print(f"truth inside its own 95 % interval in {seeds} seeds: {shares}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=0, help="seeds of the coverage")
    parser.add_argument("--tests", type=int, default=0, help="tests of the table, in place of all else")
    asked = parser.parse_args()
    if asked.tests:
        five_tests(asked.tests)
    else:
        main(asked.seeds)
