"""What the commands of the command line share: consoles, arguments, loading of files, progress, pictures."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from vpm.errors import ValidityWarning, VpmError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from vpm.experiment import Experiment
    from vpm.model import Model

#: What ``--plot`` without a file name stands for, and the endings by which such a name is told from a model or a log.
BESIDE = "*.png"
PICTURES = (".png", ".svg", ".pdf")

console = Console(highlight=False, soft_wrap=True)
errors = Console(stderr=True, highlight=False, soft_wrap=True)

ModelPath = Annotated[Path, typer.Argument(metavar="MODEL", help="Model file (TOML).")]
FORMATS = "CSV, Parquet, MAT, HDF5, ROS bag, MCAP"
Logs = Annotated[list[Path], typer.Argument(metavar="LOG...", help=f"Measured records ({FORMATS}).")]
OneLog = Annotated[Path, typer.Argument(metavar="LOG", help=f"Measured record ({FORMATS}).")]
Interpolate = Annotated[bool, typer.Option("--interpolate", help="Bring uneven steps and clocks to one grid.")]
Channels = Annotated[
    Path | None, typer.Option(help="Channel table (TOML); by default the [channels] table of the model file.")
]
Cutoff = Annotated[
    float | None, typer.Option(help="Cut-off frequency of the motion filter, Hz; by default chosen from the record.")
]
Mode = Annotated[
    str,
    typer.Option(
        help="free_run, inverse_dynamics, restarts, closed_loop or prescribed_motion.",
        metavar="MODE",
        show_default=True,
    ),
]
Integrator = Annotated[
    str,
    typer.Option(
        help="auto, linearly_implicit, additive, rosenbrock, rk4, semi_implicit, guarded, adaptive, adaptive(1e-8)."
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
        "back); auto finds out from the logs of machines that a ranking covers."
    ),
]
Check = Annotated[
    bool, typer.Option("--check/--no-check", help="Refuse logs with a wrong unit, sign, name or clock, see vpm check.")
]
Workers = Annotated[int, typer.Option(min=0, help="Candidates at a time; 0 for one per core. The result is the same.")]
Plot = Annotated[Path | None, typer.Option(help="Write the plot to this file (PNG, SVG or PDF).")]

Tell = Callable[[str], None]
Each = Callable[[str, str, int, int], None]


def load_model(path: Path) -> Model:
    """Model of a file."""
    from vpm.model import Model

    return Model.load(path)


def load_record(path: Path, model: Model, channels: Path | None, interpolate: bool) -> Experiment:
    """Record of a file, with its channels as the model names them."""
    from vpm.experiment import Experiment

    return Experiment.load(path, channels, model, irregular="interpolate" if interpolate else "error")


def load_pair(model: Path, log: Path, channels: Path | None, interpolate: bool) -> tuple[Model, Experiment]:
    """Model and record."""
    machine = load_model(model)
    return machine, load_record(log, machine, channels, interpolate)


def load_all(model: Path, logs: list[Path], channels: Path | None, interpolate: bool) -> tuple[Model, list[Experiment]]:
    """Model and several records."""
    machine = load_model(model)
    return machine, [load_record(log, machine, channels, interpolate) for log in logs]


@contextmanager
def progress() -> Iterator[Callable[[str], None]]:
    """A line on the terminal that says what is being done; a line each where the output goes to a file."""
    if not errors.is_terminal:
        yield partial(errors.print, markup=False)
        return
    with errors.status("starting") as status:
        yield status.update


@contextmanager
def searching() -> Iterator[tuple[Tell, Each]]:
    """A bar of the candidates of each round; a line each where the output goes to a file."""
    if not errors.is_terminal:
        yield (
            lambda text: errors.print(text, markup=False),
            lambda what, name, done, total: errors.print(f"{what} {done} of {total}: {name}", markup=False),
        )
        return
    words = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[name]}"))
    with Progress(*words, TimeElapsedColumn(), console=errors, transient=True) as bar:
        task = bar.add_task("starting", total=None, name="")

        def tell(text: str) -> None:
            bar.update(task, description=text, completed=0, total=None, name="")

        def each(what: str, name: str, done: int, total: int) -> None:
            bar.update(task, description=what, completed=done, total=total, name=name)

        yield tell, each


@contextmanager
def warnings_told() -> Iterator[None]:
    """Warnings as one sentence each, without the line of the program that they come from."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always", ValidityWarning)
        try:
            yield
        finally:
            for warning in told:
                errors.print(f"warning: {warning.message}", markup=False)


def save_plot(draw: Callable[[], Figure], path: Path | None, named: Path | None = None) -> None:
    """Draw to a file; one that is to be named after another file is a PNG in the working directory."""
    if path is not None:
        path = Path(f"{named.stem}.png") if named is not None and str(path) == BESIDE else path
        if path.suffix.lower() not in PICTURES:
            raise VpmError(f"{path} is no name of a picture; give it one of the endings {', '.join(PICTURES)}")
        draw().savefig(path)
        console.print(f"wrote {path}", markup=False)
