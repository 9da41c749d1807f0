"""TUDOR against its public record MERIt: fitted on one half, judged on the other, with and without play in a gear.

python examples/tudor/merit.py RECORD.csv [--out FOLDER]
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from merit_report import write_report
from numpy.typing import NDArray
from scipy.optimize import brentq, least_squares
from scipy.signal import cont2discrete, lfilter, lfilter_zi

from vpm.experiment import Experiment
from vpm.identify import Fit, identify
from vpm.model import Model
from vpm.simulate import Setup, simulate

Array = NDArray[np.float64]

HERE = Path(__file__).resolve().parent
GAUGES = ("21", "22", "31", "32")
CHANNELS = tuple(f"gauge_{name}.strain" for name in GAUGES)
#: Above the second mode of the arm (16 Hz), below half the sampling rate: what the joints' angles are filtered at, Hz.
CUTOFF = 30.0
#: Steps per sample of 10 ms: contacts of the play close within milliseconds, the modes of the strips are slower.
SUBSTEPS = {True: 6, False: 2}
#: The arm is never at rest in the middle of the record: simulations of the second half begin this much earlier, s,
#: three times the decay time of the first mode, and only the joints' angles of that time are used.
LEAD = 10.0
#: Relative change of the sum of squares at which a fit ends; its statistical uncertainty is a hundred times larger.
TOLERANCE = 1e-4
#: Fitted beside the gauges' offsets; one gain for all gauges and one damping for both strips.
FREE = (
    "bridge_21.gain.value",
    "strip_1.damping.stiffness",
    "elbow_drive.mass",
    "encoder_2.offset.value",
    "encoder_3.offset.value",
)
PLAY = ("play_2.backlash.gap", "play_2.backlash.damping")
TIES = {f"bridge_{name}.gain.value": "bridge_21.gain.value" for name in GAUGES[1:]} | {
    "strip_2.damping.stiffness": "strip_1.damping.stiffness"
}


@dataclass(frozen=True)
class Half:
    """A half of the record: what is simulated, of which the first `lead` s do not count, and what counts."""

    record: Experiment
    lead: float

    @property
    def counted(self) -> Experiment:
        """The part that is fitted or judged."""
        return self.record.trim(start=self.record.time[0] + self.lead)


@dataclass(frozen=True)
class Fitted:
    """A model fitted to one record, and where its second gauges were put."""

    fit: Fit
    places: dict[str, float]

    @property
    def model(self) -> Model:
        """The fitted model."""
        return self.fit.model

    @property
    def free(self) -> dict[str, tuple[float, float, str]]:
        """Value, 95 % half interval and unit of each fitted number; no interval for places."""
        half = self.fit.intervals[:, 1] - self.fit.values
        rows = zip(self.fit.names, self.fit.values, half, self.fit.units, strict=True)
        numbers = {name: (float(value), float(width), unit) for name, value, width, unit in rows}
        return numbers | {f"{name}.at": (place, float("nan"), "m") for name, place in self.places.items()}


# ---- the flexible model ----------------------------------------------------------------------------------------------


def machine(places: Mapping[str, float] | None = None, *, play: bool = True) -> Model:
    """The model file with gauges at other places, and with the play or a stiff joint."""
    content = Model.load(HERE / "merit.toml").to_dict()
    for name, at in (places or {}).items():
        content["gauges"][name]["at"] = at
    if not play:
        content["joints"]["play_2"] = {"type": "fixed", "parent": "gear", "child": "hub"}
        content["effects"] = [effect for effect in content["effects"] if effect["type"] != "backlash"]
    return Model.from_dict(content)


def fitted(half: Half, *, without_play: Fitted | None = None) -> Fitted:
    """Fit to one record: first the places of the second gauges from the strains at rest, then everything that is free.

    The model with play starts from the fitted one without.
    """
    play = without_play is not None
    places = places_at_rest(half.counted)
    free = (*FREE, *(PLAY if play else ()), *_offsets())
    if without_play is None:
        model = started(machine(places, play=False), half)
    else:
        known = without_play.model.parameters
        values = {name: known[name].value for name in (*FREE, *TIES, *_offsets())}
        model = machine(places).with_parameters(values)
    setup = Setup(substeps=SUBSTEPS[play], settling=half.lead)
    mode = "prescribed_motion"
    fit = identify(model, half.record, free, mode=mode, cutoff=CUTOFF, setup=setup, ties=TIES, tolerance=TOLERANCE)
    return Fitted(fit, places)


def started(model: Model, half: Half) -> Model:
    """One gain of all gauges and an offset of each, by linear regression on a first simulation."""
    predicted, measured, _ = strains(model, half)
    weight = 1.0 / measured.std(axis=0)
    centred = (predicted - predicted.mean(axis=0)) * weight
    gain = float(np.sum(centred * (measured * weight)) / np.sum(centred**2))
    offsets = (measured - gain * predicted).mean(axis=0)
    values = {f"bridge_{name}.gain.value": gain for name in GAUGES}
    return model.with_parameters(values | dict(zip(_offsets(), map(float, offsets), strict=True)))


def strains(model: Model, half: Half) -> tuple[Array, Array, Array]:
    """Predicted and measured strains (N, gauges) and their time (s) where they count, on the measured motion."""
    substeps = SUBSTEPS["play_2" in model.joints]
    run = simulate(model, half.record, "prescribed_motion", cutoff=CUTOFF, substeps=substeps)
    columns = [run.channels.index(name) for name in CHANNELS]
    counts = run.time >= half.counted.time[0] - 1e-6
    return run.values[counts][:, columns], run.measured[counts][:, columns], run.time[counts]


def _offsets() -> tuple[str, ...]:
    return tuple(f"bridge_{name}.offset.value" for name in GAUGES)


# ---- the places of the second gauges ---------------------------------------------------------------------------------


def places_at_rest(record: Experiment) -> dict[str, float]:
    """Where the beams' moments at rest have the ratios of the measured strains.

    A strip that carries its own weight alone has a moment proportional to (L - x)^2; on the first, the elbow and the
    second strip add theirs, proportional to L - x.
    """
    model, row = machine(), static_coefficients(record)
    content = model.to_dict()
    lengths = [content["beams"][name]["length"] for name in ("strip_1", "strip_2")]
    first = [content["gauges"][f"gauge_{name}"]["at"] for name in ("21", "31")]
    share = np.sqrt(row[3, 1] / row[2, 1])
    at_32 = lengths[1] - share * (lengths[1] - first[1])
    section = content["beams"]["strip_1"]["section"]
    line = 7850.0 * 1e-6 * section["width"]["value"] * section["height"]["value"]
    tip = model.parameters["elbow_drive.mass"].value + line * lengths[1]

    def moment(x: float) -> float:
        return tip * (lengths[0] - x) + 0.5 * line * (lengths[0] - x) ** 2

    wanted = row[1, 0] / row[0, 0] * moment(first[0])
    at_22 = float(brentq(lambda x: moment(x) - wanted, first[0], lengths[0]))
    return {"gauge_22": at_22, "gauge_32": float(at_32)}


# ---- baselines -------------------------------------------------------------------------------------------------------


def angles(record: Experiment) -> Array:
    """cos q2, cos(q2 + q3) and 1 at each sample, (N, 3)."""
    q2, q3 = record["joint_2.position"], record["joint_3.position"]
    return np.column_stack([np.cos(q2), np.cos(q2 + q3), np.ones(len(record))])


def measured_strains(record: Experiment) -> Array:
    """(N, gauges)."""
    return np.column_stack([record[name] for name in CHANNELS])


def static_coefficients(record: Experiment) -> Array:
    """Strain of each gauge (rows) per cos q2, cos(q2 + q3) and 1, by least squares over all samples."""
    solution: Array = np.linalg.lstsq(angles(record), measured_strains(record), rcond=None)[0]
    return solution.T


def filtered(signal: Array, frequency: float, damping: float, interval: float) -> Array:
    """Response of one mode (Hz, share of critical) to each column, at rest before the first sample."""
    omega = 2.0 * np.pi * frequency
    system = cont2discrete(([omega**2], [1.0, 2.0 * damping * omega, omega**2]), interval, "foh")
    b, a = np.ravel(system[0]), np.ravel(system[1])
    start = lfilter_zi(b, a)
    return np.column_stack([lfilter(b, a, x, zi=start * x[0])[0] for x in signal.T])


def static_map(train: Half) -> Callable[[Half], Array]:
    """Strains that the pose alone predicts, over the whole of a half's record."""
    coefficients = static_coefficients(train.counted)
    return lambda half: angles(half.record) @ coefficients.T


