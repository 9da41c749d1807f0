"""Command line of the identification at growing detail: ``vpm climb``."""

from pathlib import Path
from typing import Annotated

import typer

from vpm.command import (
    Channels,
    Integrator,
    Interpolate,
    Logs,
    ModelPath,
    Plot,
    console,
    load_all,
    progress,
    save_plot,
    writable,
)
from vpm.command_output import give, wrote

EXAMPLES = "Example:  vpm climb model.toml log.csv --validate other.csv --plot climb.png"


def climb(
    model: ModelPath,
    log: Logs,
    validate: Annotated[list[Path], typer.Option(help="Record to judge on, which the fit does not see; repeatable.")],
    channels: Channels = None,
    interpolate: Interpolate = False,
    mode: Annotated[str | None, typer.Option(help="Mode of simulation; by default closed loop or restarts.")] = None,
    compare: Annotated[list[str] | None, typer.Option(help="Channel that counts; all measured by default.")] = None,
    integrator: Integrator = "auto",
    settling: Annotated[float, typer.Option(help="Time at the beginning of each record that does not count, s.")] = 0.0,
    out: Annotated[
        Path | None, typer.Option(callback=writable, help="Write the model of the chosen level to this file.")
    ] = None,
    plot: Plot = None,
) -> None:
    """Identify a model level by level, as far up in detail as validation records say that it pays."""
    from vpm.climb import climb as find_level
    from vpm.simulate import Setup

    machine, records, validation = load_all(model, log, channels, interpolate, validate)
    with progress() as tell:
        found = find_level(
            machine,
            records,
            validate=validation,
            mode=mode,
            channels=compare,
            setup=Setup(integrator, settling=settling),
            tell=tell,
        )
    give(climb=found)
    console.print(str(found), markup=False)
    save_plot(found.plot, plot)
    if out is not None:
        wrote(found.model.save(out))
