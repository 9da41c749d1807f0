"""Columns of a file as channels: which column is which, in what unit, scaled, shifted and converted."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from os import PathLike
from pathlib import Path

import numpy as np

from vpm.errors import ExperimentError, UnitError, VpmError
from vpm.experiment.grid import Source, check_finite, is_smooth
from vpm.experiment.readers import open_log
from vpm.experiment.readers.base import Log, bracketed
from vpm.experiment.signal import interpolate
from vpm.experiment.table import Table
from vpm.expression import PURE, Quantity, read_expression
from vpm.model import ChannelEntry, Model
from vpm.numbers import Array
from vpm.units import Unit, parse_unit

#: Names of a clock column where no channel table says which it is.
TIME_COLUMNS = ("time", "time_s", "t")


@dataclass
class Draft:
    """A record while it is read: columns, units, delays, clocks and history."""

    source: Source
    time: Array
    columns: dict[str, Array] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    delays: dict[str, float] = field(default_factory=dict)
    clocks: dict[str, Array] = field(default_factory=dict)
    history: list[str] = field(default_factory=list)
    unused: tuple[str, ...] = ()
    #: Delays of columns that were moved back already, s: at the ends of the record they have no value.
    moved: list[float] = field(default_factory=list)

    def numbers(
        self, channel: str, own: Array | None, read: Mapping[str, Array]
    ) -> tuple[Array | None, dict[str, Array]]:
        """Clock and columns of a drafted channel, without the rows in which one of its columns has no number.

        Data frames, Parquet and MATLAB write NaN where a row of one device has nothing of another, or a sample was
        lost. ``own``, ``read``: clock (None where it is that of the record) and columns, shape (N,).

        Raises `ExperimentError`: no row has a number.
        """
        there = ~np.any([np.isnan(column) for column in read.values()], axis=0)
        if np.all(there):
            return own, dict(read)
        if not np.any(there):
            raise self.source.error(
                f'{self.source.name}: no row has a number for the channel "{channel}"; do not map it', channel=channel
            )
        clock = (self.time if own is None else own)[there]
        self.clocks[channel] = clock
        self.history.append(f"{channel} has numbers in {clock.size} of {there.size} rows.")
        return clock, {name: column[there] for name, column in read.items()}

    def on_fullest_clock(self) -> "Draft":
        """Draft without the rows in which only slower channels were read, and none other: they are no grid."""
        if len(self.clocks) < len(self.columns) or not self.clocks:
            return self
        time = max(self.clocks.values(), key=len)
        lines = None if self.source.lines is None else self.source.lines[np.isin(self.time, time)]
        clocks = {channel: own for channel, own in self.clocks.items() if not np.array_equal(own, time)}
        return replace(self, source=replace(self.source, lines=lines), time=time, clocks=clocks)


def mapped_draft(
    log: Log, table: Mapping[str, ChannelEntry], model: Model | None, *, interpolated: bool = False
) -> Draft:
    """Draft of channels from columns that a channel table names.

    ``interpolated``: rows in which a column has no number count as rows in which it was not read.
    """
    path = log.path
    present = _present_columns(path, table, log)
    columns = list(dict.fromkeys(column for found in present.values() for column in found.values()))
    entry, clock = table["time"], next(iter(present["time"].values()))
    content = log.read(columns, clock)
    source = Source(str(path), content.lines, str(path))
    unit = understood(entry.unit, "time", None, str(path), expected="s")[0]
    if clock in content.stamps and (entry.value or unit.factor * entry.scale != 1.0):
        made = entry.value or f"{unit.factor * entry.scale:g} s"
        raise ExperimentError(
            f'{path}: the clock "{clock}" holds stamps, which are read in seconds, but its entry makes {made} of each; '
            'map that column alone, write unit = "s" and no scale',
            path=str(path),
            channel="time",
        )
    if entry.value and content.clocks:
        raise ExperimentError(
            f'{path}: the column "{next(iter(content.clocks))}" has a clock of its own, which the value '
            f'"{entry.value}" of the time does not tell; map one column to time',
            path=str(path),
            channel="time",
        )
    stamps = {name: content.columns[column] for name, column in present["time"].items()}
    read = _built(source, stamps, "time", entry) if entry.value else content.columns[clock]
    draft = Draft(source, unit.to_si(read * entry.scale + entry.offset))
    own_clocks = {column: unit.to_si(own * entry.scale + entry.offset) for column, own in content.clocks.items()}
    content = replace(content, clocks=own_clocks)
    draft.history += [f"Read {draft.time.size} rows of {Path(path).name}.", *content.notes]
    draft.unused = tuple(column for column in log.header if column not in columns)
    for channel, entry in table.items():
        if channel != "time":
            _map_channel(draft, content, channel, entry, present.get(channel), model, interpolated)
    return draft.on_fullest_clock() if interpolated and not content.clocks else draft


def _present_columns(
    path: str | PathLike[str], table: Mapping[str, ChannelEntry], log: Log
) -> dict[str, dict[str, str]]:
    """Columns of each drafted channel that the file has; channels without have to be optional."""
    if "time" not in table:
        raise ExperimentError(
            f'{path}: the channel table maps no column to "time"; add time = {{ column = "...", unit = "s" }}',
            path=str(path),
        )
    owners: dict[str, str] = {}
    present = {}
    for channel, entry in table.items():
        found = {name: log.find(part.column) for name, part in entry.parts.items()}
        # Values may share their columns: a difference and a sum of two are two channels.
        column = found.get("") or entry.column
        if column and owners.setdefault(column, channel) != channel:
            raise ExperimentError(
                f'{path}: the column "{entry.column}" is mapped to both "{owners[column]}" and "{channel}"; '
                "map it once",
                path=str(path),
                channel=channel,
            )
        there = {name: place for name, place in found.items() if place is not None}
        absent = [part.column for name, part in entry.parts.items() if name not in there]
        if not absent:
            present[channel] = there
        elif not entry.optional or channel == "time" or absent[0] in log.refused:
            raise log.missing(absent[0], channel)
    return present


def _map_channel(
    draft: Draft,
    content: Table,
    channel: str,
    entry: ChannelEntry,
    columns: Mapping[str, str] | None,
    model: Model | None,
    interpolated: bool,
) -> None:
    """Draft of one channel in the unit of the entry: (column or value * scale + offset)."""
    given, draft.units[channel] = understood(entry.unit, channel, model, draft.source.name)
    if columns is None:
        draft.columns[channel] = np.zeros(draft.time.size)
        lacking = "not all columns of the" if entry.value else "no"
        draft.history.append(f"{channel} is zero, because the file has {lacking} {entry.told} and it is optional.")
        return
    own = _clock(draft, content, channel, columns)
    if own is not None:
        draft.clocks[channel] = own
    read = {name: content.columns[column] for name, column in columns.items()}
    if interpolated:
        own, read = draft.numbers(channel, own, read)
    # Lines are those of the record's clock.
    clock, source = (draft.time, draft.source) if own is None else (own, replace(draft.source, lines=None))
    for name, part in entry.parts.items():
        check_finite(read[name], clock, f'column "{part.column}" ({channel})', source, channel=channel)
    for name, part in entry.columns.items():
        if part.delay:
            back = np.clip(clock + part.delay, clock[0], clock[-1])  # where it ends it keeps its last value
            read[name] = interpolate(clock, read[name], back, smooth=is_smooth(channel))
            draft.moved.append(part.delay)
            draft.history.append(f'For {channel} column "{part.column}" was moved back by {part.delay:.6g} s.')
    raw = _built(draft.source, read, channel, entry) if entry.value else read[""]
    draft.columns[channel] = given.to_si(raw * entry.scale + entry.offset)
    words = [f"{channel} is {entry.told}"]
    if entry.value:
        words[0] += " of " + " and ".join(f'column "{part.column}" in {part.unit}' for part in entry.columns.values())
    if entry.scale != 1.0:
        words.append(f"times {entry.scale:.9g}")
    if entry.offset != 0.0:
        words.append(f"plus {entry.offset:.9g} {entry.unit}")
    words.append(f"in {entry.unit}" if given.is_si else f"converted from {entry.unit} to {draft.units[channel]}")
    draft.history.append(", ".join(words) + ".")
    if entry.delay != 0.0:
        draft.delays[channel] = entry.delay


def _clock(draft: Draft, content: Table, channel: str, columns: Mapping[str, str]) -> Array | None:
    """Clock of a drafted channel's columns, which has to be one; None where it is that of the record."""
    first, *others = (content.clocks.get(column) for column in columns.values())
    for own, column in zip(others, list(columns.values())[1:], strict=True):
        if not np.array_equal(draft.time if own is None else own, draft.time if first is None else first):
            raise ExperimentError(
                f'{draft.source.name}: the value of "{channel}" is built from columns with clocks of their own, of '
                f'which "{column}" is one; build it from columns of one topic or group',
                path=draft.source.path,
                channel=channel,
            )
    return first


