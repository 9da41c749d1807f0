"""Command line: ``vpm demo``, ``simulate``, ``compare``, ``identify``, ``diagnose``, ``rank`` and the others."""

from __future__ import annotations

import os
import signal
import sys
import warnings
from collections.abc import Sequence
from io import TextIOWrapper
from pathlib import Path
from threading import Event
from time import perf_counter
from types import FrameType
from typing import TYPE_CHECKING, Annotated

import typer
from typer.core import TyperGroup

from vpm import (
    __version__,
    check_command,
    detail_command,
    diagnose_command,
    identify_command,
    prove_command,
    rank_command,
)
from vpm.command import (
    BESIDE,
    FORMATS,
    PICTURES,
    Channels,
    Cutoff,
    Interpolate,
    Mode,
    ModelPath,
    OneLog,
    Plot,
    ReportFolder,
    console,
    drawable,
    errors,
    fillable,
    load_pair,
    progress,
    save_plot,
    warnings_told,
    writable,
)
from vpm.errors import INTERRUPTED, ValidityWarning, VpmError
from vpm.excite_command import app as excite_app
from vpm.files import exists
from vpm.simulate import HOLDS, INTEGRATORS, Setup

if TYPE_CHECKING:
    from vpm.experiment import Experiment
    from vpm.model import Model
    from vpm.simulate import Run


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
        other = not following or following.startswith("-") or exists(following)
        if word == "--plot" and other and not picture:
            full.append(BESIDE)
    return full


app = typer.Typer(
    cls=_Commands,
    name="vpm",
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)
app.add_typer(excite_app, name="excite")
app.command(epilog=check_command.EXAMPLES)(check_command.check)
app.command(epilog=identify_command.EXAMPLES)(identify_command.identify)
app.command(epilog=diagnose_command.EXAMPLES)(diagnose_command.diagnose)
app.command(epilog=rank_command.EXAMPLES)(rank_command.rank)
app.command(epilog=prove_command.EXAMPLES)(prove_command.prove)
detail_command.add_to(app)


def _version(asked: bool) -> None:
    if asked:
        console.print(f"vpm {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", is_eager=True, callback=_version, help="Say which version this is.")
    ] = False,
) -> None:
    """Virtual prototype models: simulate a robot, compare it with logs, identify it, and name what is missing."""


def main() -> None:
    """Run the command line.

    An error of the input is one sentence and exit code 1. After Ctrl-C the exit code is 130, also of commands that
    then tell what they know.
    """
    pressed = Event()

    def press(number: int, frame: FrameType | None) -> None:
        pressed.set()
        signal.default_int_handler(number, frame)

    before = signal.getsignal(signal.SIGINT)
    if before is not signal.SIG_IGN:  # as a shell starts background work of a script
        signal.signal(signal.SIGINT, press)
    code: str | int | None = 0
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="replace")  # letters that the encoding of a terminal does not have
    try:
        app()
    except SystemExit as end:
        code = end.code
    except VpmError as error:
        errors.print(f"error: {error}", markup=False)
        code = 1
    except KeyboardInterrupt:
        pressed.set()
    except Exception:  # a library that was being loaded may make one of Ctrl-C
        if not pressed.is_set():
            raise
    finally:
        signal.signal(signal.SIGINT, before)
    if pressed.is_set():
        errors.print("stopped by Ctrl-C")
        code = INTERRUPTED
    if console.trouble or errors.trouble:
        _tell_unwritten()
        code = code or 1
    sys.exit(code)


def _tell_unwritten() -> None:
    """Say that the output could not be written, and let it go."""
    for one, stream in ((console, sys.stdout), (errors, sys.stderr)):
        if one.trouble:
            # What is left in it would be tried again at the end, with a traceback.
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
    if reason := console.trouble:
        what = reason.strerror or str(reason)
        errors.print(f"error: standard output cannot be written ({what[:1].lower()}{what[1:]}); send it elsewhere")


@app.command(epilog="Example:  vpm info examples/emps/model.toml")
def info(model: Annotated[Path | None, typer.Argument(metavar="[MODEL]", help="Model file to list.")] = None) -> None:
    """Version, or a model's flexible links, how its steps run, and its parameters with units and bounds."""
    if model is None:
        console.print(f"vpm {__version__}")
        return
    from vpm.model import Model

    loaded = Model.load(model)
    console.print(repr(loaded), markup=False)
    for sentence in loaded.beam_summary:
        console.print(f"  {sentence}", markup=False)
    console.print(f"  {_way(loaded)}", markup=False)
    for p in loaded.parameters.values():
        spread = "known" if p.uncertainty is None else f"± {p.uncertainty:g}"
        console.print(
            f"  {p.name:40s} {p.value:14.6g} {p.unit:10s} {spread:12s} [{p.minimum:g}, {p.maximum:g}]", markup=False
        )


