"""Command line: ``vpm demo``, ``simulate``, ``compare``, ``identify``, ``diagnose`` and the others."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from typer.core import TyperGroup

from vpm import __version__
from vpm.errors import ValidityWarning, VpmError
from vpm.excite_command import app as excite_app
from vpm.identify import options
from vpm.simulate import INTEGRATORS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from vpm.experiment import Experiment
    from vpm.model import Model

#: What ``--plot`` without a file name stands for, and the endings by which such a name is told from a model or a log.
BESIDE = "*.png"
PICTURES = (".png", ".svg", ".pdf")


class _Commands(TyperGroup):
    """The commands; ``--plot`` of ``simulate`` may stand alone, also before the files that the command works on."""

    def main(
        self,
        args: Sequence[str] | None = None,
        prog_name: str | None = None,
        complete_var: str | None = None,
        standalone_mode: bool = True,
        windows_expand_args: bool = True,
        **extra: object,
    ) -> object:
        """Run the command of a command line."""
        words = _with_picture(sys.argv[1:] if args is None else list(args))
        return super().main(words, prog_name, complete_var, standalone_mode, windows_expand_args, **extra)


def _with_picture(words: list[str]) -> list[str]:
    """Give ``--plot`` the value `BESIDE` where an option, a file or nothing follows it."""
    if words[:1] != ["simulate"]:
        return words
    full: list[str] = []
    for word, following in zip(words, [*words[1:], ""], strict=True):
        full.append(word)
        picture = Path(following).suffix.lower() in PICTURES
        other = not following or following.startswith("-") or Path(following).is_file()
        if word == "--plot" and other and not picture:
            full.append(BESIDE)
    return full


app = typer.Typer(
    cls=_Commands,
    name="vpm",
    help="Virtual prototype models: simulate a robot, compare it with logs, identify it, and name what is missing.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)
app.add_typer(excite_app, name="excite")
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
    typer.Option(help="auto, linearly_implicit, rosenbrock, rk4, semi_implicit, guarded, adaptive, adaptive(1e-8)."),
]
Plot = Annotated[Path | None, typer.Option(help="Write the plot to this file (PNG, SVG or PDF).")]
Out = Annotated[Path, typer.Option(help="Folder for report.json, report.html and the repaired model.")]


def main() -> None:
    """Run the command line; an error of the input is one sentence and exit code 1."""
    try:
        app()
    except VpmError as error:
        errors.print(f"error: {error}", markup=False)
        sys.exit(1)


@app.command(epilog="Example:  vpm info examples/emps/model.toml")
def info(model: Annotated[Path | None, typer.Argument(metavar="[MODEL]", help="Model file to list.")] = None) -> None:
    """Version, or a model's flexible links, and its parameters with units and bounds."""
    if model is None:
        console.print(f"vpm {__version__}")
        return
    from vpm.model import Model

    loaded = Model.load(model)
    console.print(repr(loaded), markup=False)
    for sentence in loaded.beam_summary:
        console.print(f"  {sentence}", markup=False)
    for p in loaded.parameters.values():
        spread = "known" if p.uncertainty is None else f"± {p.uncertainty:g}"
        console.print(
            f"  {p.name:40s} {p.value:14.6g} {p.unit:10s} {spread:12s} [{p.minimum:g}, {p.maximum:g}]", markup=False
        )


