"""Command line of the comparison of a model with a log: ``vpm compare``."""

from pathlib import Path
from typing import Annotated

import typer

from vpm.command import Channels, Cutoff, Interpolate, ModelPath, OneLog, Plot, console, load_pair, save_plot, writable
from vpm.command_output import give, wrote

EXAMPLES = "Example:  vpm compare examples/emps/model.toml log.csv --mode inverse_dynamics"


def compare(
    model: ModelPath,
    log: OneLog,
    mode: Annotated[
        str | None,
        typer.Option(
            help="free_run, inverse_dynamics, restarts, closed_loop or prescribed_motion; by default inverse_dynamics, "
            "or restarts where drives have states of their own, links bend or loops are closed, or free_run where "
            "these would need joints that the log lacks.",
            metavar="MODE",
        ),
    ] = None,
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
    from vpm.simulate import comparing_mode
    from vpm.simulate import simulate as simulate_log

    machine, record = load_pair(model, log, channels, interpolate)
    taken = mode or comparing_mode(machine, record)
    comparison = compare_run(simulate_log(machine, record, taken, cutoff=cutoff), record)
    give(comparison=comparison)
    console.print(str(comparison), markup=False)
    for channel in comparison.channels:
        for sentence in channel.where.sentences:
            console.print(f"  {channel.channel}: {sentence}", markup=False)
    save_plot(comparison.plot, plot)
    if mcap is not None:
        wrote(*write_mcap(comparison, mcap))
