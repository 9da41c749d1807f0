"""Command line of an optimisation: ``vpm optimise``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vpm.command import ModelPath, Plot, console, load_model, progress, save_plot, writable
from vpm.command_output import give, wrote

if TYPE_CHECKING:
    from vpm.optimise import Optimum

EXAMPLES = (
    "Example:  vpm optimise examples/optimise/arm.toml examples/optimise/turn.toml --log turn.csv --plot turn.png\n\n"
    "Then:  vpm simulate examples/optimise/arm.toml turn.csv --plot played.png"
)


def optimise(
    model: ModelPath,
    task: Annotated[Path, typer.Argument(metavar="TASK", help="What the motion shall do, and its limits (TOML).")],
    log: Annotated[
        Path | None,
        typer.Option(callback=writable, help="Write the motion to this log (CSV), which vpm simulate plays."),
    ] = None,
    out: Annotated[Path | None, typer.Option(callback=writable, help="Save the optimum (NPZ) here.")] = None,
    plot: Plot = None,
) -> None:
    """Find the motion that takes least time or energy, or goes highest, within limits and with the elasticity.

    Ctrl-C keeps the last motion, which need not keep all limits.
    """
    from vpm.optimise import OptimisationInterruptedError, Task
    from vpm.optimise import optimise as find

    machine, given, stopped = load_model(model), Task.load(task), False
    with progress() as tell:
        try:
            found = find(machine, given, progress=tell)
        except OptimisationInterruptedError as interrupt:
            found, stopped = interrupt.result, True
    _finish(found, log, out, plot)
    if stopped:
        raise KeyboardInterrupt


def _finish(found: Optimum, log: Path | None, out: Path | None, plot: Path | None) -> None:
    give(optimum=found)
    console.print(str(found), markup=False)
    if log is not None:
        wrote(found.to_csv(log))
    if out is not None:
        wrote(found.save(out))
    save_plot(found.plot, plot)