@app.command(
    epilog="Example:  vpm simulate examples/emps/step.toml --plot    (writes step.png)\n\n"
    "Example:  vpm simulate examples/emps/model.toml log.csv --mode closed_loop --plot run.png",
)
def simulate(
    model: Annotated[Path, typer.Argument(metavar="FILE", help="Scenario, or model file that a LOG goes with (TOML).")],
    log: Annotated[
        Path | None, typer.Argument(metavar="LOG", help=f"Measured record ({FORMATS}), for a model file.")
    ] = None,
    mode: Annotated[
        str | None,
        typer.Option(
            help="free_run, inverse_dynamics, restarts, closed_loop or prescribed_motion; free_run by default.",
            metavar="MODE",
        ),
    ] = None,
    integrator: Annotated[
        str | None,
        typer.Option(help=f"{', '.join(INTEGRATORS)}; auto by default, or what the scenario says."),
    ] = None,
    channels: Channels = None,
    interpolate: Interpolate = False,
    out: Annotated[Path | None, typer.Option(help="Save the run or the runs (NPZ) here.")] = None,
    plot: Annotated[
        Path | None,
        typer.Option(
            metavar="[PICTURE]",
            help="Write the plot to this file (PNG, SVG or PDF); alone: to a PNG here, named after scenario or log.",
        ),
    ] = None,
) -> None:
    """Run a scenario: a test without a log. Or simulate a model on the inputs of a log and compare with it."""
    from vpm.model.messages import read_toml

    if "scenario" in read_toml(model):
        for value, name in ((log, "LOG"), (mode, "--mode"), (integrator, "--integrator"), (channels, "--channels")):
            if value is not None:
                raise VpmError(f"{model} is a scenario, which needs no {name}; leave it out, or name a model file")
        _simulate_scenario(model, out, plot)
    elif log is None:
        raise VpmError(
            f"{model} is a model file, and a simulation needs a log with it; name one, or a scenario file, which has "
            "the key scenario"
        )
    else:
        _simulate_log(model, log, mode or "free_run", integrator or "auto", channels, interpolate, out, plot)


def _simulate_scenario(path: Path, out: Path | None, plot: Path | None) -> None:
    from vpm.scenario import Scenario

    scenario = Scenario.load(path)
    with _progress() as tell, warnings.catch_warnings():
        warnings.simplefilter("ignore", ValidityWarning)  # they stand in the notes of the runs
        tell(f"{scenario.name}: {len(scenario.models)} runs")
        result = scenario.run(progress=lambda done, total: tell(f"{done} of {total} runs"))
    console.print(str(result), markup=False)
    if out is not None:
        result.save(out)
    _save_plot(result.plot, plot, path)
    if result.failures:
        raise VpmError(
            f"{path}: {len(result.failures)} of {len(scenario.models)} runs failed: {'; '.join(result.told)}"
        )


def _simulate_log(
    model: Path,
    log: Path,
    mode: str,
    integrator: str,
    channels: Path | None,
    interpolate: bool,
    out: Path | None,
    plot: Path | None,
) -> None:
    from vpm.compare import compare as compare_run
    from vpm.simulate import simulate as simulate_log

    machine, record = _load(model, log, channels, interpolate)
    with _warnings_told():
        run = simulate_log(machine, record, mode, integrator=integrator)
    console.print(repr(run), markup=False)
    try:
        console.print(str(compare_run(run, record)), markup=False)
    except VpmError as error:  # commands alone are enough to simulate
        console.print(f"not compared: {error}", markup=False)
    if out is not None:
        run.save(out)
    _save_plot(run.plot, plot, log)


@app.command(epilog="Example:  vpm compare examples/emps/model.toml log.csv --mode inverse_dynamics")
def compare(
    model: ModelPath,
    log: OneLog,
    mode: Mode = "inverse_dynamics",
    channels: Channels = None,
    interpolate: Interpolate = False,
    cutoff: Cutoff = None,
    plot: Plot = None,
) -> None:
    """Say where a model and a log part: error, fit, correlation, and where the residual lives."""
    from vpm.compare import compare as compare_run
    from vpm.simulate import simulate as simulate_log

    machine, record = _load(model, log, channels, interpolate)
    with _warnings_told():
        run = simulate_log(machine, record, mode, cutoff=cutoff)
    comparison = compare_run(run, record)
    console.print(str(comparison), markup=False)
    for channel in comparison.channels:
        for sentence in channel.where.sentences:
            console.print(f"  {channel.channel}: {sentence}", markup=False)
    _save_plot(comparison.plot, plot)


