"""A servo-hydraulic press against its public records: fitted on parts of one, judged on the rest and on the other.

python examples/servo_actuator/run.py SOFT.csv STIFF.csv [--out FOLDER]
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.signal import cont2discrete, lfilter

from vpm.experiment import Experiment
from vpm.identify import Fit, identify
from vpm.model import Model
from vpm.simulate import Setup, simulate

Array = NDArray[np.float64]

HERE = Path(__file__).resolve().parent
PLACE, FORCE, REFERENCE = "ram.length", "specimen.force", "servo.reference"
#: Steps of half a millisecond; the first half second of every piece does not count: it begins wherever the motion was.
SUBSTEPS, SETTLING = 2, 0.5
#: Pieces that are fitted, s: the beginning up to 1 Hz, and 9.5 to 11.5 Hz.
FITTED = ((5.0, 12.0), (34.0, 39.0))
#: What no fit sees, s: 12 to 20 Hz.
UNSEEN = (40.0, 56.0)
#: Relative change of the sum of squares at which a fit ends.
TOLERANCE = 1e-4

LOOP = ("servo.valve.flow_gain", "servo.valve.frequency", "displacement.delay.time", "displacement.offset.value")
SPECIMEN = (
    "slip.friction.coulomb",
    "slip.friction.viscous",
    "specimen.stiffness",
    "load_cell.offset.value",
)
#: Where the fit to the stiff specimen begins; that to the soft one begins at the model file.
STIFF = {"slip.friction.coulomb": 1000.0, "slip.friction.viscous": 1e4, "specimen.stiffness": 4e6}


def load(path: Path) -> Experiment:
    """One record, zeroed where it stands before the chirp."""
    return Experiment.load(path, model=Model.load(HERE / "servo.toml"))


def fitted(record: Experiment, start: Mapping[str, float], pieces: Sequence[tuple[float, float]] = FITTED) -> Fit:
    """Loop and specimen fitted to displacement and force of some pieces of a record."""
    model = Model.load(HERE / "servo.toml").with_parameters(start)
    parts = [record.trim(*piece) for piece in pieces]
    setup = Setup(substeps=SUBSTEPS, settling=SETTLING)
    return identify(model, parts, (*LOOP, *SPECIMEN), mode="closed_loop", setup=setup, tolerance=TOLERANCE)


def specimen_of(fit: Fit, other: Fit) -> Model:
    """The loop of one fit with the specimen of another."""
    return fit.model.with_parameters({name: other[name] for name in SPECIMEN})


def gap(model: Model, record: Experiment, piece: tuple[float, float], channel: str) -> tuple[float, float]:
    """Root mean square of measured minus simulated on a piece (SI), and its share of the signal's spread."""
    part = record.trim(*piece)
    run = simulate(model, part, "closed_loop", substeps=SUBSTEPS)
    return _measure(part[channel], run[channel], part)


def _measure(measured: Array, predicted: Array, part: Experiment) -> tuple[float, float]:
    counts = part.time >= part.time[0] + SETTLING
    rms = float(np.sqrt(np.mean((measured - predicted)[counts] ** 2)))
    return rms, rms / float(measured[counts].std())


# ---- baseline --------------------------------------------------------------------------------------------------------


def lagged(record: Experiment, rate: float, delay: float, offset: float) -> Array:
    """The command through a delay (s) and a lag of first order (1/s), at rest at the first sample."""
    command = np.interp(record.time - delay, record.time, record[REFERENCE])
    system = cont2discrete(([1.0], [1.0 / rate, 1.0]), record.dt, "foh")
    filtered = lfilter(np.ravel(system[0]), np.ravel(system[1]), command - command[0])
    place: Array = filtered + command[0] + 1.0 + offset
    return place


def lag_of(record: Experiment) -> tuple[float, float, float]:
    """Rate (1/s), delay (s) and offset (m) of the lag that is nearest on the fitted pieces."""
    whole = record.time
    rows = np.any([(whole >= a + SETTLING) & (whole <= b) for a, b in FITTED], axis=0)

    def misfit(x: Array) -> Array:
        return 1e3 * (lagged(record, 45.0 * x[0], 4e-3 * x[1], 1e-4 * x[2]) - record[PLACE])[rows]

    x = least_squares(misfit, [1.0, 1.0, 0.0]).x
    return 45.0 * x[0], 4e-3 * x[1], 1e-4 * x[2]


