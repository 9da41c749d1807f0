"""TDMS files of LabVIEW: channels by their group and name."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vpm.errors import needs
from vpm.experiment.readers.base import broken, reading
from vpm.experiment.readers.clocked import TIME, ClockedLog, silent
from vpm.experiment.table import Table
from vpm.numbers import Array
from vpm.units import is_unit

if TYPE_CHECKING:
    from nptdms import TdmsChannel, TdmsFile


#: First bytes of every TDMS file.
TAG = b"TDSm"
#: Properties of a channel that may name its unit.
UNIT_PROPERTIES = ("unit_string", "NI_UnitDescription")


class TdmsLog(ClockedLog):
    """Channels of a TDMS file: ``group/channel``.

    The clock is a channel of numbers or of times, or ``time``: the wave form of each channel, its ``wf_start_offset``
    and ``wf_increment``, counted from the earliest ``wf_start_time``. Channels of times are seconds from their first.
    """

    package, extra, kind = "nptdms", "tdms", "a TDMS file"
    _file: TdmsFile

    def __init__(self, path: str | PathLike[str]) -> None:
        super().__init__(path)
        self._places: dict[str, tuple[str, str]] = {}
        self._stamps: set[str] = set()
        self._waves: dict[str, tuple[float, float]] = {}
        starts: dict[str, int] = {}
        with self._opened() as file:
            for group in file.groups():
                for channel in group.channels():
                    self._add(channel, f"{group.name}/{channel.name}", starts)
            if file.file_status.incomplete_final_segment:
                self.remarks = ("The file was not closed when it was written, and ends in the middle of a segment.",)
        if not self._places:
            raise self.error(f"{path} has no channel of numbers; record its channels anew")
        # A wave form without a date begins with the earliest.
        first = min(starts.values(), default=0)
        for name, start in starts.items():
            offset, step = self._waves[name]
            self._waves[name] = (offset + (start - first) * 1e-6, step)
        self.groups = {name: name for name in self._waves}  # every channel has a clock of its own
        self.header = ((TIME,) if self._waves else ()) + tuple(self._places)

    def _add(self, channel: TdmsChannel, name: str, starts: dict[str, int]) -> None:
        """Sort a TDMS channel into columns and what is no column."""
        if not len(channel):
            self.refused[name] = "has no samples; record it, or do not map it"
            return
        if channel.dtype.kind not in "biufM":
            kind = "text" if channel.dtype.kind in "OSU" else str(channel.dtype)
            self.refused[name] = f"holds {kind}, which is no real number; map a channel of numbers"
            return
        self._places[name] = (channel.group_name, channel.name)
        self.sizes[name] = len(channel)
        properties = channel.properties
        if channel.dtype.kind == "M":
            self._stamps.add(name)
            return
        step = float(properties.get("wf_increment", 0.0))
        if step > 0.0:
            self._waves[name] = (float(properties.get("wf_start_offset", 0.0)), step)
            if "wf_start_time" in properties:
                starts[name] = int(np.datetime64(properties["wf_start_time"], "us").astype(np.int64))
        unit = next((str(properties[key]) for key in UNIT_PROPERTIES if key in properties), "")
        if is_unit(unit):
            self.units[name] = unit

    def find(self, column: str) -> str | None:
        """Name of a TDMS channel, which may begin with a stroke; see `Log.find`."""
        return super().find(column.removeprefix("/"))

    def _read(self, columns: Sequence[str], clock: str) -> Table:
        """TDMS columns by name, over a channel or over the wave form of each; see `Log.read`."""
        if clock != TIME:
            return self._read_over(columns, clock)
        for column in columns:
            if column != TIME and column not in self._waves:
                raise self.error(
                    f'{self.path}: "{column}" has no wf_increment, so no times of its own; '
                    "map time to a channel that holds the times"
                )
        return super()._read(columns, clock)

    def _read_over(self, columns: Sequence[str], clock: str) -> Table:
        """TDMS columns that were sampled together, and a channel that holds their times."""
        for column in columns:
            if column == TIME:
                raise self.error(f'{self.path}: "{column}" is a clock and no channel; map it to time only')
            if self.sizes[column] != self.sizes[clock]:
                raise self.error(
                    f'{self.path}: the column "{column}" has {self.sizes[column]} values and the clock "{clock}" '
                    f"{self.sizes[clock]}; map channels that were sampled together, or map time to {TIME}"
                )
        with self.held():
            found = {column: self.values(column) for column in columns}
        return Table(self.header, found, None, frozenset(self._stamps.intersection(columns)), notes=self.remarks)

    @contextmanager
    def held(self) -> Iterator[None]:
        """TDMS file held open while it is read; see `ClockedLog.held`."""
        with self._opened() as self._file:
            yield

    def times(self, group: str) -> Array:
        """Times of a TDMS channel's wave form, s."""
        offset, step = self._waves[group]
        return offset + step * np.arange(self.sizes[group], dtype=np.float64)

    def values(self, column: str) -> Array:
        """Numbers of a channel of a TDMS file; times are seconds from the first."""
        group, name = self._places[column]
        samples = self._file[group][name][:]
        if column in self._stamps:
            ticks = samples.astype("datetime64[us]").astype(np.int64)
            return np.asarray((ticks - ticks[0]) * 1e-6, dtype=np.float64)
        return np.asarray(samples, dtype=np.float64)

    @contextmanager
    def _opened(self) -> Iterator[TdmsFile]:
        with needs("npTDMS", "tdms"):
            from nptdms import TdmsFile
        with reading(self.path, self.kind), silent("nptdms"), Path(self.path).open("rb") as stream:
            if stream.read(len(TAG)) != TAG:
                raise broken(self.path, self.kind, f"it does not begin with {TAG.decode()}")
            stream.seek(0)
            with TdmsFile.open(stream) as file:
                yield file
