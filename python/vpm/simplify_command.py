"""Command line of model reduction: ``vpm simplify``."""

from pathlib import Path
from typing import Annotated

import typer

from vpm.command import (
    Channels,
    Interpolate,
    Logs,
    ModelPath,
    Plot,
    Share,
    console,
    load_all,
    progress,
    save_plot,
    writable,
)
from vpm.command_output import give, wrote

EXAMPLES = "Example:  vpm simplify model.toml log.csv --rate 1000 --tolerance 0.05"


def simplify(
    model: ModelPath,
    logs: Logs,
    rate: Annotated[float, typer.Option(help="Rate of the controller, Hz.")] = 1000.0,
    tolerance: Annotated[float, typer.Option(help="Largest loss of accuracy, as a share of the signal.")] = 0.02,
    share: Share = 0.2,
    validate: Annotated[list[Path] | None, typer.Option(help="Log to judge on; those of the fit by default.")] = None,
    against: Annotated[str, typer.Option(help="The reference: data, or the full model itself.")] = "data",
    mode: Annotated[str | None, typer.Option(help="Mode of simulation to judge in.")] = None,
    compare: Annotated[list[str] | None, typer.Option(help="Channel to judge; all by default.")] = None,
    level: Annotated[
        str | None, typer.Option(help='Level of the flexible links to begin at, "elements(20)"; that of the file.')
    ] = None,
    channels: Channels = None,
    interpolate: Interpolate = False,
    plot: Plot = None,
    out: Annotated[Path | None, typer.Option(callback=writable, help="Write the simplified model (TOML) here.")] = None,
) -> None:
    """Find the cheapest model that still tells the truth within a tolerance; exit code 1 if it misses the period."""
    from vpm.simplify import simplify as find_cheapest

    machine, records, validation = load_all(model, logs, channels, interpolate, validate)
    machine = machine if level is None else machine.at(level)
    with progress() as tell:
        ladder = find_cheapest(
            machine,
            records,
            rate=rate,
            tolerance=tolerance,
            share=share,
            validate=validation or None,
            against=against,
            mode=mode,
            channels=compare,
            tell=tell,
        )
    give(ladder=ladder)
    console.print(str(ladder), markup=False)
    console.print(str(ladder.budget), markup=False)
    save_plot(ladder.plot, plot)
    if out is not None:
        wrote(ladder.model.save(out))
    if not ladder.holds:
        raise typer.Exit(1)
