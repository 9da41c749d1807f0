"""A hydraulic crane against its public record: fitted on the first half, judged on the second, effect by effect.

python examples/crane/run.py RECORD.csv [--out FOLDER]
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.signal import cont2discrete, lfilter
from threadpoolctl import threadpool_limits

from vpm.experiment import Experiment
from vpm.identify import Fit, identify
from vpm.model import Model
from vpm.simulate import Setup, simulate

Array = NDArray[np.float64]

HERE = Path(__file__).resolve().parent
#: One sample of the log, s: a scale that is chosen, for nobody wrote it down.
SAMPLE = 0.05
#: What the zero of the log's pressure is taken for, MPa: a scale as well; far enough from zero for every swing.
ZERO = 20.0
PRESSURE, PLACE = "lift.pressure_a", "boom.position"
SETUP = Setup(integrator="rosenbrock", substeps=2)
#: The first half is fitted up to here (samples) and judged beyond, to choose between models without the second half.
INNER = (300, 400)
#: Each fit is begun from the model file and from so many others, spread by this logarithmic standard deviation.
STARTS, SPREAD = 4, 0.4

FREE = (
    "pump.pressure",
    "pump.tank_pressure",
    "arm.mass",
    "boom.friction.viscous",
    "lift.cylinder.line_a",
    "lift.valve.flow_gain",
    "lift.valve.frequency",
)
OVERLAP, STROKE, COULOMB = "lift.valve.overlap", "lift.valve.stroke", "boom.friction.coulomb"
#: No overlap; a stroke that no command reaches.
PLAIN = {OVERLAP: 0.0, STROKE: 10.0}
#: Both chambers alike and no weight: then both directions are alike, too.
SYMMETRIC = {"lift.cylinder.area_ratio": 1.0, "lift.cylinder.line_b": 0.0185, "boom.bias.force": 0.0}


@dataclass(frozen=True)
class Variant:
    """A model with some of its effects: values that differ from the file's, what is free beside `FREE`, and ties."""

    fixed: Mapping[str, float]
    also_free: tuple[str, ...] = ()
    ties: Mapping[str, str] | None = None

    def model(self) -> Model:
        """The model before it is fitted."""
        model = Model.load(HERE / "crane.toml")
        if COULOMB in self.also_free:
            model = model.with_effect("coulomb_friction", at="boom", coulomb=300.0)
        return model.with_parameters(self.fixed)


VARIANTS = {
    "symmetric cylinder": Variant(PLAIN | SYMMETRIC, (), {"lift.cylinder.line_b": "lift.cylinder.line_a"}),
    "asymmetric": Variant(PLAIN),
    "asymmetric, overlap": Variant({STROKE: PLAIN[STROKE]}, (OVERLAP,)),
    "asymmetric, stroke": Variant({OVERLAP: PLAIN[OVERLAP]}, (STROKE,)),
    "asymmetric, overlap, stroke": Variant({}, (OVERLAP, STROKE)),
    "the same with dry friction": Variant({}, (OVERLAP, STROKE, COULOMB)),
}


def load(path: Path) -> Experiment:
    """The whole record on the scales of the model file.

    The log counts the valve against the arm: it opens with negative values where the arm rises, which is a scale of -1.
    """
    columns = np.genfromtxt(path, delimiter=",", names=True)
    pressure = columns["oil_pressure"] + ZERO
    channels = {"lift.command": -columns["valve_u"], PLACE: columns["arm_position"], PRESSURE: pressure}
    units = {"lift.command": "1", PLACE: "m", PRESSURE: "MPa"}
    clock = SAMPLE * np.arange(len(pressure))
    return Experiment.from_arrays(clock, channels, units, name=path.stem, model=Model.load(HERE / "crane.toml"))


def first(record: Experiment, samples: int) -> Experiment:
    """So many samples from the beginning."""
    return record.trim(stop=record.time[0] + (samples - 0.5) * record.dt)


# ---- the cylinder ----------------------------------------------------------------------------------------------------


def fitted(variant: Variant, record: Experiment, starts: int = STARTS) -> tuple[Fit, int]:
    """The best of several fits to pressure and position in free run, and how many of them came within 1 % of it."""
    model, free = variant.model(), (*FREE, *variant.also_free)
    random = np.random.default_rng(0)
    fits = []
    for number in range(starts):
        factors = np.exp(SPREAD * random.standard_normal(len(free))) if number else np.ones(len(free))
        begin = model.with_parameters(
            {
                name: float(np.clip(factor * (p := model.parameters[name]).value, 1.001 * p.minimum, 0.999 * p.maximum))
                for name, factor in zip(free, factors, strict=True)
                if not name.startswith("pump.")
            }
        )
        fits.append(identify(begin, record, free, mode="free_run", setup=SETUP, ties=variant.ties, tolerance=1e-7))
    gaps = np.array([weighted(fit, record) for fit in fits])
    return fits[int(np.argmin(gaps))], int(np.sum(gaps <= 1.01 * gaps.min()))


def weighted(fit: Fit, record: Experiment) -> float:
    """What the fit made small: squares of both gaps, each relative to its channel's spread."""
    return float(sum((fit.after[name][0] / record[name].std()) ** 2 for name in (PRESSURE, PLACE)))