def one_mode(train: Half) -> Callable[[Half], Array]:
    """The static map through one mode common to all gauges, fitted from several starts."""
    static, measured = static_map(train)(train), measured_strains(train.counted)
    weight, count = 1.0 / measured.std(axis=0), len(measured)

    def misfit(x: Array) -> Array:
        return ((filtered(static, x[0], x[1], train.record.dt)[-count:] - measured) * weight).ravel()

    starts = ((2.8, 0.05), (3.0, 0.05), (3.2, 0.05))
    fits = [least_squares(misfit, x, x_scale=[0.1, 0.02], bounds=([0.5, 1e-3], [20.0, 2.0])) for x in starts]
    frequency, damping = min(fits, key=lambda fit: fit.cost).x
    return lambda half: filtered(static_map(train)(half), frequency, damping, half.record.dt)


# ---- judgement -------------------------------------------------------------------------------------------------------


def score(measured: Array, predicted: Array) -> Array:
    """Fit of each gauge in %: 100 (1 - |y - y_hat| / |y - mean y|)."""
    gap = np.linalg.norm(measured - predicted, axis=0)
    return 100.0 * (1.0 - gap / np.linalg.norm(measured - measured.mean(axis=0), axis=0))


@dataclass(frozen=True)
class Judged:
    """What one half says about the other.

    Attributes
    ----------
    fits : dict
        Per method the fit (%) of each gauge on the half that was not fitted.
    flexible : dict
        The two flexible models, "flexible" and "flexible with play".
    time, measured : ndarray
        The half that was not fitted.
    predicted : dict
        Per method the strains there.
    """

    fits: dict[str, Array]
    flexible: dict[str, Fitted]
    time: Array
    measured: Array
    predicted: dict[str, Array]