def _way(model: Model) -> str:
    """How steps of a model run."""
    begin = perf_counter()
    reason = model.core.compile(model.theta, Setup().method(model))
    spent = 1e3 * (perf_counter() - begin)
    return f"no machine code: {reason}" if reason else f"long runs are machine code, made in {spent:.0f} ms"


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
    hold: Annotated[
        str | None, typer.Option(help=f"What commands do between samples: {', '.join(HOLDS)}; the first by default.")
    ] = None,
    channels: Channels = None,
    interpolate: Interpolate = False,
    out: Annotated[Path | None, typer.Option(callback=writable, help="Save the run or the runs (NPZ) here.")] = None,
    plot: Annotated[
        Path | None,
        typer.Option(
            metavar="[PICTURE]",
            callback=drawable,
            help="Write the plot to this file (PNG, SVG or PDF); alone: to a PNG here, named after scenario or log.",
        ),
    ] = None,
) -> None:
    """Run a scenario: a test without a log. Or simulate a model on the inputs of a log and compare with it."""
    from vpm.model.messages import read_toml
    from vpm.simulate import simulate as simulate_log

    if "scenario" in read_toml(model):
        for value, name in (
            (log, "LOG"),
            (mode, "--mode"),
            (integrator, "--integrator"),
            (hold, "--hold"),
            (channels, "--channels"),
        ):
            if value is not None:
                raise VpmError(f"{model} is a scenario, which needs no {name}; leave it out, or name a model file")
        _simulate_scenario(model, out, plot)
    elif log is None:
        raise VpmError(
            f"{model} is a model file, and a simulation needs a log with it; name one, or a scenario file, which has "
            "the key scenario"
        )
    else:
        machine, record = load_pair(model, log, channels, interpolate)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ValidityWarning)  # they stand in the messages of the run
            run = simulate_log(
                machine, record, mode or "free_run", integrator=integrator or "auto", hold=hold or HOLDS[0]
            )
        _tell_run(run, record, out)
        save_plot(run.plot, plot, log)


def _simulate_scenario(path: Path, out: Path | None, plot: Path | None) -> None:
    from vpm.scenario import Scenario, ScenarioInterruptedError

    scenario, stopped = Scenario.load(path), False
    with progress() as tell, warnings.catch_warnings():
        warnings.simplefilter("ignore", ValidityWarning)  # they stand in the notes of the runs
        tell(f"{scenario.name}: {len(scenario.models)} runs")
        try:
            result = scenario.run(progress=lambda done, total: tell(f"{done} of {total} runs"))
        except ScenarioInterruptedError as interrupt:
            if not interrupt.result.runs:
                raise
            result, stopped = interrupt.result, True
    console.print(str(result), markup=False)
    if out is not None:
        result.save(out)
    save_plot(result.plot, plot, path)
    if stopped:
        raise KeyboardInterrupt
    if result.failures:
        raise VpmError(
            f"{path}: {len(result.failures)} of {len(scenario.models)} runs failed: {'; '.join(result.told)}"
        )


def _tell_run(run: Run, record: Experiment, out: Path | None) -> None:
    from vpm.compare import compare as compare_run

    console.print(repr(run), markup=False)
    for message in run.messages:
        console.print(f"warning: {message}", markup=False)
    try:
        console.print(str(compare_run(run, record)), markup=False)
    except VpmError as error:  # commands alone are enough to simulate
        console.print(f"not compared: {error}", markup=False)
    if out is not None:
        run.save(out)


@app.command(epilog="Example:  vpm compare examples/emps/model.toml log.csv --mode inverse_dynamics")
def compare(
    model: ModelPath,
    log: OneLog,
    mode: Mode = "inverse_dynamics",
    channels: Channels = None,
    interpolate: Interpolate = False,
    cutoff: Cutoff = None,
    plot: Plot = None,
    mcap: Annotated[
        Path | None,
        typer.Option(
            callback=writable, help="Write measured, simulated and residual, with a layout for Foxglove beside."
        ),
    ] = None,
) -> None:
    """Say where a model and a log part: error, fit, correlation, and where the residual lives."""
    from vpm.compare import compare as compare_run
    from vpm.compare import write_mcap
    from vpm.simulate import simulate as simulate_log

    machine, record = load_pair(model, log, channels, interpolate)
    with warnings_told():
        run = simulate_log(machine, record, mode, cutoff=cutoff)
    comparison = compare_run(run, record)
    console.print(str(comparison), markup=False)
    for channel in comparison.channels:
        for sentence in channel.where.sentences:
            console.print(f"  {channel.channel}: {sentence}", markup=False)
    save_plot(comparison.plot, plot)
    if mcap is not None:
        for written in write_mcap(comparison, mcap):
            console.print(f"{written} is written", markup=False)


@app.command(epilog="Example:  vpm report report/diagnosis.npz --out report/")
def report(
    diagnosis: Annotated[Path, typer.Argument(metavar="DIAGNOSIS", help="The diagnosis.npz of an earlier run.")],
    out: ReportFolder = Path("report"),
) -> None:
    """Tell the story of an earlier diagnosis again and write its report anew."""
    from vpm.discrepancy import Diagnosis
    from vpm.report import print_story, write_report

    earlier = Diagnosis.load(diagnosis)
    print_story(earlier, console)
    for path in write_report(earlier, out):
        console.print(f"wrote {path}", markup=False)


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
    save_plot(found.plot, plot)


@app.command(epilog="Example:  vpm demo --out demo-report\n\nExample:  vpm demo --hide torque_ripple")
def demo(
    out: Annotated[Path, typer.Option(help="Folder for report.json, report.html and the repaired model.")] = Path(
        "demo-report"
    ),
    hide: Annotated[
        str | None, typer.Option(metavar="EFFECT", help="Hide another effect: makes its log first, into OUT/log.")
    ] = None,
    listing: Annotated[bool, typer.Option("--list", help="List what can be hidden, and stop.")] = False,
) -> None:
    """Find the effect that is hidden in a log that comes with the package, or in one that is made on request."""
    from vpm.demo import print_list, run_demo

    if listing:
        print_list(console)
        return
    fillable(out)
    with progress() as tell:
        run_demo(out, console, tell, hide)
