"""Scores of grey-box models on public benchmarks, as these score; writes docs/benchmarks.md.

    python benches/public/public_scores.py --data FOLDER [--page docs/benchmarks.md]

FOLDER has a folder for each set that is at hand (`emps`, `silverbox`; see `public_sets.py`). The hysteretic
oscillator is computed from its published equations. Sets that are not there are named and left out.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path[:0] = [str(ROOT / "benches" / "peers"), str(ROOT / "benches" / "public")]

import bouc_wen  # noqa: E402
import markdown  # noqa: E402
import vpm  # noqa: E402
from public_sets import Series, Split, load  # noqa: E402

HERE = Path(__file__).resolve().parent
BEGIN, END = "<!-- begin of the scores -->\n", "<!-- end of the scores -->\n"


@dataclass(frozen=True)
class Case:
    """A machine of a set: its model file, its channels, and the effects that it is fitted with, one row each.

    Attributes
    ----------
    name : str
        Of the set.
    model : Path
    command, place : str
        Channels of input and output.
    effects : sequence of sequence of str
        Added to the model file, all at one joint.
    setup : vpm.Setup
        Steps of the free runs.
    factor, unit : float, str
        In which the scores are written.
    """

    name: str
    model: Path
    command: str
    place: str
    effects: Sequence[Sequence[str]]
    setup: vpm.Setup
    factor: float
    unit: str

    @property
    def joint(self) -> str:
        return self.place.split(".", 1)[0]


@dataclass(frozen=True)
class Score:
    """Root mean squares of the error of a free run over each record after the window, and processor time of the fit."""

    case: Case
    effects: Sequence[str]
    train: Sequence[tuple[str, float]]
    test: Sequence[tuple[str, float]]
    seconds: float


#: Signals of the two oscillators are band-limited: they are smooth between samples.
SMOOTH = vpm.Setup("linearly_implicit", substeps=4, hold="cubic")
FRICTION = ("coulomb_friction", "bias_force")
CASES = (
    Case(
        "emps",
        ROOT / "examples" / "emps" / "model.toml",
        "drive.command",
        "axis.position",
        (FRICTION, (*FRICTION, "asymmetric_friction")),
        vpm.Setup(),
        1e3,
        "mm",
    ),
    Case(
        "silverbox",
        HERE / "silverbox.toml",
        "shaker.command",
        "slide.position",
        ((), ("cubic_spring",)),
        SMOOTH,
        1e3,
        "mV",
    ),
    Case(
        "bouc_wen",
        HERE / "bouc_wen.toml",
        "shaker.command",
        "slide.position",
        ((), ("hysteresis",), ("hysteresis", "cubic_spring")),
        SMOOTH,
        1e6,
        "um",
    ),
)


def records(case: Case, model: vpm.Model, series: Sequence[Series]) -> list[vpm.Experiment]:
    """The same as records of the model."""
    return [
        vpm.Experiment.from_arrays(
            s.dt * np.arange(len(s.u)), {case.command: s.u[:, 0], case.place: s.y[:, 0]}, model=model, name=s.name
        )
        for s in series
    ]


def rms(case: Case, model: vpm.Model, record: vpm.Experiment, window: int) -> float:
    """Error of a free run over the samples that count."""
    setup = case.setup
    run = vpm.simulate(model, record, "free_run", integrator=setup.integrator, substeps=setup.substeps, hold=setup.hold)
    return case.factor * float(np.sqrt(np.mean((run[case.place] - record[case.place])[window:] ** 2)))


def score(case: Case, parts: Split, effects: Sequence[str]) -> Score:
    """Least squares on the balance of forces, then on free runs from there; the test records are looked at once."""
    model = vpm.Model.load(case.model)
    for effect in effects:
        model = model.with_effect(effect, at=case.joint)
    train, test = (records(case, model, part) for part in (parts.train, parts.test))
    begin = time.process_time()
    model = vpm.identify(model, train).model
    model = vpm.identify(model, train, mode="free_run", setup=case.setup).model
    seconds = time.process_time() - begin
    # Fits see a training record from its first sample on.
    own, unseen = (
        [(r.name, rms(case, model, r, window)) for r in part] for part, window in ((train, 0), (test, parts.window))
    )
    return Score(case, effects, own, unseen, seconds)


def splits(data: Path) -> Iterator[tuple[Case, Split]]:
    """The sets that are at hand."""
    for case in CASES:
        try:
            yield case, split(case.name, data)
        except FileNotFoundError as missing:
            print(f"left out: {missing}", file=sys.stderr)


def split(name: str, data: Path) -> Split:
    """A set from its folder, or made here."""
    if name == "bouc_wen":
        return bouc_wen.hysteretic_oscillator()
    if name == "emps" and (data / name / "emps_train.csv").is_file():
        return emps(data / name)
    return load(name, data / name)


def emps(folder: Path) -> Split:
    """The set EMPS, from tables of the same numbers."""
    model = vpm.Model.load(CASES[0].model)

    def series(name: str) -> Series:
        record = vpm.Experiment.load(folder / f"emps_{name}.csv", model=model)
        return Series(name, record["drive.command"][:, None], record["axis.position"][:, None], record.dt)

    return Split((series("train"),), (series("pulses_test"),), 20)


def page(scores: Sequence[Score]) -> str:
    """Rows of the table."""
    return markdown.table(
        ["set", "model", "training", "test", "CPU of the fit, s"],
        [
            [
                s.case.name,
                ", ".join(s.effects) or "mass, damper, spring",
                "; ".join(f"{value:.3g}" for _, value in s.train) + f" {s.case.unit}",
                "; ".join(f"{name}: {value:.3g} {s.case.unit}" for name, value in s.test),
                f"{s.seconds:.1f}",
            ]
            for s in scores
        ],
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True, help="folder with a folder for each set")
    parser.add_argument("--page", type=Path, help="page whose table is written anew")
    chosen = parser.parse_args()
    scores = [score(case, parts, effects) for case, parts in splits(chosen.data) for effects in case.effects]
    table = page(scores)
    print(table)
    if chosen.page:
        head, rest = chosen.page.read_text(encoding="utf-8").split(BEGIN)
        chosen.page.write_text(f"{head}{BEGIN}{table}\n{END}{rest.split(END)[1]}", encoding="utf-8")


if __name__ == "__main__":
    main()
