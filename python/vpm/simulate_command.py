"""Command line of simulations and scenarios: ``vpm simulate``."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vpm.command import FORMATS, Channels, Interpolate, console, drawable, load_pair, progress, save_plot, writable
from vpm.command_output import give, note, wrote
from vpm.errors import ValidityWarning, VpmError

if TYPE_CHECKING:
    from vpm.experiment import Experiment
    from vpm.simulate import Run


EXAMPLES = (
    "Example:  vpm simulate examples/emps/step.toml --plot    (writes step.png)\n\n"
    "Example:  vpm simulate examples/emps/model.toml log.csv --mode closed_loop --plot run.png"
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
        given = {"LOG": log, "--mode": mode, "--integrator": integrator, "--hold": hold, "--channels": channels}
        for name, value in given.items():
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
        note(f"warning: {message}")
    try:
        comparison = compare_run(run, record)
        give(comparison=comparison)
        console.print(str(comparison), markup=False)
    except VpmError as error:  # commands alone are enough to simulate
        console.print(f"not compared: {error}", markup=False)
    if out is not None:
        wrote(run.save(out))
