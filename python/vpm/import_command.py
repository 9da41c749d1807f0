"""Command line of robots of other programs: ``vpm import``."""

from pathlib import Path
from typing import Annotated

import typer

from vpm.command import console, writable
from vpm.command_output import give, note, wrote
from vpm.errors import ModelError

EXAMPLES = (
    "Example:  vpm import robot.urdf -o model.toml --uncertain 0.1\n\n"
    "Example:  vpm import robot.xacro -o model.toml --arg prefix=left_"
)


def import_(
    robot: Annotated[Path, typer.Argument(metavar="ROBOT", help="URDF, xacro or MJCF file.")],
    out: Annotated[Path, typer.Option("--out", "-o", callback=writable, help="Model file (TOML) to write.")],
    uncertain: Annotated[
        float, typer.Option(help="Standard deviation of masses, inertias and friction, as a share; 0 for known ones.")
    ] = 0.0,
    floating: Annotated[bool, typer.Option("--floating", help="Let the root of a URDF float.")] = False,
    arg: Annotated[list[str] | None, typer.Option(metavar="NAME=VALUE", help="Argument of a xacro file.")] = None,
) -> None:
    """Make a model file of a URDF, xacro or MJCF file, and tell what was left out or changed."""
    from vpm.robots import import_robot

    for word in arg or []:
        if "=" not in word:
            raise ModelError(f'--arg is "{word}", which has no "="; write NAME=VALUE')
    given = dict(word.split("=", 1) for word in arg or [])
    imported = import_robot(robot, uncertain=uncertain, floating=floating, xacro_args=given)
    imported.save(out)
    for told in imported.notes:
        note(told)
    give(name=imported.model.name, joints=imported.model.joints, parameters=imported.model.parameter_names)
    console.print(repr(imported.model), markup=False)
    wrote(out)
