"""Command line of closed linkages, KARL and the leg of HyQ: ``vpm linkage``."""

from pathlib import Path
from typing import Annotated

import typer

from vpm.command import Plot, console, save_plot
from vpm.command_output import give

EXAMPLES = "Example:  vpm linkage examples/karl/karl.toml --plot karl.png"


def linkage(
    path: Annotated[Path, typer.Argument(metavar="LINKAGE", help="File of a closed linkage (TOML).")],
    plot: Plot = None,
) -> None:
    """Say what a closed linkage can do: singular strokes of KARL, cylinders and shares of dynamics of a leg."""
    from vpm.studies.linkages import load

    found = load(path)
    give(name=found.name, kind=type(found).__name__, summary=found.summary)
    console.print(repr(found), markup=False)
    for sentence in found.summary:
        console.print(f"  {sentence}", markup=False)
    save_plot(found.plot, plot)
