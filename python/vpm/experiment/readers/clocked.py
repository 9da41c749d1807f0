"""Files of channels in groups, each group with a clock of its own."""

import logging
from abc import abstractmethod
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from os import PathLike
from typing import ClassVar

from vpm.experiment.readers.base import Log
from vpm.experiment.table import Table
from vpm.numbers import Array

#: The clock of whichever group is read.
TIME = "time"


class ClockedLog(Log):
    """A file of groups with clocks.

    A clock is one of `clocks`, or ``time``: that of the group with the most samples among those that are read.
    """

    #: Library that reads such files, the extra that installs it, and what a file is called: ``"a TDMS file"``.
    package: ClassVar[str]
    extra: ClassVar[str]
    kind: ClassVar[str]
    remarks: tuple[str, ...] = ()  #: Sentences about the whole file, for the history of the record.

    def __init__(self, path: str | PathLike[str]) -> None:
        super().__init__(path)
        self.groups: dict[str, str] = {}  #: Group of each column.
        self.sizes: dict[str, int] = {}  #: Number of samples of each group that has a clock.
        self.clocks: dict[str, str] = {}  #: Names of clocks, and the group of each; they are no channels.

    def find(self, column: str) -> str | None:
        """Name of a column or clock; see `Log.find`."""
        return column if column in self.clocks else super().find(column)

    def _read(self, columns: Sequence[str], clock: str) -> Table:
        """Columns by name, each clocked by its own group; see `Log.read`."""
        wanted = [column for column in columns if column != clock]
        for column in wanted:
            if column == TIME or column in self.clocks:
                raise self.error(f'{self.path}: "{column}" is a clock and no channel; map it to time only')
        base = self._base(wanted, clock)
        with self.held():
            times = {group: self.times(group) for group in dict.fromkeys([base, *(self.groups[c] for c in wanted)])}
            found = {column: self.values(column) for column in wanted}
        own = {column: times[self.groups[column]] for column in wanted}
        for column in wanted:
            promised, there = self.sizes[self.groups[column]], min(found[column].size, own[column].size)
            if there != promised:
                raise self.error(
                    f'{self.path}: "{column}" should have {promised} samples, of which {there} are there; '
                    "check that the file was closed when it was written, and copied whole"
                )
        notes = (f'The clock is that of "{base}".', *self.remarks)
        return Table(self.header, {clock: times[base], **found}, None, frozenset({clock}), own, notes)

    def _base(self, wanted: Sequence[str], clock: str) -> str:
        """Group whose clock is that of the record."""
        if clock in self.clocks:
            return self.clocks[clock]
        if clock != TIME:
            some = ", ".join([TIME, *self.clocks][:4])
            raise self.error(f'{self.path}: "{clock}" is a channel and no clock; map time to a clock: {some}')
        names = dict.fromkeys(self.groups[column] for column in wanted) or self.sizes
        return max(names, key=lambda group: self.sizes.get(group, 0))

    def held(self) -> AbstractContextManager[None]:
        """Context in which `times` and `values` of clocked groups are read, with the file kept open."""
        return nullcontext()

    @abstractmethod
    def times(self, group: str) -> Array:
        """Clock of a group, s, counted from an instant that is the same for all groups."""

    @abstractmethod
    def values(self, column: str) -> Array:
        """Numbers of a column of a log whose groups have clocks."""


@contextmanager
def silent(library: str) -> Iterator[None]:
    """Keep loggers of a clocked file's library from the terminal."""
    names = [name for name in logging.root.manager.loggerDict if name.partition(".")[0] == library]
    loggers = [logging.getLogger(name) for name in names]
    before = [logger.disabled for logger in loggers]
    for logger in loggers:
        logger.disabled = True
    try:
        yield
    finally:
        for logger, disabled in zip(loggers, before, strict=True):
            logger.disabled = disabled
