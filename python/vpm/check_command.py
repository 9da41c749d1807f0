"""Command line of the log check: ``vpm check``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vpm.command import (
    Channels,
    FoundHold,
    Integrator,
    Interpolate,
    Logs,
    ModelPath,
    Workers,
    console,
    load_all,
    searching,
)
from vpm.command_output import give, wrote
from vpm.errors import ModelError
from vpm.files import probe_file, write_text

if TYPE_CHECKING:
    from vpm.log_check import LogCheck
    from vpm.model import ChannelEntry, Model

EXAMPLES = (
    "Example:  vpm check model.toml log.csv\n\nExample:  vpm check model.toml a.csv b.csv --channels table.toml --fix"
)

Fix = Annotated[bool, typer.Option("--fix", help="Write the corrected entries into the channel table.")]


def check(
    model: ModelPath,
    logs: Logs,
    fix: Fix = False,
    channels: Channels = None,
    interpolate: Interpolate = False,
    integrator: Integrator = "auto",
    hold: FoundHold = "auto",
    workers: Workers = 0,
) -> None:
    """Find wrong units, signs, names and clocks of logs, before anything is concluded from them.

    Ends with exit code 1 where there is a mistake that was not corrected.
    """
    from vpm.log_check import check_log
    from vpm.model.reading import importer_of
    from vpm.simulate import Setup

    if fix:
        if channels is None and (importer := importer_of(model)) is not None:
            raise ModelError(f"{model} is read by {importer}, so no table can be put into it; name one with --channels")
        probe_file(channels or model)
    machine, records, _ = load_all(model, logs, channels, interpolate)
    table = _table(machine, channels, logs[0])
    with searching() as (_, each):
        found = check_log(
            machine,
            records,
            table=table,
            setup=Setup(integrator, hold=hold),
            workers=workers or None,
            progress=each,
        )
    give(check=found)
    for line in str(found).splitlines():
        console.print(line, markup=False)
    if found.mistakes and fix:
        path = channels or model
        _write(found, len(records), table, path, given=channels is not None or bool(machine.channel_table))
        wrote(path)
    elif found.mistakes:
        raise typer.Exit(1)


def _table(machine: Model, channels: Path | None, log: Path) -> Mapping[str, ChannelEntry]:
    """The channel table by which the logs are read, or what stands for one."""
    from vpm.experiment import plain_table
    from vpm.model import load_channel_table

    if channels is not None:
        return load_channel_table(channels)
    return machine.channel_table or plain_table(log, machine)


def _write(found: LogCheck, logs: int, table: Mapping[str, ChannelEntry], path: Path, *, given: bool) -> None:
    """Write the entries as they should be into the file of the channel table; a model file without one gets it."""
    from vpm.log_check.table import corrected_lines, corrected_text, line_of

    for one in found.mistakes:
        if len(one.records) < logs:
            raise ModelError(
                f"only {', '.join(one.records)} of {logs} logs has this mistake: {one.sentence}; give that log a table "
                "of its own with --channels",
                path=str(path),
            )
    # As it is, so that lines end as they did.
    text, lines = path.read_bytes().decode("utf-8"), corrected_lines(found.mistakes)
    if given:
        text = corrected_text(text, lines, path)
    else:
        whole = {name: line_of(name, entry) for name, entry in table.items()} | lines
        end = "\r\n" if "\r\n" in text else "\n"
        text = end.join([text.rstrip(), "", "[channels]", *whole.values(), ""])
    write_text(path, text)