def pressure(model: Model, record: Experiment) -> Array:
    """Pressure of a free run from the beginning of a record, in the unit of the log."""
    run = simulate(model, record, "free_run", integrator=SETUP.integrator, substeps=SETUP.substeps)
    return run[PRESSURE] / 1e6 - ZERO


def rms(predicted: Array, record: Experiment, rows: slice) -> float:
    """Root mean square of measured minus predicted pressure on some rows, in the unit of the log."""
    return float(np.sqrt(np.mean((record[PRESSURE] / 1e6 - ZERO - predicted)[rows] ** 2)))


def inner(variant: Variant, half: Experiment) -> list[float]:
    """Gaps on the rest of the first half of models fitted to its beginning."""
    ends = [(fitted(variant, first(half, end), starts=2)[0], end) for end in INNER]
    return [rms(pressure(fit.model, half), half, slice(end, None)) for fit, end in ends]


# ---- linear baselines ------------------------------------------------------------------------------------------------


def linear(record: Experiment, half: int, *, two_gains: bool) -> Array:
    """Second order from valve to pressure, fitted to the first half; with a gain for each direction or one for both."""
    command, measured = record["lift.command"], record[PRESSURE] / 1e6 - ZERO
    sides = [np.maximum(command, 0.0), np.minimum(command, 0.0)] if two_gains else [command]

    def regressors(x: Array) -> Array:
        omega, damping = np.exp(x)
        columns = []
        for numerator in ([omega**2], [omega, 0.0]):
            system = cont2discrete((numerator, [1.0, 2.0 * damping * omega, omega**2]), record.dt, "foh")
            columns += [lfilter(np.ravel(system[0]), np.ravel(system[1]), side) for side in sides]
        return np.column_stack(columns)

    def gains(x: Array) -> Array:
        solution: Array = np.linalg.lstsq(regressors(x)[:half], measured[:half], rcond=None)[0]
        return solution

    def misfit(x: Array) -> Array:
        return regressors(x)[:half] @ gains(x) - measured[:half]

    starts = [np.log([omega, damping]) for omega in (3.0, 6.0, 12.0) for damping in (0.1, 0.5)]
    with threadpool_limits(1, user_api="blas"):  # many small systems: threads would wait for each other
        best = min((least_squares(misfit, start) for start in starts), key=lambda fit: fit.cost).x
        predicted: Array = regressors(best) @ gains(best)
    return predicted


# ---- the table -------------------------------------------------------------------------------------------------------


def main(path: Path, folder: Path | None) -> None:
    """Fit on the first half, choose there, then look at the second half once."""
    began = time.perf_counter()
    record = load(path)
    half = len(record) // 2
    training = first(record, half)
    rows: dict[str, Array] = {
        "linear, second order": linear(record, half, two_gains=False),
        "the same, a gain per direction": linear(record, half, two_gains=True),
    }
    fits, judged = {}, {}
    for name, variant in VARIANTS.items():
        fits[name], agreeing = fitted(variant, training)
        judged[name] = inner(variant, training)
        rows[name] = pressure(fits[name].model, record)
        print(f"{name}: {agreeing} of {STARTS} starts agree; inner gaps {judged[name][0]:.3f}, {judged[name][1]:.3f}")
    chosen = min(judged, key=lambda name: sum(judged[name]))
    print(f"chosen on the first half: {chosen}")
    print("gap of the pressure, root mean square in the unit of the log: first half, second half")
    for name, predicted in rows.items():
        print(f"  {name:32s}{rms(predicted, record, slice(half)):8.3f}{rms(predicted, record, slice(half, None)):8.3f}")
    second = record.trim(start=record.time[half])
    afresh = rms(pressure(fits[chosen].model, second), second, slice(None))
    print(f"  {'chosen, begun at the second half':40s}{afresh:8.3f}")
    fit = fits[chosen]
    for name, value, std, unit in zip(fit.names, fit.values, fit.std, fit.units, strict=True):
        print(f"  {name:26s}{value:12.5g} +- {1.96 * std:9.2g} {unit}")
    if folder is not None:
        print(f"wrote {draw(record, {name: rows[name] for name in (next(iter(rows)), chosen)}, half, folder)}")
    print(f"{time.perf_counter() - began:.0f} s")


def draw(record: Experiment, rows: Mapping[str, Array], half: int, folder: Path) -> Path:
    """A picture of measured and predicted pressure. Needs the extra ``plot``."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 4.5), layout="constrained")
    axes = figure.subplots()
    axes.plot(record[PRESSURE] / 1e6 - ZERO, color="black", linewidth=1.0, label="measured")
    for name, predicted in rows.items():
        axes.plot(predicted, linewidth=1.0, label=name)
    axes.axvline(half, color="grey", linewidth=0.8)
    axes.set_xlabel("sample; fitted left of the line, unseen right of it")
    axes.set_ylabel("oil pressure, unit of the log")
    axes.legend(frameon=False)
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "crane.svg"
    figure.savefig(path)
    return path


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("record", type=Path, help="CSV file of the record")
    parser.add_argument("--out", type=Path, help="folder of the picture")
    arguments = parser.parse_args()
    main(arguments.record, arguments.out)
