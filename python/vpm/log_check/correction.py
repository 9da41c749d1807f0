"""A mistake that a channel table may have, and the record without it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from vpm.experiment import Experiment
from vpm.model import ChannelEntry
from vpm.units import parse_unit

#: The clock among channels.
TIME = "time"


@dataclass(frozen=True)
class Correction:
    """A change of a channel table."""

    channels: tuple[str, ...]  #: What it changes; two channels that change places where `swap` is set.
    factor: float = 1.0  #: By which their values are multiplied.
    delay: float = 0.0  #: By how much later than the others they were stamped, s.
    swap: bool = False
    unit: str = ""  #: Unit that the column is in, where it is another one than the table says; else "".
    #: Name of the column that is late, where the channel is a value over several; else "".
    column: str = ""
    #: Its other columns, which are not: the channel that each one is by itself, and its weight in the value.
    beside: tuple[tuple[str, float], ...] = ()

    def applied(self, record: Experiment) -> Experiment:
        """The record with this correction done.

        Raises ExperimentError: the record is too short for a delay.
        """
        if self.is_clock:
            return replace(record, time=record.time * self.factor)
        if self.delay:
            late = self._less_others(record, 1.0).align(dict.fromkeys(self.channels, self.delay))
            return self._less_others(late, -1.0)
        data, places = np.array(record.data), [record.channels.index(name) for name in self.channels]
        if self.swap:
            data[:, places] = data[:, places[::-1]]
        else:
            data[:, places] *= self.factor
        return replace(record, data=data)

    def _less_others(self, record: Experiment, share: float) -> Experiment:
        """The record to correct, with the columns that are not late taken out of the value, or put back."""
        if not self.beside:
            return record
        data = np.array(record.data)
        data[:, record.channels.index(self.channels[0])] -= share * sum(
            weight * record[of] for of, weight in self.beside
        )
        return replace(record, data=data)

    def entries(self, table: Mapping[str, ChannelEntry]) -> dict[str, ChannelEntry]:
        """Corrected entries of a channel table."""
        known = [name for name in self.channels if name in table]
        if self.swap:
            first, second = self.channels
            return {first: table[second], second: table[first]} if len(known) == 2 else {}
        return {name: self._entry(table[name]) for name in known}

    def _entry(self, entry: ChannelEntry) -> ChannelEntry:
        if self.column:
            part = entry.columns[self.column]
            late = part.model_copy(update={"delay": float(f"{part.delay + self.delay:.4g}")})
            return entry.model_copy(update={"columns": {**entry.columns, self.column: late}})
        if self.delay:
            return entry.model_copy(update={"delay": float(f"{entry.delay + self.delay:.4g}")})
        if self.unit:
            # An offset is in the old unit; in SI it is scaled as the numbers of the column are.
            sign = math.copysign(1.0, self.factor)
            return entry.model_copy(
                update={"unit": self.unit, "scale": sign * entry.scale, "offset": sign * entry.offset}
            )
        return entry.model_copy(update={"scale": self.factor * entry.scale, "offset": self.factor * entry.offset})

    def sentence(self, units: Mapping[str, str]) -> str:
        """Sentence on the mistake of a channel table that this corrects; ``units`` are those that were read."""
        names = _listed(self.channels)
        are, have = ("is", "has") if len(self.channels) == 1 else ("are", "have")
        if self.swap:
            return f"{names} are in each other's place"
        if self.delay:
            several, way = len(self.channels) > 1, "late" if self.delay > 0.0 else "early"
            what = f"the column {self.column} of {names}" if self.column else names
            return f"{what} {'come' if several else 'comes'} {1e3 * abs(self.delay):.3g} ms {way}"
        turned = f" and {have} the opposite sign" if self.factor < 0.0 else ""
        if self.unit:
            return f"{names} {are} in {self.unit}, not in {units[self.channels[0]]}{turned}"
        if self.factor == -1.0:
            return f"{names} {have} the opposite sign"
        size = abs(self.factor)
        by = f"{1.0 / size:.4g} times too large" if size < 1.0 else f"{size:.4g} times too small"
        return f"{names} {are} {by}{turned}"

    @property
    def each(self) -> tuple[Correction, ...]:
        """The correction as one of several, see `Pair.each`."""
        return (self,)

    @property
    def kind(self) -> str:
        """Kind of mistake that a correction undoes; see `Finding.kind`."""
        if self.swap:
            return "swap"
        if self.is_clock:
            return "clock"
        if self.delay:
            return "delay"
        if self.unit:
            return "unit"
        return "sign" if self.factor == -1.0 else "scale"

    @property
    def is_clock(self) -> bool:
        """Whether a correction changes the time of all channels."""
        return self.channels == (TIME,)

    @property
    def is_mirror(self) -> bool:
        """Whether a correction turns or exchanges channels and leaves their sizes as they are."""
        return self.swap or self.factor == -1.0

    @property
    def repair(self) -> str:
        """Repair of a correction in words, where no channel table is at hand."""
        if self.swap:
            return "exchange their columns in the channel table"
        if self.delay:
            entry = f"delay = {self.delay:.4g}" + (f" of its column {self.column}" if self.column else "")
        elif self.unit:
            entry = f'unit = "{self.unit}"' + (" and scale = -1" if self.factor < 0.0 else "")
        else:
            entry = f"scale = {self.factor:.6g}"
        return f"write {entry} into the channel table, or convert the values before"

    @property
    def is_possible(self) -> bool:
        """Whether a machine may be late as this correction says: by its answer, or by its sensors.

        No effect of a machine delays one column of a value.
        """
        return (
            self.delay != 0.0
            and not self.column
            and all((self.delay < 0.0) == name.endswith((".command", ".disturbance")) for name in self.channels)
        )


@dataclass(frozen=True)
class LateShaft(Correction):
    """A shaft that is late, whose angle tells that of a joint beside others: `column` is the channel of the shaft."""

    def entries(self, table: Mapping[str, ChannelEntry]) -> dict[str, ChannelEntry]:
        """Corrected entry of the shaft."""
        return Correction((self.column,), delay=self.delay).entries(table)

    def sentence(self, units: Mapping[str, str]) -> str:
        """Sentence on the shaft that is late; ``units`` are those that were read."""
        return Correction((self.column,), delay=self.delay).sentence(units)


class Pair(NamedTuple):
    """Two corrections of which each alone explains nothing."""

    first: Correction
    second: Correction

    @property
    def each(self) -> tuple[Correction, ...]:
        """Corrections of a pair."""
        return (self.first, self.second)

    def applied(self, record: Experiment) -> Experiment:
        """The record with both corrections done."""
        return self.second.applied(self.first.applied(record))

    def sentence(self, units: Mapping[str, str]) -> str:
        """Sentence on the mistakes that a pair of corrections undoes; ``units`` are those read."""
        return f"{self.first.sentence(units)}, and {self.second.sentence(units)}"


def factor_between(unit: str, other: str) -> float:
    """Correction factor of values in ``unit`` that were read as being in ``other``."""
    return parse_unit(unit).factor / parse_unit(other).factor


def _listed(names: tuple[str, ...]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
