"""Command line of solids that become flexible links: ``vpm reduce``."""

from pathlib import Path
from typing import Annotated

import typer

from vpm.command import console, writable
from vpm.command_output import give, wrote

EXAMPLES = (
    "Example:  vpm reduce bracket.toml --modes 8 --out bracket.npz\n\n"
    "Example:  vpm reduce matrices.npz --modes 12 --out link.npz"
)


def reduce(
    solid: Annotated[
        Path, typer.Argument(metavar="SOLID", help="TOML file of a solid or of matrices, or an .npz with matrices.")
    ],
    out: Annotated[Path, typer.Option("--out", "-o", callback=writable, help="Reduced solid (.npz) to write.")],
    modes: Annotated[int, typer.Option(help="How many of the slowest modes to keep, with the root held.")] = 8,
) -> None:
    """Reduce a solid of finite elements to a flexible link of a model file, and tell what was kept."""
    from vpm.reduction import reduce as reduced

    found = reduced(solid, modes)
    found.link.save(out)
    give(
        mass=found.mass,
        frequencies=found.frequencies,
        errors=found.errors,
        effective_mass=found.effective_mass,
        compliance=found.compliance,
        interfaces=found.link.interfaces,
        stiffens=found.link.stiffens,
    )
    console.print(str(found), markup=False, highlight=False)
    wrote(out)