# ---- the table -------------------------------------------------------------------------------------------------------


def main(soft: Path, stiff: Path, folder: Path | None) -> None:
    """Fit each record, judge on what it did not see and on the other record."""
    began = time.perf_counter()
    records = {"soft": load(soft), "stiff": load(stiff)}
    fits = {name: fitted(record, STIFF if name == "stiff" else {}) for name, record in records.items()}
    for name, fit in fits.items():
        print(f"fitted to pieces of {name}:")
        for key, value, std, unit in zip(fit.names, fit.values, fit.std, fit.units, strict=True):
            print(f"  {key:28s}{value:12.5g} +- {1.96 * std:9.2g} {unit}")
    print("gap, root mean square and share of the spread: fitted pieces, then 40 to 56 s")
    for name, record in records.items():
        other = next(key for key in records if key != name)
        rate, delay, offset = lag_of(record)
        print(f"  a lag of {rate:.1f} 1/s behind {1e3 * delay:.2f} ms, fitted to {name}")
        for target in (name, other):
            place = lagged(records[target], rate, delay, offset)
            parts = [records[target].trim(*piece) for piece in (*FITTED, UNSEEN)]
            rows = [np.searchsorted(records[target].time, part.time - 0.5 * part.dt) for part in parts]
            _row(f"on {target}, mm", [_measure(p[PLACE], place[r], p) for p, r in zip(parts, rows, strict=True)], 1e3)
        for target, model in ((name, fits[name].model), (other, specimen_of(fits[name], fits[other]))):
            print(f"  press fitted to {name}, with the specimen of {target}")
            for channel, unit, scale in ((PLACE, "mm", 1e3), (FORCE, "N", 1.0)):
                row = [gap(model, records[target], piece, channel) for piece in (*FITTED, UNSEEN)]
                _row(f"on {target}, {unit}", row, scale)
    if folder is not None:
        print(f"wrote {draw(records, fits, folder)}")
    print(f"{time.perf_counter() - began:.0f} s")


def _row(label: str, gaps: Sequence[tuple[float, float]], scale: float) -> None:
    print(f"    {label:16s}" + "".join(f"{scale * rms:10.3f} ({100.0 * share:4.1f} %)" for rms, share in gaps))


def draw(records: Mapping[str, Experiment], fits: Mapping[str, Fit], folder: Path) -> Path:
    """A picture of both channels at the beginning of what no fit saw. Needs the extra ``plot``."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 6.0), layout="constrained")
    panels = figure.subplots(2, 2, sharex=True)
    for column, (name, record) in zip(panels.T, records.items(), strict=True):
        part = record.trim(UNSEEN[0] - SETTLING, UNSEEN[0] + 0.5)
        run = simulate(fits[name].model, part, "closed_loop", substeps=SUBSTEPS)
        for axes, channel, scale, zero in ((column[0], PLACE, 1e3, 1.0), (column[1], FORCE, 1.0, 0.0)):
            axes.plot(part.time, scale * (part[channel] - zero), color="black", linewidth=0.8, label="measured")
            axes.plot(part.time, scale * (run[channel] - zero), linewidth=1.2, label="simulated")
        column[0].set_title(f"{name} specimen")
        column[1].set_xlabel("time, s")
    panels[0, 0].set_ylabel("displacement, mm")
    panels[1, 0].set_ylabel("force, N")
    panels[0, 0].legend(frameon=False)
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "servo_actuator.svg"
    figure.savefig(path)
    return path


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("soft", type=Path, help="CSV file of the record with the soft specimen")
    parser.add_argument("stiff", type=Path, help="CSV file of the record with the stiff specimen")
    parser.add_argument("--out", type=Path, help="folder of the picture")
    arguments = parser.parse_args()
    main(arguments.soft, arguments.stiff, arguments.out)
