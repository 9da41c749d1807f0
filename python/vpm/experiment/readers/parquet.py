"""Parquet files: columns of numbers, of times, and fields of structures."""

from collections.abc import Sequence
from os import PathLike

import numpy as np

from vpm.errors import needs
from vpm.experiment.readers.base import Log, reading
from vpm.experiment.table import Table
from vpm.numbers import Array


class ParquetLog(Log):
    """Columns of a Parquet file: ``q``, and ``state.q`` for a field of a structure.

    Times of day and stamps are told in seconds from the first of their column. Missing values are NaN.
    """

    bracketed_units = True

    def __init__(self, path: str | PathLike[str]) -> None:
        with needs("pyarrow", "parquet"):
            import pyarrow as pa
            import pyarrow.parquet as pq
        super().__init__(path)
        with reading(path, "a Parquet file"):
            table = pq.read_table(path)
        while any(pa.types.is_struct(field.type) for field in table.schema):
            table = table.flatten()
        self._stamps: list[str] = []
        names = []
        for field in table.schema:
            kind = field.type
            timed = pa.types.is_timestamp(kind) or pa.types.is_duration(kind) or pa.types.is_time(kind)
            if timed:
                self._stamps.append(field.name)
            if timed or pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_boolean(kind):
                names.append(field.name)
            else:
                self.refused[field.name] = f"holds {kind}, which is no number; name a column of numbers"
        repeated = [name for at, name in enumerate(names) if name in names[:at]]
        if repeated:
            raise self.error(f'{path} has two columns named "{repeated[0]}"; rename one of them')
        self.header = tuple(names)
        self._table = table

    def _read(self, columns: Sequence[str], clock: str) -> Table:  # noqa: ARG002
        """Columns of a Parquet file by name; see `Log.read`."""
        stamps = frozenset(column for column in columns if column in self._stamps)
        found = {column: self._seconds(column) if column in stamps else self._numbers(column) for column in columns}
        return Table(self.header, found, None, stamps=stamps)

    def _numbers(self, column: str) -> Array:
        return np.asarray(self._table.column(column).to_numpy(), dtype=np.float64)

    def _seconds(self, column: str) -> Array:
        """Seconds of Parquet dates; differences first, in whole nanoseconds, for the resolution."""
        import pyarrow as pa

        kind = self._table.column(column).type
        unit = {"s": 1_000_000_000, "ms": 1_000_000, "us": 1_000, "ns": 1}[kind.unit]
        chunked = self._table.column(column)
        if chunked.null_count:
            raise self.error(f'{self.path}: {chunked.null_count} times of the column "{column}" are missing; fill them')
        ticks = chunked.cast(pa.int32() if kind.bit_width == 32 else pa.int64()).to_numpy().astype(np.int64)
        return np.asarray((ticks - ticks[0]) * unit, dtype=np.float64) * 1e-9 if ticks.size else np.zeros(0)
