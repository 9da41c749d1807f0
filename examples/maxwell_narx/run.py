"""A Maxwell NARX element from records of a bench, twice: a strut that is such an element, and a cylinder that is not.

python examples/maxwell_narx/run.py

A load moves the slide of the bench: to places of a grid (tests at rest), along sines of 0.5, 1 and 2 Hz (tests in
motion), and along a mixture with frequencies between those, at another drive signal (validation). The drive signal u
shifts the free length. Force and length are sampled at 1 kHz with noise and quantisation.

Sources: D'Imperio (2016), section 5.2.5. The cylinder is that of examples/servo_cylinder in a force loop with velocity
compensation that makes it a soft virtual spring, as the joints of the hydraulic leg are.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vpm import narx
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.stepping import Simulation

Array = NDArray[np.float64]

HERE = Path(__file__).resolve().parent
STEP = 1e-3  # s
SIGNALS = narx.MaxwellSignals(force="force", length="length", drive="shift")
#: Standard deviation and quantum of the sensors: force in N, length in m.
NOISE, QUANTUM = {"force": 0.5, "length": 0.5e-6}, {"force": 0.1, "length": 0.1e-6}
SHIFTS = (-0.005, 0.0, 0.005)  # m
PLACES = tuple(np.linspace(-0.015, 0.015, 7))  # m, from the middle of the tests
FREQUENCIES, AMPLITUDE = (0.5, 1.0, 2.0), 0.008  # Hz, m
#: Of the filter for the measured length, Hz.
CUTOFF = 25.0
#: What holds the slide on its way: N/m and N s/m.
HOLD, DAMPING = 2e5, 2e3
#: Virtual spring of the cylinder, N/m; its force loop, A/N, and the share of the speed that is compensated, A s/m.
VIRTUAL, FORCE_GAIN, COMPENSATION = 2e4, 6e-7, 0.95 / 115.0

LOAD = """
[actuators.load]
type = "ideal"
joint = "axis"
gain = { value = 1.0, unit = "N" }
"""


@dataclass(frozen=True)
class Bench:
    """A machine with one drive, and how it is commanded."""

    model: Model
    drive: str
    middle: float
    command: Callable[[Simulation, float], float]
    settle: float  # s, before a test at rest


def strut() -> Bench:
    """A Maxwell strut: stiffness 20 kN/m, free length 320 mm + u, k1 = 500 kN/m, tau = 4 ms."""
    return Bench(Model.load(HERE / "strut.toml"), "strut_drive", 0.32, lambda _, shift: shift, 0.5)


def cylinder() -> Bench:
    """The servo-cylinder in a force loop: a virtual spring whose zero is u."""
    text = (HERE.parent / "servo_cylinder" / "rig.toml").read_text(encoding="utf-8") + LOAD

    def command(sim: Simulation, shift: float) -> float:
        wanted = VIRTUAL * (shift - sim["axis.position"])
        return FORCE_GAIN * (wanted - sim["servo.force"]) + COMPENSATION * sim["axis.velocity"]

    return Bench(Model.from_toml(text), "servo", 0.0, command, 4.0)


def record(bench: Bench, name: str, place: Array, shift: Array, seed: int | None, settle: float = 1.0) -> Experiment:
    """One test: places that the load leads the slide along, m, and drive signals, after some time at the first."""
    waiting = round(settle / STEP)
    place, shift = (np.concatenate([np.full(waiting, x[0]), x]) for x in (bench.middle + place, shift))
    sim = Simulation(bench.model, STEP, integrator="rosenbrock", substeps=4, state={"axis.position": place[0]})
    force, length = np.empty(place.size), np.empty(place.size)
    for k, (target, u) in enumerate(zip(place, shift, strict=True)):
        load = HOLD * (target - sim["axis.position"]) - DAMPING * sim["axis.velocity"]
        sim.step({bench.drive: bench.command(sim, u), "load": load})
        force[k], length[k] = -sim[f"{bench.drive}.force"], sim["axis.position"]
    channels = {"force": force[waiting:], "length": length[waiting:]}
    if seed is not None:
        random = np.random.default_rng(seed)
        for channel, values in channels.items():
            noisy = values + NOISE[channel] * random.standard_normal(values.size)
            channels[channel] = QUANTUM[channel] * np.round(noisy / QUANTUM[channel])
    time = np.arange(place.size - waiting) * STEP
    units = {"force": "N", "length": "m", "shift": "m"}
    return Experiment.from_arrays(time, {**channels, "shift": shift[waiting:]}, units, name=name)


def at_rest(bench: Bench, seed: int | None = 0) -> list[Experiment]:
    """Tests at rest of 0.3 s at every place and drive signal."""
    tests = []
    for shift in SHIFTS:
        for place in PLACES:
            name = f"u = {1e3 * shift:g} mm, s = {1e3 * (bench.middle + place):g} mm"
            number = None if seed is None else seed + len(tests)
            tests.append(record(bench, name, np.full(300, place), np.full(300, shift), number, bench.settle))
    return tests


def in_motion(bench: Bench, seed: int | None = 100) -> list[Experiment]:
    """Sines of three frequencies at three drive signals, 4 s each."""
    time = np.arange(4000) * STEP
    tests = []
    for shift in SHIFTS:
        for frequency in FREQUENCIES:
            place = AMPLITUDE * np.sin(2.0 * np.pi * frequency * time)
            name = f"u = {1e3 * shift:g} mm, {frequency:g} Hz"
            number = None if seed is None else seed + len(tests)
            tests.append(record(bench, name, place, np.full(time.size, shift), number))
    return tests


def unseen(bench: Bench, seed: int | None = 200) -> list[Experiment]:
    """Combined motions for validation: two frequencies between those of the training; u held elsewhere, u moving."""
    time = np.arange(5000) * STEP
    place = 0.006 * np.sin(2.0 * np.pi * 0.7 * time) + 0.003 * np.sin(2.0 * np.pi * 1.6 * time)
    shifts = {"u = 2.5 mm": np.full(time.size, 0.0025), "u moving at 0.3 Hz": 0.004 * np.sin(0.6 * np.pi * time)}
    return [
        record(bench, f"combined, {name}", place, shift, None if seed is None else seed + at)
        for at, (name, shift) in enumerate(shifts.items())
    ]


def fitted(bench: Bench, seed: int | None = 0) -> tuple[narx.MaxwellFit, narx.MaxwellErrors]:
    """The element, and its errors on motions that the fit has not seen."""
    number = None if seed is None else 1000 * seed
    at = (None, None, None) if number is None else (number, number + 100, number + 200)
    fit = narx.identify_maxwell(at_rest(bench, at[0]), in_motion(bench, at[1]), SIGNALS, cutoff=CUTOFF)
    return fit, narx.maxwell_errors(fit.element, unseen(bench, at[2]), SIGNALS, cutoff=CUTOFF)


def show(title: str, fit: narx.MaxwellFit, errors: narx.MaxwellErrors) -> None:
    """Print coefficients with their standard errors, notes, and errors of the validation."""
    print(f"\n{title}")
    for name, value, std in fit.coefficients:
        if value != 0.0:
            print(f"  {name:10s}{value:14.6g} +- {1.96 * std:.2g}")
    for note in fit.notes:
        print(f"  {note}")
    print(f"  {'free run':32s}{'sigma %':>10s}{'fit %':>10s}{'max N':>10s}{'rmse N':>10s}  white")
    for row in zip(errors.tests, errors.sigma, errors.fit, errors.max_error, errors.rmse, errors.white, strict=True):
        print(f"  {row[0]:32s}{row[1]:10.3f}{row[2]:10.2f}{row[3]:10.2f}{row[4]:10.2f}  {row[5]}")


def main() -> None:
    """Print both fits."""
    fit, errors = fitted(strut())
    show("a Maxwell strut (k0 = 20000 N/m, s0 = 0.32 m + u, k1 = 500000 N/m, c1 = 2000 N s/m)", fit, errors)
    bench = cylinder()
    rest, motion, others = at_rest(bench), in_motion(bench), unseen(bench)
    for title, degrees in (("k0 constant, s0 linear", (0, 1)), ("quadratic maps", (2, 2)), ("cubic maps", (3, 3))):
        degree = dict(zip(("k0", "s0"), degrees, strict=True))
        refined = degrees[0] or None
        fit = narx.identify_maxwell(
            rest, motion, SIGNALS, degree=degree if refined is None else None, refined_degree=refined, cutoff=CUTOFF
        )
        errors = narx.maxwell_errors(fit.element, others, SIGNALS, cutoff=CUTOFF)
        show(f"a servo-cylinder at low impedance, {title}", fit, errors)


if __name__ == "__main__":
    main()
