"""Command line of the diagnosis: ``vpm diagnose``."""

import shlex
import sys
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from vpm.command import (
    Channels,
    Check,
    Cutoff,
    Effect,
    FoundHold,
    Integrator,
    Interpolate,
    Logs,
    ModelPath,
    ReportFolder,
    Without,
    Workers,
    console,
    load_all,
    searching,
    to_try,
)
from vpm.command_output import give, wrote

EXAMPLES = (
    "Example:  vpm diagnose model.toml train.csv --validate test.csv --out report/\n\n"
    "Example:  vpm diagnose model.toml a.csv b.csv --effect coulomb_friction --effect backlash --cutoff 40\n\n"
    "Example:  vpm diagnose model.toml train.csv --without sensor_delay --limit 2 --workers 1"
)

Validate = Annotated[
    list[Path] | None, typer.Option(help="Record that is never fitted; repeat. Default: 30 % of each log.")
]
Limit = Annotated[
    int | None, typer.Option(min=0, help="Most effects to accept. Default: six, and two for each joint but the first.")
]
Substeps = Annotated[
    int, typer.Option(min=1, help="Integration steps per sample, in simulations of validation records.")
]
Horizon = Annotated[float, typer.Option(help="Length of each restart, where validation records are simulated so, s.")]


def diagnose(
    model: ModelPath,
    logs: Logs,
    validate: Validate = None,
    out: ReportFolder = Path("report"),
    effect: Effect = None,
    without: Without = None,
    limit: Limit = None,
    check: Check = True,
    channels: Channels = None,
    interpolate: Interpolate = False,
    cutoff: Cutoff = None,
    integrator: Integrator = "auto",
    hold: FoundHold = "auto",
    substeps: Substeps = 1,
    horizon: Horizon = 0.25,
    workers: Workers = 0,
) -> None:
    """Name the physical effect that a model is missing, with evidence on validation data.

    Ctrl-C ends the ranking and reports what is known until then.
    """
    from vpm.diagnosing import diagnose as find_missing
    from vpm.report import print_story, write_report
    from vpm.simulate import Setup

    tried = to_try(effect, without)
    machine, records, validation = load_all(model, logs, channels, interpolate, validate)
    with searching() as (tell, each):
        diagnosis = find_missing(
            machine,
            records,
            validation or None,
            effects=tried,
            cutoff=cutoff,
            setup=Setup(integrator, substeps, horizon, hold=hold),
            limit=limit,
            check=check,
            workers=workers or None,
            tell=tell,
            progress=each,
        )
    if diagnosis.provenance is not None:
        command = shlex.join(["vpm", *sys.argv[1:]])
        diagnosis = replace(diagnosis, provenance=replace(diagnosis.provenance, command=command))
    give(diagnosis=diagnosis)
    print_story(diagnosis, console)
    wrote(*write_report(diagnosis, out))
