"""MCAP files of JSON messages: numbers of topics, each topic with a clock of its own."""

import json
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from vpm.experiment.readers.base import Log, reading
from vpm.experiment.readers.clocked import TIME, ClockedLog
from vpm.experiment.readers.ros import BagLog
from vpm.numbers import Array
from vpm.units import is_unit


def open_mcap(path: str | PathLike[str]) -> Log:
    """Reader of a file of JSON messages, or else of messages of ROS."""
    return JsonLog(path) if is_json(path) else BagLog(path)


def is_json(path: str | PathLike[str]) -> bool:
    """Whether all channels of an MCAP file hold JSON; False where that cannot be told."""
    try:
        from mcap.reader import make_reader

        with Path(path).open("rb") as stream:
            summary = make_reader(stream).get_summary()
    except Exception:  # noqa: BLE001  # the library is not there, or the other reader says what is wrong
        return False
    channels = summary.channels.values() if summary else ()
    return bool(channels) and all(channel.message_encoding == "json" for channel in channels)


class JsonLog(ClockedLog):
    """Numbers of JSON messages: ``/topic.field``, over when they were logged, from the first message on.

    A clock is ``/topic``, or ``time``. Units are those that the description of a field in the schema states.
    """

    package, extra, kind = "mcap", "mcap", "an MCAP file of JSON"

    def __init__(self, path: str | PathLike[str]) -> None:
        super().__init__(path)
        self._stamps: dict[str, list[int]] = {}
        self._columns: dict[str, list[float]] = {}
        self._fields: dict[str, dict[str, list[float]]] = {}
        with reading(path, self.kind):
            self._collect()
        if not self._columns:
            raise self.error(f"{path} holds no messages with numbers; record its topics anew")
        self.clocks = {topic: topic for topic in self._stamps}
        self.sizes = {topic: len(stamps) for topic, stamps in self._stamps.items()}
        self.header = (TIME, *self._columns)
        self._start = min(stamps[0] for stamps in self._stamps.values())

    def _collect(self) -> None:
        from mcap.reader import make_reader

        with Path(self.path).open("rb") as stream:
            for schema, channel, message in make_reader(stream).iter_messages():
                fields = json.loads(message.data)
                if not isinstance(fields, dict):
                    self.refused[channel.topic] = "holds no objects; record messages with named fields"
                    continue
                if channel.topic not in self._stamps:
                    self._begin(channel.topic, fields, schema.data if schema else b"{}")
                self._stamps[channel.topic].append(message.log_time)
                for field, column in self._fields[channel.topic].items():
                    value = fields.get(field)
                    column.append(float(value) if isinstance(value, int | float) else np.nan)

    def _begin(self, topic: str, fields: dict[str, Any], schema: bytes) -> None:
        """Columns of an MCAP topic, by its first JSON message."""
        self._stamps[topic] = []
        self._fields[topic] = {}
        told = json.loads(schema)
        described = told.get("properties", {}) if isinstance(told, dict) else {}
        for name, value in fields.items():
            column = f"{topic}.{name}"
            if not isinstance(value, int | float):
                self.refused[column] = "is no number; map a field that is one"
                continue
            self.groups[column] = topic
            self._columns[column] = self._fields[topic][name] = []
            unit = str(described.get(name, {}).get("description", ""))
            if is_unit(unit):
                self.units[column] = unit

    def times(self, group: str) -> Array:
        """Times of an MCAP topic's JSON messages, s; whole nanoseconds are subtracted first."""
        return np.array([stamp - self._start for stamp in self._stamps[group]], dtype=np.float64) * 1e-9

    def values(self, column: str) -> Array:
        """Numbers of a field of JSON messages; NaN where a message does not have it."""
        return np.array(self._columns[column], dtype=np.float64)