@app.command(
    epilog="Example:  vpm identify examples/emps/model.toml log.csv --free carriage.mass --free axis.friction.viscous"
    "\n\n"
    "Example:  vpm identify rig.toml a.csv b.csv --mode free_run --log --noise estimated --starts 12\n\n"
    "Example:  vpm identify rig.toml a.csv --mode free_run --piece 0.5 --loss huber --profile slide.mass",
)
def identify(
    model: ModelPath,
    logs: Logs,
    free: options.Free = None,
    mode: Mode = "inverse_dynamics",
    channels: Channels = None,
    interpolate: Interpolate = False,
    cutoff: Cutoff = None,
    integrator: Integrator = "auto",
    substeps: options.Substeps = 1,
    horizon: options.Horizon = 0.25,
    compare_only: options.Compared = None,
    log: options.Log = False,
    bound: options.Bound = None,
    noise: options.Noise = None,
    noise_level: options.NoiseLevel = None,
    loss: options.Loss = None,
    priors: options.Priors = False,
    starts: options.Starts = 1,
    seed: options.Seed = 0,
    fit_state: options.FitState = None,
    known_state: options.KnownState = None,
    piece: options.Piece = 0.0,
    profile: options.ProfileOf = None,
    replicates: options.Replicates = 0,
    workers: options.Workers = 0,
    out: Annotated[Path | None, typer.Option(help="Write the fitted model (TOML) here.")] = None,
) -> None:
    """Fit parameters to one or several logs. Ctrl-C ends a fit and keeps the best until then."""
    from vpm.identify import Fitting
    from vpm.identify import identify as fit_logs
    from vpm.identify.words import numbers, ranges, shown, told, told_intervals
    from vpm.simulate import Setup

    settings = Fitting(
        channels=tuple(compare_only or ()),
        log=log,
        bounds=ranges(bound, "--bound", "NAME=LOW:HIGH"),
        noise="given" if noise_level else noise or "spread",
        noise_levels=numbers(noise_level, "--noise-level", "CHANNEL=STD"),
        loss=loss or "squares",
        priors=priors,
        starts=starts,
        states=tuple(fit_state or ()),
        known_states=numbers(known_state, "--known-state", "STATE=VALUE"),
        piece=piece,
        seed=seed,
        workers=workers,
    )
    asked = settings != Fitting(workers=workers, seed=seed) or noise or loss
    machine, records = _load_all(model, logs, channels, interpolate)
    with shown(errors, starts) as tell:
        setup, chosen = Setup(integrator, substeps, horizon), settings if asked else None
        fit = fit_logs(machine, records, free, mode=mode, cutoff=cutoff, setup=setup, progress=tell, fitting=chosen)
    for line in told(fit) + told_intervals(fit, records, profile or [], replicates, seed, cutoff):
        console.print(f"  {line}", markup=False)
    if out is not None:
        fit.model.save(out)


@app.command(epilog="Example:  vpm diagnose model.toml train.csv --validate test.csv --out report/")
def diagnose(
    model: ModelPath,
    logs: Logs,
    validate: Annotated[
        list[Path] | None, typer.Option(help="Record that is never fitted; repeat. Default: 30 % of each log.")
    ] = None,
    out: Out = Path("report"),
    effect: Annotated[list[str] | None, typer.Option(help="Try only these effects; repeat.")] = None,
    channels: Channels = None,
    interpolate: Interpolate = False,
    cutoff: Cutoff = None,
) -> None:
    """Name the physical effect that a model is missing, with evidence on unseen data."""
    from vpm.discrepancy import diagnose as find_missing
    from vpm.report import print_story, write_report

    machine, records = _load_all(model, logs, channels, interpolate)
    unseen = [_record(path, machine, channels, interpolate) for path in validate or []]
    with _progress() as tell:
        diagnosis = find_missing(machine, records, unseen or None, effects=effect or None, cutoff=cutoff, tell=tell)
    print_story(diagnosis, console)
    for path in write_report(diagnosis, out):
        console.print(f"wrote {path}", markup=False)


@app.command(epilog="Example:  vpm report report/diagnosis.npz --out report/")
def report(
    diagnosis: Annotated[Path, typer.Argument(metavar="DIAGNOSIS", help="The diagnosis.npz of an earlier run.")],
    out: Out = Path("report"),
) -> None:
    """Tell the story of an earlier diagnosis again and write its report anew."""
    from vpm.discrepancy import Diagnosis
    from vpm.report import print_story, write_report

    earlier = Diagnosis.load(diagnosis)
    print_story(earlier, console)
    for path in write_report(earlier, out):
        console.print(f"wrote {path}", markup=False)


