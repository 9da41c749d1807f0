"""Command line of the time of a step against a period: ``vpm budget``."""

from pathlib import Path
from typing import Annotated

import typer

from vpm.command import (
    Channels,
    Integrator,
    Interpolate,
    ModelPath,
    Plot,
    Share,
    console,
    load_model,
    load_pair,
    progress,
    save_plot,
)
from vpm.command_output import give

EXAMPLES = "Example:  vpm budget examples/emps/model.toml --rate 1000"


def budget(
    model: ModelPath,
    rate: Annotated[float, typer.Option(help="Rate of the controller, Hz.")] = 1000.0,
    share: Share = 0.2,
    steps: Annotated[int, typer.Option(help="Number of steps to time.")] = 1_000_000,
    integrator: Integrator = "auto",
    substeps: Annotated[int, typer.Option(help="Integration steps in a period.")] = 1,
    log: Annotated[
        Path | None, typer.Option(help="Record whose commands drive the model; by default a sum of sines.")
    ] = None,
    channels: Channels = None,
    interpolate: Interpolate = False,
    latency: Annotated[
        float, typer.Option(help="Time to watch how late an idle loop at this rate wakes up, s; 0 for not at all.")
    ] = 2.0,
    instructions: Annotated[
        bool, typer.Option("--instructions", help="Count them with valgrind: a minute more.")
    ] = False,
    priority: Annotated[
        int | None, typer.Option(help="Time before all ordinary threads, at this priority of SCHED_FIFO, if permitted.")
    ] = None,
    direct: Annotated[
        bool, typer.Option("--direct", help="Time direct evaluation in the place of machine code.")
    ] = False,
    plot: Plot = None,
) -> None:
    """Time one step of the model against a controller's period; exit code 1 if it does not fit."""
    from vpm.budget import budget as time_steps

    machine, record = (load_model(model), None) if log is None else load_pair(model, log, channels, interpolate)
    with progress() as tell:
        report = time_steps(
            machine,
            rate=rate,
            share=share,
            steps=steps,
            integrator=integrator,
            substeps=substeps,
            experiment=record,
            latency=latency,
            instructions=instructions,
            priority=priority,
            compiled=not direct,
            tell=tell,
        )
    give(budget=report)
    console.print(str(report), markup=False)
    save_plot(report.plot, plot)
    if not report.holds:
        raise typer.Exit(1)