def judge(train: Half, test: Half) -> Judged:
    """Fit everything to ``train``, predict ``test``."""
    stiff = fitted(train)
    flexible = {"flexible": stiff, "flexible with play": fitted(train, without_play=stiff)}
    runs = {name: strains(result.model, test) for name, result in flexible.items()}
    _, measured, clock = runs["flexible"]
    rows = np.searchsorted(test.record.time, clock - 0.5 * test.record.dt)
    predicted = {"static map": static_map(train)(test)[rows], "one mode": one_mode(train)(test)[rows]}
    predicted |= {name: run[0] for name, run in runs.items()}
    return Judged({n: score(measured, p) for n, p in predicted.items()}, flexible, clock, measured, predicted)


def load(path: Path) -> tuple[Half, Half]:
    """The two halves of the record; the first begins with the arm at rest."""
    record = Experiment.load(path, model=machine())
    middle = record.time[0] + 0.5 * record.duration
    return Half(record.trim(stop=middle), 0.0), Half(record.trim(start=middle - LEAD), LEAD)


def main(path: Path, folder: Path) -> None:
    """Fit both halves, print the table, write the report."""
    began = time.perf_counter()
    first, second = load(path)
    print(f"halves of {first.counted.duration:.1f} s and {second.counted.duration:.1f} s")
    results = {"first -> second": judge(first, second), "second -> first": judge(second, first)}
    for way, result in results.items():
        print(f"{way}: fit of the gauges {', '.join(GAUGES)} on the half that was not fitted, %")
        for name, fits in result.fits.items():
            print(f"  {name:20s}" + "".join(f"{value:8.1f}" for value in fits))
    for file in write_report(folder, results):
        print(f"wrote {file}")
    print(f"{time.perf_counter() - began:.0f} s")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("record", type=Path, help="CSV file of the record")
    parser.add_argument("--out", type=Path, default=Path("merit-report"), help="folder of the report")
    arguments = parser.parse_args()
    main(arguments.record, arguments.out)
