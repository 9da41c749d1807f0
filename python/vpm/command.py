"""What the commands of the command line share: consoles, arguments, loading of files, progress, pictures."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Event, Lock, Thread
from time import perf_counter
from typing import TYPE_CHECKING, Annotated

import typer
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from vpm.command_output import console as console  # noqa: PLC0414  # commands say their results by these two
from vpm.command_output import detail, in_lines, note, notes, progressed, wrote
from vpm.command_output import errors as errors  # noqa: PLC0414
from vpm.errors import VpmError
from vpm.files import probe_file, probe_folder, replacing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from vpm.experiment import Experiment
    from vpm.model import Model

#: What ``--plot`` without a file name stands for, and the endings by which such a name is told from a model or a log.
BESIDE = "*.png"
PICTURES = (".png", ".svg", ".pdf")
#: Evaluations that a fit mostly takes; where its progress bar ends.
USUAL_EVALUATIONS = 15
#: Longest silence of a long command whose output goes to a file, s.
PERIOD = 10.0

ModelPath = Annotated[Path, typer.Argument(metavar="MODEL", help="Model file (TOML).")]
FORMATS = "CSV, Parquet, MAT, HDF5, ROS bag, MCAP, MDF, TDMS, ULog"
Logs = Annotated[list[Path], typer.Argument(metavar="LOG...", help=f"Measured records ({FORMATS}).")]
OneLog = Annotated[Path, typer.Argument(metavar="LOG", help=f"Measured record ({FORMATS}).")]
Interpolate = Annotated[bool, typer.Option("--interpolate", help="Bring uneven steps and clocks to one grid.")]
Channels = Annotated[
    Path | None, typer.Option(help="Channel table (TOML); by default the [channels] table of the model file.")
]
Cutoff = Annotated[
    float | None, typer.Option(help="Cut-off frequency of the motion filter, Hz; by default chosen from the record.")
]
Integrator = Annotated[
    str,
    typer.Option(
        help="auto, linearly_implicit, additive, crank_nicolson, rosenbrock, rk4, semi_implicit, guarded, adaptive, "
        "adaptive(1e-8)."
    ),
]
Hold = Annotated[
    str,
    typer.Option(
        help="What commands of a log do between samples: zero_order (as of a digital controller), first_order or cubic."
    ),
]
FoundHold = Annotated[
    str,
    typer.Option(
        help="What commands of a log do between samples: zero_order (sent by a controller), first_order or cubic (read "
        "back); auto finds out from the logs, but not where drives have states."
    ),
]
Check = Annotated[
    bool, typer.Option("--check/--no-check", help="Refuse logs with a wrong unit, sign, name or clock, see vpm check.")
]
Share = Annotated[float, typer.Option(help="Share of the period that a step may take at its 99.9 % quantile.")]
Words = list[str] | None
Effect = Annotated[Words, typer.Option(help="Try only these effects; repeat.")]
Without = Annotated[Words, typer.Option(help="Try all effects but these; repeat.")]
Workers = Annotated[int, typer.Option(min=0, help="Candidates at a time; 0 for one per core. The result is the same.")]


def writable(path: Path | None) -> Path | None:
    """A file to write in the end, refused at once where it could not be written."""
    if path is not None:
        probe_file(path)
    return path


def fillable(path: Path | None) -> Path | None:
    """A folder to write into in the end, refused at once where it could not be written."""
    if path is not None:
        probe_folder(path)
    return path


def drawable(path: Path | None) -> Path | None:
    """A picture to write in the end, refused at once where its ending is no format or it could not be written."""
    if path is not None and path.suffix.lower() not in PICTURES:
        raise VpmError(f"{path} is no name of a picture; give it one of the endings {', '.join(PICTURES)}")
    if str(path) == BESIDE:  # it gets its name later
        return fillable(Path.cwd()) and path
    return writable(path)


Plot = Annotated[Path | None, typer.Option(callback=drawable, help="Write the plot to this file (PNG, SVG or PDF).")]
ReportFolder = Annotated[
    Path, typer.Option(callback=fillable, help="Folder for report.json, report.html and the repaired model.")
]

Tell = Callable[[str], None]
Each = Callable[[str, str, int, int], None]


def load_model(path: Path) -> Model:
    """Model of a model file that a command names."""
    from vpm.model import Model

    model = Model.load(path)
    detail(f"read {path}: {model.name}, {len(model.parameters)} parameters")
    return model


def load_record(path: Path, model: Model, channels: Path | None, interpolate: bool) -> Experiment:
    """Record of a log that a command names, with its channels as the model names them."""
    from vpm.experiment import Experiment

    record = Experiment.load(path, channels, model, irregular="interpolate" if interpolate else "error")
    detail(f"read {path}: {record.time.size} samples of {len(record.channels)} channels")
    return record


def load_pair(model: Path, log: Path, channels: Path | None, interpolate: bool) -> tuple[Model, Experiment]:
    """Model and one record of the files that a command names."""
    machine = load_model(model)
    return machine, load_record(log, machine, channels, interpolate)


def load_all(
    model: Path, logs: list[Path], channels: Path | None, interpolate: bool, unseen: list[Path] | None = None
) -> tuple[Model, list[Experiment], list[Experiment]]:
    """Model, records of the files that a command names, and those that judge it, if it names any."""
    machine = load_model(model)
    every = [load_record(log, machine, channels, interpolate) for log in (*logs, *(unseen or ()))]
    return machine, every[: len(logs)], every[len(logs) :]


class _Lines:
    """What is being done, in lines of a file: what is new at once, and the last word again after every `PERIOD`.

    Words that differ in their numbers only are not new, so that a long search does not fill the file.
    """

    def __init__(self) -> None:
        self._text, self._words = "", ""
        self._lock, self._over = Lock(), Event()

    def tell(self, text: str) -> None:
        with self._lock:
            new = (words := re.sub(r"[\d.]+", "#", text)) != self._words
            self._text, self._words = text, words
            if new:
                progressed(text)

    def each(self, what: str, name: str, done: int, total: int) -> None:
        with self._lock:
            new, self._words = what != self._words, what
            self._text = f"{what} {done} of {total}: {name}"
            if new:
                progressed(self._text)

    def _repeat(self) -> None:
        begin = perf_counter()
        while not self._over.wait(PERIOD):
            with self._lock:
                progressed(f"{self._text or 'at work'} (after {perf_counter() - begin:.0f} s)")

    def __enter__(self) -> _Lines:
        self._thread = Thread(target=self._repeat, name="progress", daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()


def to_try(only: list[str] | None, without: list[str] | None) -> list[str] | None:
    """Names of the effects to try; None for all."""
    from vpm.discrepancy.screening.candidates import asked_for
    from vpm.errors import DiagnosisError, near_match

    if not without:
        return only or None
    given = only or asked_for(None)
    for name in without:
        if name not in given:
            raise DiagnosisError(f'--without: "{name}" is not among the effects to try; {near_match(name, given)}')
    left = [name for name in given if name not in without]
    if not left:
        raise DiagnosisError("--without leaves no effect to try; leave fewer out")
    return left


@contextmanager
def progress() -> Iterator[Callable[[str], None]]:
    """A line on the terminal that says what is being done; some lines where the output goes to a file."""
    if in_lines():
        with _Lines() as lines:
            yield lines.tell
        return
    with notes.status("starting") as status:
        yield status.update


@contextmanager
def searching() -> Iterator[tuple[Tell, Each]]:
    """A bar of the candidates of each round; some lines where the output goes to a file.

    What an interruption says of itself is noted.
    """
    try:
        with _searching() as told:
            yield told
    except KeyboardInterrupt as stopped:
        if stopped.args:
            note(str(stopped))
        raise


@contextmanager
def _searching() -> Iterator[tuple[Tell, Each]]:
    if in_lines():
        with _Lines() as lines:
            yield lines.tell, lines.each
        return
    words = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[name]}"))
    with Progress(*words, TimeElapsedColumn(), console=notes, transient=True) as bar:
        task = bar.add_task("starting", total=None, name="")

        def tell(text: str) -> None:
            bar.update(task, description=text, completed=0, total=None, name="")

        def each(what: str, name: str, done: int, total: int) -> None:
            bar.update(task, description=what, completed=done, total=total, name=name)

        yield tell, each


@contextmanager
def fitting(starts: int) -> Iterator[Callable[[int, float], None]]:
    """A bar of the evaluations of a fit with its residual; some lines where the output goes to a file."""
    if in_lines():
        with _Lines() as lines:
            yield lambda n, r: lines.tell(f"evaluation {n}: residual {r:.5g}")
        return
    words = TextColumn("evaluation {task.completed}: residual {task.fields[residual]:.5g}")
    with Progress(TextColumn("fitting"), BarColumn(), words, TimeElapsedColumn(), console=notes) as bar:
        task = bar.add_task("fitting", total=USUAL_EVALUATIONS * starts, residual=float("nan"))
        yield lambda n, r: bar.update(task, completed=n, total=max(n, USUAL_EVALUATIONS * starts), residual=r)


def save_plot(draw: Callable[[], Figure], path: Path | None, named: Path | None = None) -> None:
    """Draw to a file; one that is to be named after another file is a PNG in the working directory."""
    if path is not None:
        path = Path(f"{named.stem}.png") if named is not None and str(path) == BESIDE else path
        with replacing(path) as beside:
            draw().savefig(beside)
        wrote(path)