@app.command(epilog="Example:  vpm simplify model.toml log.csv --rate 1000 --tolerance 0.05")
def simplify(
    model: ModelPath,
    logs: Logs,
    rate: Annotated[float, typer.Option(help="Rate of the controller, Hz.")] = 1000.0,
    tolerance: Annotated[float, typer.Option(help="Largest loss of accuracy, as a share of the signal.")] = 0.02,
    channels: Channels = None,
    interpolate: Interpolate = False,
    out: Annotated[Path | None, typer.Option(help="Write the simplified model (TOML) here.")] = None,
) -> None:
    """Find the cheapest model that still tells the truth within a tolerance."""
    from vpm.simplify import simplify as find_cheapest

    machine, records = _load_all(model, logs, channels, interpolate)
    with _progress() as tell:
        ladder = find_cheapest(machine, records, rate=rate, tolerance=tolerance, tell=tell)
    console.print(str(ladder), markup=False)
    if out is not None:
        ladder.model.save(out)


@app.command(epilog="Example:  vpm budget examples/emps/model.toml --rate 1000")
def budget(
    model: ModelPath,
    rate: Annotated[float, typer.Option(help="Rate of the controller, Hz.")] = 1000.0,
    share: Annotated[
        float, typer.Option(help="Share of the period that a step may take at its 99.9 % quantile.")
    ] = 0.2,
    steps: Annotated[int, typer.Option(help="Number of steps to time.")] = 1_000_000,
    integrator: Integrator = "auto",
) -> None:
    """Time one step of the model against a controller's period; exit code 1 if it does not fit."""
    from vpm.budget import budget as time_steps

    report = time_steps(_model(model), rate=rate, share=share, steps=steps, integrator=integrator)
    console.print(str(report), markup=False)
    if not report.holds:
        raise typer.Exit(1)


@app.command(epilog="Example:  vpm linkage examples/karl/karl.toml --plot karl.png")
def linkage(
    path: Annotated[Path, typer.Argument(metavar="LINKAGE", help="File of a closed linkage (TOML).")],
    plot: Plot = None,
) -> None:
    """Say what a closed linkage can do: singular strokes of KARL, cylinders and shares of dynamics of a leg."""
    from vpm.linkages import load

    found = load(path)
    console.print(repr(found), markup=False)
    for sentence in found.summary:
        console.print(f"  {sentence}", markup=False)
    _save_plot(found.plot, plot)


@app.command(epilog="Example:  vpm demo --out demo-report")
def demo(out: Out = Path("demo-report")) -> None:
    """Find the effect that is hidden in a log that comes with the package."""
    from vpm.demo import run_demo

    with _progress() as tell:
        run_demo(out, console, tell)


def _model(path: Path) -> Model:
    from vpm.model import Model

    return Model.load(path)


def _record(path: Path, model: Model, channels: Path | None, interpolate: bool) -> Experiment:
    from vpm.experiment import Experiment

    return Experiment.load(path, channels, model, irregular="interpolate" if interpolate else "error")


def _load(model: Path, log: Path, channels: Path | None, interpolate: bool) -> tuple[Model, Experiment]:
    machine = _model(model)
    return machine, _record(log, machine, channels, interpolate)


def _load_all(
    model: Path, logs: list[Path], channels: Path | None, interpolate: bool
) -> tuple[Model, list[Experiment]]:
    machine = _model(model)
    return machine, [_record(log, machine, channels, interpolate) for log in logs]


@contextmanager
def _progress() -> Iterator[Callable[[str], None]]:
    """A line on the terminal that says what is being done; a line each where the output goes to a file."""
    if not errors.is_terminal:
        yield partial(errors.print, markup=False)
        return
    with errors.status("starting") as status:
        yield status.update


@contextmanager
def _warnings_told() -> Iterator[None]:
    """Warnings as one sentence each, without the line of the program that they come from."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always", ValidityWarning)
        try:
            yield
        finally:
            for warning in told:
                errors.print(f"warning: {warning.message}", markup=False)


def _save_plot(draw: Callable[[], Figure], path: Path | None, named: Path | None = None) -> None:
    """Draw to a file; one that is to be named after another file is a PNG in the working directory."""
    if path is not None:
        path = Path(f"{named.stem}.png") if named is not None and str(path) == BESIDE else path
        if path.suffix.lower() not in PICTURES:
            raise VpmError(f"{path} is no name of a picture; give it one of the endings {', '.join(PICTURES)}")
        draw().savefig(path)
        console.print(f"wrote {path}", markup=False)
