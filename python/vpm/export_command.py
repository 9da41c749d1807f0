"""Command line of robots of other programs: ``vpm export``."""

from pathlib import Path
from typing import Annotated

import typer

from vpm.command import ModelPath, console, load_model, writable
from vpm.command_output import give, note, wrote

EXAMPLES = "Example:  vpm export fit/model.toml --urdf robot.urdf -o fitted.urdf"


def export(
    model: ModelPath,
    urdf: Annotated[Path, typer.Option(help="URDF that the model came from.")],
    out: Annotated[
        Path | None, typer.Option("--out", "-o", callback=writable, help="URDF to write; by default the same file.")
    ] = None,
) -> None:
    """Write masses, centres, inertias, damping and friction of a model into its URDF, and touch nothing else of it."""
    from vpm.robots import export_robot

    exported = export_robot(load_model(model), urdf)
    target = exported.save(out or urdf)
    for sentence in exported.changed:
        console.print(sentence, markup=False)
    for told in exported.notes:
        note(told)
    give(changed=exported.changed)
    wrote(target)
