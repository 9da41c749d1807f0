"""Text tables: CSV and its relatives."""

from collections.abc import Sequence
from os import PathLike

from vpm.experiment.readers.base import Log
from vpm.experiment.table import Table, read_header, read_table


class TextLog(Log):
    """A line of column names, then numbers; see `vpm.experiment.dialect`."""

    bracketed_units = True

    def __init__(self, path: str | PathLike[str]) -> None:
        super().__init__(path)
        self.dialect = read_header(path)
        self.header = self.dialect.header
        self.units = dict(zip(self.header, self.dialect.units, strict=False))

    def _read(self, columns: Sequence[str], clock: str) -> Table:
        """Columns of a text file by name; see `Log.read`."""
        return read_table(self.path, self.dialect, columns, clock)