def _built(source: Source, read: Mapping[str, Array], channel: str, entry: ChannelEntry) -> Array:
    """Value of a drafted channel, or of the clock, over several columns as they were read, in the unit of the entry."""
    units = {name: parse_unit(part.unit) for name, part in entry.columns.items()}
    parts = {name: Quantity(units[name].to_si(values), units[name].dimension) for name, values in read.items()}
    given = parse_unit(entry.unit)
    try:
        value = read_expression(entry.value)(parts)
        if value.dimension != given.dimension:
            kind = replace(given, dimension=value.dimension).kind
            raise VpmError(
                f'"{entry.value}" is in {kind}, but its unit is {entry.unit}; state the units of its columns (numbers '
                f"have none: for 5 {entry.unit} a count write 5*count and that the unit of count is {entry.unit})"
            )
        if value.dimension == PURE and given.factor != 1.0 and all(unit.factor == 1.0 for unit in units.values()):
            # Nobody can tell whether 360 x of turns x is meant in degrees already.
            raise VpmError(
                f'"{entry.value}" comes out in rad or 1, but its unit is {entry.unit}; give its columns the units that '
                'they have, and write unit = "rad"'
            )
    except VpmError as error:
        raise ExperimentError(
            f"{source.name}, channel {channel}: {error}", path=source.path, channel=channel
        ) from error
    return np.asarray(given.from_si(value.values), dtype=np.float64)


