"""Text tables: CSV and its relatives."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike

from vpm.experiment.readers.base import Log
from vpm.experiment.table import Table, read_header, read_table


class TextLog(Log):
    """A line of column names, then numbers; see `vpm.experiment.table`."""

    bracketed_units = True

    def __init__(self, path: str | PathLike[str]) -> None:
        self.path = path
        self.header, _ = read_header(path)
        self.refused: dict[str, str] = {}
        self.units: dict[str, str] = {}

    def _read(self, columns: Sequence[str], clock: str) -> Table:  # noqa: ARG002
        """Columns by name; see `Log.read`."""
        return read_table(self.path, columns)
