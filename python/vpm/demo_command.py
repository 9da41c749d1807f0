"""Command line of the demo with a hidden effect: ``vpm demo``."""

from pathlib import Path
from typing import Annotated

import typer

from vpm.command import console, fillable, progress
from vpm.command_output import give, wrote

EXAMPLES = "Example:  vpm demo --out demo-report\n\nExample:  vpm demo --hide torque_ripple"


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