def plain_draft(log: Log, *, interpolated: bool = False) -> Draft:
    """Draft with every column as a channel of its own name; a unit may stand in brackets behind it.

    ``interpolated``: as of `mapped_draft`.
    """
    path, (names, clock) = log.path, _plain_columns(log)
    content = log.read(log.header, clock)
    source = Source(str(path), content.lines, str(path))
    stated = "" if clock in content.stamps else names[clock][1]
    seconds, _ = understood(stated or "s", "time", None, str(path), expected="s")
    draft = Draft(source, seconds.to_si(content.columns[clock]))
    draft.history.append(f'Read {draft.time.size} rows of {Path(path).name}; the clock is column "{clock}".')
    draft.history += content.notes
    for column, (name, stated) in names.items():
        if column == clock:
            continue
        if column in content.clocks:
            draft.clocks[name] = seconds.to_si(content.clocks[column])
        values = content.columns[column]
        if interpolated:
            values = draft.numbers(name, draft.clocks.get(name), {"": values})[1][""]
        check_finite(values, draft.clocks.get(name, draft.time), f'column "{column}"', source, channel=name)
        given, draft.units[name] = understood(stated or "1", name, None, str(path))
        draft.columns[name] = given.to_si(values)
        how = f"converted from {stated} to {draft.units[name]}" if stated else "as it is, its unit is not stated"
        draft.history.append(f'{name} is column "{column}", {how}.')
    return draft.on_fullest_clock() if interpolated and not content.clocks else draft


def plain_table(path: str | PathLike[str], model: Model) -> dict[str, ChannelEntry]:
    """Draft of a channel table for a log without one; columns that the model does not know stay out."""
    from vpm.model import ChannelEntry

    names, clock = _plain_columns(open_log(path))
    known = {
        name: (column, unit or model.channel_unit(name))
        for column, (name, unit) in names.items()
        if column != clock and name in model.channels
    }
    told = {"time": (clock, names[clock][1] or "s"), **known}
    return {name: ChannelEntry(column=column, unit=unit) for name, (column, unit) in told.items()}


def _plain_columns(log: Log) -> tuple[dict[str, tuple[str, str]], str]:
    """Name and unit of each column for a draft without a channel table, and the clock among them."""
    names = {column: _stated(column, log) for column in log.header}
    return names, _clock_column(log.path, names)


def _clock_column(path: str | PathLike[str], names: Mapping[str, tuple[str, str]]) -> str:
    """Clock column of a draft by its name; in files with groups, the only one whose last word is."""
    clocks = [column for column, (name, _) in names.items() if name in TIME_COLUMNS]
    inner = [column for column, (name, _) in names.items() if re.split(r"[./]", name)[-1] in TIME_COLUMNS]
    if not clocks and len(inner) == 1:
        clocks = inner
    if not clocks:
        raise ExperimentError(
            f"{path} has no column named {', '.join(TIME_COLUMNS)}, its columns are {', '.join(names)}; "
            "give a channel table that says which one is the clock",
            path=str(path),
        )
    return clocks[0]


def _stated(column: str, log: Log) -> tuple[str, str]:
    """Name and unit of a drafted column: the unit of the file, or in brackets behind the name."""
    if column in log.units:
        return column, log.units[column]
    return bracketed(column) if log.bracketed_units else (column, "")


def understood(
    unit: str, channel: str, model: Model | None, where: str, expected: str | None = None
) -> tuple[Unit, str]:
    """Unit of a drafted column, of the kind that its channel has in the model, and what the model calls it in SI."""
    wanted = model.channel_unit(channel) if model is not None else expected
    try:
        given = parse_unit(unit)
    except UnitError as error:
        raise UnitError(f"{where}, channel {channel}: {error}", unit=unit, expected=wanted) from error
    if wanted is None:
        return given, given.si
    target = parse_unit(wanted)
    if given.dimension != target.dimension:
        raise ExperimentError(
            f'{where}: the channel "{channel}" is given in {unit} ({given.kind}), but it is in {wanted} '
            f"({target.kind}); correct the unit or the column of its entry in the channel table",
            channel=channel,
        )
    return given, wanted
