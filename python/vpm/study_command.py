"""Command line of the studies: ``vpm study``."""

from pathlib import Path
from typing import Annotated

import typer

from vpm.command import console, fillable, progress
from vpm.command_output import give, wrote

EXAMPLES = "Example:  vpm study carton\n\nExample:  vpm study fingertip --mesh 1 --out fingertip"


def study(
    name: Annotated[str, typer.Argument(metavar="STUDY", help="knee, fingertip or carton.")],
    out: Annotated[
        Path | None, typer.Option(callback=fillable, help="Folder for study.json, report.html and the pictures.")
    ] = None,
    mesh: Annotated[int, typer.Option(help="Fineness of the finest mesh; 0 for the usual one.")] = 0,
) -> None:
    """Run a study on solids and soft bodies, and show its figures beside the printed ones (extra fem)."""
    from vpm.studies import run_study

    with progress() as tell:
        tell(f"running the study {name}")
        found = run_study(name, mesh)
    give(study=found.to_dict())
    for line in str(found).splitlines():
        console.print(line, markup=False)
    if out is not None:
        wrote(*found.save(out))
