"""ULog files of PX4: fields of topics, each topic with a clock of its own."""

from __future__ import annotations

import io
from contextlib import redirect_stdout
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vpm.errors import ExperimentError, needs
from vpm.experiment.readers.base import reading
from vpm.experiment.readers.clocked import TIME, ClockedLog
from vpm.numbers import Array

if TYPE_CHECKING:
    from pyulog import ULog


#: Field of every topic that holds the time of its messages, us.
STAMP = "timestamp"


class UlogLog(ClockedLog):
    """Fields of the topics of a ULog file.

    A column is ``topic.field``, ``topic.field[2]``, or ``topic.1.field`` for the second sender of a topic. A clock is
    ``topic.timestamp``, ``topic``, or ``time``. All count from the first message of the file.
    """

    package, extra, kind = "pyulog", "ulog", "a ULog file"

    def __init__(self, path: str | PathLike[str]) -> None:
        super().__init__(path)
        log = _parsed(path)
        self.refused = dict.fromkeys(log.message_formats, "has no messages; log this topic, or do not map it")
        self._values: dict[str, NDArray[np.generic]] = {}
        self._stamps: dict[str, NDArray[np.int64]] = {}
        for topic in log.data_list:
            label = f"{topic.name}.{topic.multi_id}" if topic.multi_id else topic.name
            self.refused.pop(topic.name, None)
            self.clocks |= {f"{label}.{STAMP}": label, label: label}
            self._stamps[label] = topic.data[STAMP].astype(np.int64)
            for field in topic.field_data:
                column = f"{label}.{field.field_name}"
                if field.type_str == "char":
                    self.refused[column] = "holds text; map a field of numbers"
                elif field.field_name != STAMP:
                    self.groups[column] = label
                    self._values[column] = topic.data[field.field_name]
        if not self._values:
            raise self.error(f"{path} holds no messages with numbers; log its topics anew")
        self.header = (TIME, *self._values)
        self.sizes = {label: stamps.size for label, stamps in self._stamps.items()}
        self._start = min(int(stamps[0]) for stamps in self._stamps.values())
        self.remarks = (f"Times count from {self._start * 1e-6:.6f} s after the start of the autopilot.",)
        if log.file_corruption:
            self.remarks += ("The file is damaged in places; messages that could not be read are left out.",)

    def missing(self, column: str, channel: str = "") -> ExperimentError:
        """Error for a column that is not in a ULog, or whose topic is empty; see `Log.missing`."""
        topic = column.partition(".")[0]
        return super().missing(topic if topic in self.refused else column, channel)

    def times(self, group: str) -> Array:
        """Times of a ULog topic's messages, s; whole microseconds are subtracted first."""
        return np.asarray((self._stamps[group] - self._start) * 1e-6, dtype=np.float64)

    def values(self, column: str) -> Array:
        """Numbers of a field of a ULog file."""
        return np.asarray(self._values[column], dtype=np.float64)


def _parsed(path: str | PathLike[str]) -> ULog:
    """All messages of a ULog file; damage that its parser prints goes to the record's history."""
    with needs("pyulog", "ulog"):
        from pyulog import ULog
    with reading(path, UlogLog.kind), redirect_stdout(io.StringIO()), Path(path).open("rb") as stream:
        return ULog(stream)
