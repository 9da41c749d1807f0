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
from traceback import format_exception
from types import FrameType
from typing import TYPE_CHECKING, Annotated, TextIO

import typer
from typer.core import TyperGroup

from vpm import (
    __version__,
    check_command,
    detail_command,
    diagnose_command,
    export_command,
    identify_command,
    import_command,
    info_command,
    optimise_command,
    prove_command,
    rank_command,
    reduce_command,
    study_command,
    view_command,
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
    writable,
)
from vpm.errors import INTERRUPTED, ValidityWarning, VpmError
from vpm.excite_command import app as excite_app
from vpm.files import exists
from vpm.manner import STOPPED, add_flags, asked, give, notes, speak, unexpected, wrote

if TYPE_CHECKING:
    from vpm.experiment import Experiment
    from vpm.simulate import Run


class _Commands(TyperGroup):
    """The commands, run by `speak`; ``--plot`` of ``simulate`` may stand alone, also before its files."""

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
        run = super().main

        def one(alone: bool) -> object:
            return run(words, prog_name, complete_var, standalone_mode and alone, windows_expand_args, **extra)

        return speak(one, asked(words, self._command(words)))

    def _command(self, words: list[str]) -> str:
        """Which command it is, in words."""
        path, known = [], self.commands
        for word in words:
            if word in known:
                path.append(word)
                known = getattr(known[word], "commands", {})
        return " ".join(path)


def _with_picture(words: list[str]) -> list[str]:
    """Give ``--plot`` the value `BESIDE` where an option, a file or nothing follows it."""
    if next((word for word in words if not word.startswith("-")), "") != "simulate":
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
app.command(epilog=info_command.EXAMPLES)(info_command.info)
app.command(epilog=check_command.EXAMPLES)(check_command.check)
app.command(epilog=identify_command.EXAMPLES)(identify_command.identify)
app.command(epilog=diagnose_command.EXAMPLES)(diagnose_command.diagnose)
app.command(epilog=rank_command.EXAMPLES)(rank_command.rank)
app.command(epilog=optimise_command.EXAMPLES)(optimise_command.optimise)
app.command(epilog=prove_command.EXAMPLES)(prove_command.prove)
app.command(epilog=study_command.EXAMPLES)(study_command.study)
app.command(epilog=view_command.EXAMPLES)(view_command.view)
app.command("import", epilog=import_command.EXAMPLES)(import_command.import_)
app.command(epilog=export_command.EXAMPLES)(export_command.export)
app.command(epilog=reduce_command.EXAMPLES)(reduce_command.reduce)
detail_command.add_to(app)


def _version(asked: bool) -> None:
    if asked:
        give(version=__version__)
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
    except BrokenPipeError:
        _let_go(sys.stdout)
        code = 1
    except Exception as error:  # noqa: BLE001  # a library that was being loaded may make one of Ctrl-C
        code = 1
        if not pressed.is_set():
            _tell_unexpected(error)
    finally:
        signal.signal(signal.SIGINT, before)
    if pressed.is_set():
        errors.print(STOPPED)
        code = INTERRUPTED
    if console.trouble or errors.trouble or notes.trouble:
        _tell_unwritten()
        code = code or 1
    sys.exit(code)


def _tell_unexpected(error: Exception) -> None:
    if asked(sys.argv[1:]).verbose:
        errors.print("".join(format_exception(error)), markup=False)
    errors.print(f"error: {unexpected(error)}", markup=False)


def _tell_unwritten() -> None:
    """Say that the output could not be written, and let it go."""
    for one, stream in ((console, sys.stdout), (errors, sys.stderr), (notes, sys.stderr)):
        if one.trouble:
            _let_go(stream)
    if reason := console.trouble:
        what = reason.strerror or str(reason)
        errors.print(f"error: standard output cannot be written ({what[:1].lower()}{what[1:]}); send it elsewhere")


def _let_go(stream: TextIO) -> None:
    """Send what is left in a stream nowhere: it would be tried again at the end, with a traceback."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


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
        typer.Option(
            help="auto, linearly_implicit, additive, crank_nicolson, rosenbrock, rk4, semi_implicit, guarded or "
            "adaptive; by default auto, or what the scenario says."
        ),
    ] = None,
    hold: Annotated[
        str | None,
        typer.Option(help="What commands do between samples: zero_order, first_order, cubic; the first by default."),
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
    from vpm.model.reading import read_toml
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
                machine, record, mode or "free_run", integrator=integrator or "auto", hold=hold or "zero_order"
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
    give(scenario=result)
    console.print(str(result), markup=False)
    if out is not None:
        wrote(result.save(out))
    save_plot(result.plot, plot, path)
    if stopped:
        raise KeyboardInterrupt
    if result.failures:
        raise VpmError(
            f"{path}: {len(result.failures)} of {len(scenario.models)} runs failed: {'; '.join(result.told)}"
        )


def _tell_run(run: Run, record: Experiment, out: Path | None) -> None:
    from vpm.compare import compare as compare_run

    give(run=run)
    console.print(repr(run), markup=False)
    for message in run.messages:
        console.print(f"warning: {message}", markup=False)
    try:
        comparison = compare_run(run, record)
        give(comparison=comparison)
        console.print(str(comparison), markup=False)
    except VpmError as error:  # commands alone are enough to simulate
        console.print(f"not compared: {error}", markup=False)
    if out is not None:
        wrote(run.save(out))


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
    comparison = compare_run(simulate_log(machine, record, mode, cutoff=cutoff), record)
    give(comparison=comparison)
    console.print(str(comparison), markup=False)
    for channel in comparison.channels:
        for sentence in channel.where.sentences:
            console.print(f"  {channel.channel}: {sentence}", markup=False)
    save_plot(comparison.plot, plot)
    if mcap is not None:
        wrote(*write_mcap(comparison, mcap))


@app.command(epilog="Example:  vpm report report/diagnosis.npz --out report/")
def report(
    diagnosis: Annotated[Path, typer.Argument(metavar="DIAGNOSIS", help="The diagnosis.npz of an earlier run.")],
    out: ReportFolder = Path("report"),
) -> None:
    """Tell the story of an earlier diagnosis again and write its report anew."""
    from vpm.discrepancy import Diagnosis
    from vpm.report import print_story, write_report

    earlier = Diagnosis.load(diagnosis)
    give(diagnosis=earlier)
    print_story(earlier, console)
    wrote(*write_report(earlier, out))


@app.command(epilog="Example:  vpm linkage examples/karl/karl.toml --plot karl.png")
def linkage(
    path: Annotated[Path, typer.Argument(metavar="LINKAGE", help="File of a closed linkage (TOML).")],
    plot: Plot = None,
) -> None:
    """Say what a closed linkage can do: singular strokes of KARL, cylinders and shares of dynamics of a leg."""
    from vpm.linkages import load

    found = load(path)
    give(name=found.name, kind=type(found).__name__, summary=found.summary)
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
        give(effects=print_list(console))
        return
    fillable(out)
    with progress() as tell:
        give(diagnosis=run_demo(out, console, tell, hide, wrote))


add_flags(app)
