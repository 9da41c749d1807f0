"""Command line of the report of an earlier diagnosis: ``vpm report``."""

from pathlib import Path
from typing import Annotated

import typer

from vpm.command import ReportFolder, console
from vpm.command_output import give, wrote

EXAMPLES = "Example:  vpm report report/diagnosis.npz --out report/"


def report(
    diagnosis: Annotated[Path, typer.Argument(metavar="DIAGNOSIS", help="The diagnosis.npz of an earlier run.")],
    out: ReportFolder = Path("report"),
) -> None:
    """Tell the story of an earlier diagnosis again and write its report anew."""
    from vpm.discrepancy import Diagnosis
    from vpm.report import print_story, write_report

    earlier = Diagnosis.load(diagnosis)
    give(diagnosis=earlier)
    print_story(earlier, console)
    wrote(*write_report(earlier, out))
