"""ROS bags of both generations and MCAP files: fields of messages, each topic with a clock of its own."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from vpm.errors import ExperimentError, MissingExtraError, needs
from vpm.experiment.readers.base import Log
from vpm.experiment.readers.message import Field, has_stamp, leaves, parse_field, stamp_of, value_of
from vpm.experiment.table import Table
from vpm.numbers import Array

if TYPE_CHECKING:
    from rosbags.highlevel import AnyReader


#: Fields that every topic has beside those of its messages: when the sender stamped them, when they were recorded.
STAMP, RECEIVED = "header.stamp", "time"


class _Topic(NamedTuple):
    """A topic, its first message and its number of messages."""

    name: str
    first: object
    messages: int


@dataclass
class _Series:
    """Values of one column and the stamps of their messages, ns."""

    stamps: list[int] = field(default_factory=list)
    values: list[float] = field(default_factory=list)


class BagLog(Log):
    """Numbers in the messages of a bag.

    A column is ``/topic.field``, ``/topic.field[2]`` or, by the names that stand in the same message,
    ``/joint_states.position[shoulder]``. A clock is ``/topic.header.stamp`` (when the sender stamped the message),
    ``/topic.time`` (when it was recorded), ``/topic`` (the stamp if there is one), or ``time``: that of the topic with
    the most messages among those that are read. Every column comes with the times of its own messages, stamped or
    recorded as the clock is where they can be.
    """

    def __init__(self, path: str | PathLike[str]) -> None:
        super().__init__(path)
        self._topics: dict[str, _Topic] = {}
        with self._opened() as bag:
            for connection in bag.connections:
                topic = connection.topic
                if topic in self._topics:
                    continue
                for _, _, raw in bag.messages(connections=[connection]):
                    first = bag.deserialize(raw, connection.msgtype)
                    self._topics[topic] = _Topic(topic, first, bag.topics[topic].msgcount)
                    break
                else:
                    self.refused[topic] = "has no messages; record it, or do not map it"
        self._fields = {name: tuple(leaves(topic.first)) for name, topic in self._topics.items()}
        self.header = ("time", *(f"{name}.{leaf}" for name, found in self._fields.items() for leaf in found))

    def find(self, column: str) -> str | None:
        """Name of a column in a ROS bag; see `Log.find`."""
        if column == "time":
            return column
        name, _, rest = column.partition(".")
        topic = self._topics.get(name if name.startswith("/") else f"/{name}")
        if topic is None:
            return None
        if not rest:
            rest = STAMP if has_stamp(topic.first) else RECEIVED
        if rest == RECEIVED or (rest == STAMP and has_stamp(topic.first)):
            return f"{topic.name}.{rest}"
        parsed = parse_field(rest, topic.first)
        return None if parsed is None else f"{topic.name}.{parsed.text}"

    def missing(self, column: str, channel: str = "") -> ExperimentError:
        """Error for a column that is not in a ROS bag, or whose topic is empty; see `Log.missing`."""
        topic = f"/{column.partition('.')[0].lstrip('/')}"
        return super().missing(topic if topic in self.refused else column, channel)

    def _read(self, columns: Sequence[str], clock: str) -> Table:
        """Columns of a ROS bag by name, each with its own times; see `Log.read`."""
        wanted = [column for column in columns if column != clock]
        for column in wanted:
            if column == "time" or column.partition(".")[2] in {STAMP, RECEIVED}:
                raise self.error(f'{self.path}: "{column}" is a clock and no channel; map it to time only')
        base, kind = self._clock(wanted, clock)
        stamped = {name: kind == STAMP and has_stamp(topic.first) for name, topic in self._topics.items()}
        series = self._collect([*wanted, f"{base}.{RECEIVED}"], stamped)
        own = [column for column in wanted if column.startswith(f"{base}.")]
        stamps = series[own[0] if own else f"{base}.{RECEIVED}"].stamps
        start = stamps[0]
        clocks = {column: self._seconds(series[column].stamps, start, column) for column in wanted}
        time = self._seconds(stamps, start, f"{base}.{kind}")
        values = {column: np.array(series[column].values, dtype=np.float64) for column in wanted}
        how = "stamped" if stamped[base] else "recorded"
        note = (
            f"The clock is when messages of {base} were {how}; it counts from "
            f"{start // 10**9}.{start % 10**9:09d} s of that clock."
        )
        return Table(self.header, {clock: time, **values}, None, frozenset({clock}), clocks, (note,))

    def _clock(self, wanted: Sequence[str], clock: str) -> tuple[str, str]:
        """Topic of a ROS bag whose messages are the clock, and which of their two times."""
        name, _, kind = clock.partition(".")
        if name != "time":
            if kind in {STAMP, RECEIVED}:
                return name, kind
            raise self.error(
                f'{self.path}: "{clock}" is no clock; map time to {name}.{STAMP}, {name}.{RECEIVED} or {name}'
            )
        names = dict.fromkeys(column.partition(".")[0] for column in wanted) or self._topics
        busiest = max(names, key=lambda topic: self._topics[topic].messages, default="")
        if not busiest:
            raise self.error(f"{self.path} holds no messages; record its topics anew")
        return busiest, STAMP if has_stamp(self._topics[busiest].first) else RECEIVED

    def _collect(self, columns: Sequence[str], stamped: dict[str, bool]) -> dict[str, _Series]:
        """One pass over the messages of a ROS bag's topics that are read."""
        asked: dict[str, list[tuple[str, Field | None]]] = {}
        for column in columns:
            name, _, rest = column.partition(".")
            parsed = None if rest in {STAMP, RECEIVED} else parse_field(rest, self._topics[name].first)
            asked.setdefault(name, []).append((column, parsed))
        series = {column: _Series() for column in columns}
        with self._opened() as bag:
            chosen = [connection for connection in bag.connections if connection.topic in asked]
            for connection, received, raw in bag.messages(connections=chosen):
                message = bag.deserialize(raw, connection.msgtype)
                when = stamp_of(message) if stamped[connection.topic] else received
                for column, parsed in asked[connection.topic]:
                    value = self._value(message, parsed, column, len(series[column].stamps))
                    if value is not None:  # another sender's message on the same topic, without this name
                        series[column].stamps.append(when)
                        series[column].values.append(value)
        return series

    def _value(self, message: object, parsed: Field | None, column: str, at: int) -> float | None:
        if parsed is None:
            return 0.0
        try:
            return value_of(message, parsed)
        except (AttributeError, IndexError, TypeError, ValueError) as error:
            raise self.error(
                f'{self.path}: message {at} has no number at "{column}" ({error}), which the first message had; '
                "map a field that every message holds"
            ) from error

    def _seconds(self, stamps: Sequence[int], start: int, column: str) -> Array:
        """Times of ROS messages from ``start``, s; whole nanoseconds are subtracted first."""
        time = np.array(stamps, dtype=np.int64)
        back = np.flatnonzero(np.diff(time) <= 0)
        if back.size:
            name = column.partition(".")[0]
            raise self.error(
                f"{self.path}: the time of message {back[0] + 1} of {name} does not lie after the one before, at "
                f"{(time[back[0]] - start) * 1e-9:.9g} s, as do {back.size} in all; map time to "
                f"{name}.{RECEIVED}, when they were recorded, or repair the stamps"
            )
        return np.asarray(time - start, dtype=np.float64) * 1e-9

    @contextmanager
    def _opened(self) -> Iterator[AnyReader]:
        with needs("rosbags", "ros"):
            from rosbags.highlevel import AnyReader
            from rosbags.typesys import Stores, get_typestore
        try:
            with AnyReader([Path(self.path)], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as bag:
                yield bag
        except (ExperimentError, MissingExtraError):
            raise
        except Exception as error:  # the readers of four formats raise what their parsers raise
            raise self.error(
                f"{self.path} cannot be read as a bag ({str(error).splitlines()[0] if str(error) else type(error)}); "
                "check that it was closed when it was recorded (ros2 bag reindex, mcap recover), and its ending"
            ) from error
