"""A measured record: one uniform time grid, named channels in SI units, and how it came to be what it is."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Self, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from vpm.errors import ExperimentError, near_match
from vpm.experiment.grid import (
    FEWEST_SAMPLES,
    Source,
    check_finite,
    check_increasing,
    check_uniform,
    is_smooth,
    make_uniform,
)
from vpm.experiment.signal import RETAINED_BAND, anti_alias, differentiate, interpolate, lowpass
from vpm.files import replacing
from vpm.numbers import Array, array_of
from vpm.results import Result
from vpm.units import parse_unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from vpm.experiment.readers.frame import Frame
    from vpm.model import ChannelEntry, Model


_Record = TypeVar("_Record", bound="Experiment")
_Known = TypeVar("_Known")
_NEXT = {"position": "velocity", "velocity": "acceleration"}


@dataclass(frozen=True, repr=False, eq=False)
class Experiment(Result):
    """A log of a machine; immutable, every change gives a new one.

    Attributes
    ----------
    time : ndarray, shape (N,)
        As logged, s.
    data : ndarray, shape (N, C)
        SI units.
    channels : tuple of str
        Names as in the model, for example ``"axis.position"``.
    history : tuple of str
        One sentence for each thing that was done to the numbers.
    unused_columns : tuple of str
        Columns of the file that no channel asked for.
    slower : mapping of str to float
        Rate at which a channel was read, Hz, where that is below the rate of the record, whose samples between two
        readings are interpolated.
    retained : mapping of str to float
        Frequency above which a filter of this library took a channel away, Hz, and its noise with it.
    read_at : mapping of str to ndarray
        Times, s, at which a channel that may jump was read, where that was less often than the record: straight lines
        run from reading to reading.
    """

    name: str
    time: Array
    data: Array
    channels: tuple[str, ...]
    units: tuple[str, ...]
    history: tuple[str, ...] = ()
    unused_columns: tuple[str, ...] = field(default=())
    slower: Mapping[str, float] = field(default_factory=dict)
    retained: Mapping[str, float] = field(default_factory=dict)
    read_at: Mapping[str, Array] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Take read-only copies of a record's arrays and check that the parts fit together."""
        for attribute in ("time", "data"):
            values = np.array(
                array_of(getattr(self, attribute), f"{self.name}: {attribute}", ExperimentError), order="C"
            )
            values.setflags(write=False)
            object.__setattr__(self, attribute, values)
        expected = (self.time.size, len(self.channels))
        if self.time.ndim != 1 or self.data.shape != expected or len(self.units) != len(self.channels):
            raise ExperimentError(
                f"{self.name}: data of shape {self.data.shape} and {len(self.units)} units do not fit time of shape "
                f"{self.time.shape} and {len(self.channels)} channels; give one column and one unit for each channel"
            )
        repeated = [channel for at, channel in enumerate(self.channels) if channel in self.channels[:at]]
        if repeated:
            raise ExperimentError(
                f'{self.name}: the channel "{repeated[0]}" is there twice; rename one of them', channel=repeated[0]
            )
        self._check()

    def _check(self) -> None:
        """Check the numbers of a record as those of a file are."""
        source = Source(self.name)
        check_finite(self.time, self.time, "the time", source, channel="time")
        check_increasing(self.time, source)
        check_uniform(self.time, source)
        for channel, unit, column in zip(self.channels, self.units, self.data.T, strict=True):
            parse_unit(unit)
            check_finite(column, self.time, f'the channel "{channel}"', source, channel=channel)

    @classmethod
    def load(
        cls,
        path: str | PathLike[str],
        channels: Mapping[str, ChannelEntry] | str | PathLike[str] | None = None,
        model: Model | None = None,
        *,
        irregular: Literal["error", "interpolate"] = "error",
        resample: float | None = None,
        name: str | None = None,
    ) -> Self:
        """Load a record: CSV, Parquet, MATLAB, HDF5, a ROS bag or MCAP, MDF, TDMS, ULog, or what `save` wrote.

        The ending of the name says which. Formats beside CSV and MATLAB up to 7.2 need an extra (``parquet``,
        ``hdf5``, ``ros``, ``mdf``, ``tdms``, ``ulog``).

        A channel table says which column is which channel: ``value = (column * scale + offset)`` in its unit, which
        becomes SI, and a channel that lags the others by ``delay`` is moved back. Without any table every column is a
        channel of its own name, a unit may stand in brackets (``q [mm]``), and the clock is the column ``time``,
        ``time_s`` or ``t``.

        Parameters
        ----------
        channels : mapping of str to ChannelEntry, or path-like, optional
            Table, or TOML file of one; by default that of the model.
        model : Model, optional
            The channels have to be known to it and to have units of the right kind.
        irregular : {"error", "interpolate"}
            What to do with missing samples, uneven steps, and channels that have clocks of their own.
        resample : float, optional
            Interpolate onto this rate, Hz, with an anti-aliasing filter where it is lower.
        name : str, optional
            By default the file's name without its ending.

        Raises
        ------
        ExperimentError
            Something in the file cannot be right; the message says what, where, and how to repair it.
        UnitError
            A unit cannot be read.
        """
        if str(path).endswith(".npz"):
            return _read_from(path, super().load(path), {})
        from vpm.experiment.loading import channel_table, record_of_log
        from vpm.experiment.readers import open_log

        log, table = open_log(path), channel_table(channels, model)
        how: dict[str, Any] = {"irregular": irregular, "resample": resample, "name": name or Path(path).stem}
        record = record_of_log(cls, log, table, model, **how)
        return _read_from(path, record, {**how, "channels": None if table is None else dict(table), "model": model})

    @cached_property
    def path(self) -> str | None:
        """File that the record was read from; None if it came another way or was changed since."""
        return None

    @cached_property
    def reading(self) -> Mapping[str, Any] | None:
        """What `load` was given beside the path, with which the file reads as this record; None as for `path`."""
        return None

    def __setstate__(self, state: dict[str, object]) -> None:
        """Take a pickled record; arrays are read-only again."""
        self.__dict__.update(state)
        self.time.setflags(write=False)
        self.data.setflags(write=False)

    @classmethod
    def from_frame(
        cls,
        frame: Frame,
        channels: Mapping[str, ChannelEntry] | str | PathLike[str] | None = None,
        model: Model | None = None,
        *,
        name: str = "frame",
        irregular: Literal["error", "interpolate"] = "error",
        resample: float | None = None,
    ) -> Self:
        """Record from a data frame of pandas or polars, by a channel table and checked as a file is.

        Parameters
        ----------
        frame : data frame
            One row per sample; an index with a name is a column as well.
        channels, model, irregular, resample
            As in `load`.

        Raises
        ------
        ExperimentError, UnitError
        """
        from vpm.experiment.loading import record_of_log
        from vpm.experiment.readers.frame import FrameLog

        log = FrameLog(frame, name)
        return record_of_log(cls, log, channels, model, irregular=irregular, resample=resample, name=name)

    @classmethod
    def from_arrays(
        cls,
        time: ArrayLike,
        values: Mapping[str, ArrayLike],
        units: Mapping[str, str] | None = None,
        name: str = "arrays",
        model: Model | None = None,
        *,
        irregular: Literal["error", "interpolate"] = "error",
        resample: float | None = None,
    ) -> Self:
        """Record from arrays, checked as a file is.

        Parameters
        ----------
        time : array-like, shape (N,)
            s.
        values : mapping of str to array-like, shape (N,)
            One entry per channel.
        units : mapping of str to str, optional
            Unit in which each channel is given; by default that of the model, or ``"1"`` without one.
        model, irregular, resample
            As in `load`.

        Raises
        ------
        ExperimentError, UnitError
        """
        from vpm.experiment.loading import record_of_arrays

        return record_of_arrays(
            cls, time, values, units or {}, model, irregular=irregular, resample=resample, name=name
        )

    @property
    def dt(self) -> float:
        """Time between samples, s: the mean over the record."""
        return float(self.time[-1] - self.time[0]) / (self.time.size - 1)

    @property
    def rate(self) -> float:
        """Samples of a record per second, Hz."""
        return 1.0 / self.dt

    @property
    def duration(self) -> float:
        """Time from the first to the last sample of a record, s."""
        return float(self.time[-1] - self.time[0])

    def __len__(self) -> int:
        """Count of a record's samples."""
        return self.time.size

    def __contains__(self, channel: object) -> bool:
        """Whether the record has a channel of this name."""
        return channel in self.channels

    def __iter__(self) -> Iterator[str]:
        """Names of a record's channels."""
        return iter(self.channels)

    def __getitem__(self, channel: str) -> Array:
        """Values of a record's channel, shape (N,), in SI units."""
        return self.data[:, self._index(channel)]

    def unit(self, channel: str) -> str:
        """SI unit of a record's channel."""
        return self.units[self._index(channel)]

    def read_rate(self, channel: str) -> float:
        """Rate at which a record's channel was read, Hz: that of the record, or below."""
        return min(self.rate, self.slower.get(channel, self.rate))

    def trim(self, start: float | None = None, stop: float | None = None) -> Self:
        """Part of the record from `start` to `stop`, both in s on its own clock and inclusive."""
        slack = 1e-6 * self.dt
        first = self.time[0] if start is None else start
        last = self.time[-1] if stop is None else stop
        kept = (self.time >= first - slack) & (self.time <= last + slack)
        if kept.sum() < FEWEST_SAMPLES:
            raise ExperimentError(
                f"{self.name}: {kept.sum()} samples lie between {first:.12g} s and {last:.12g} s, and at least "
                f"{FEWEST_SAMPLES} are needed; the record goes from {self.time[0]:.12g} s to {self.time[-1]:.12g} s"
            )
        time = self.time[kept]
        return self._changed(
            f"Trimmed to {time[0]:.6g} s ... {time[-1]:.6g} s, {time.size} of {len(self)} samples.",
            time=time,
            data=self.data[kept],
        )

    def split(self, fraction: float) -> tuple[Self, Self]:
        """Training and validation record: the first `fraction` of the time, and the rest."""
        count = round(fraction * len(self)) if 0.0 <= fraction <= 1.0 else 0
        if min(count, len(self) - count) < FEWEST_SAMPLES:
            raise ExperimentError(
                f"{self.name}: a split at {fraction:g} leaves {count} and {len(self) - count} of {len(self)} samples, "
                f"and each part needs at least {FEWEST_SAMPLES}; choose a fraction nearer to a half"
            )
        parts = []
        for label, part in (("train", slice(None, count)), ("validation", slice(count, None))):
            time = self.time[part]
            sentence = f"Split at {fraction:g}: the {label} part, {time[0]:.6g} s ... {time[-1]:.6g} s."
            parts.append(self._changed(sentence, name=f"{self.name}-{label}", time=time, data=self.data[part]))
        return parts[0], parts[1]

    def renamed(self, name: str) -> Self:
        """The same record under another name."""
        return replace(self, name=name)

    def select(self, channels: Sequence[str]) -> Self:
        """Record with some of its channels, in the order in which they are named."""
        places = [self._index(channel) for channel in channels]
        if places == list(range(len(self.channels))):
            return self
        left = [channel for channel in self.channels if channel not in channels]
        return self._changed(
            f"Left out {', '.join(left)}." if left else "The channels were put in another order.",
            data=self.data[:, places],
            channels=tuple(channels),
            units=tuple(self.units[place] for place in places),
        )

    def resample(self, rate: float) -> Self:
        """Record on a uniform grid of another rate, Hz.

        Where the rate falls, a zero-phase anti-aliasing filter comes first. Motions are interpolated by cubic splines,
        all other channels, which may jump, by straight lines.
        """
        if not rate > 0.0 or self.duration * rate < FEWEST_SAMPLES:
            raise ExperimentError(
                f"{self.name}: {rate:g} Hz gives fewer than {FEWEST_SAMPLES} samples in {self.duration:g} s; "
                f"choose a rate above {FEWEST_SAMPLES / self.duration:.4g} Hz"
            )
        factor = self.rate / rate
        data = self.data if factor <= 1.0 else anti_alias(self.data, factor)
        time, data, _ = make_uniform(self.time, data, self.channels, rate, Source(self.name))
        kept = 0.5 * RETAINED_BAND * rate
        how = f"below a filter at {kept:.6g} Hz" if factor > 1.0 else "without a filter"
        told = f"Resampled from {self.rate:.6g} Hz to {rate:.6g} Hz {how}."
        if factor <= 1.0:
            read = {channel: self.read_rate(channel) for channel in self.channels} if factor < 1.0 else self.slower
            return self._changed(told, time=time, data=data, slower=read)
        retained = {channel: min(kept, self.retained.get(channel, kept)) for channel in self.channels}
        return self._changed(told, time=time, data=data, retained=retained, read_at={})

    def filter(self, channel: str, cutoff: float, order: int = 4) -> Self:
        """Record with one channel behind a zero-phase Butterworth filter (see `vpm.experiment.signal.lowpass`)."""
        values = lowpass(self[channel], self.rate, cutoff, order)
        sentence = f"{channel} was filtered at {cutoff:.6g} Hz (Butterworth of order {order}, forward and backward)."
        filtered = self._with_column(channel, values, self.unit(channel), sentence)
        retained = min(cutoff, self.retained.get(channel, cutoff))
        return replace(filtered, retained={**self.retained, channel: retained}, read_at=_without(self.read_at, channel))

    def differentiate(self, channel: str, name: str | None = None) -> Self:
        """Record with the derivative of a channel as a further one.

        Parameters
        ----------
        name : str, optional
            By default ``J.velocity`` for ``J.position`` and ``J.acceleration`` for ``J.velocity``.
        """
        owner, _, quantity = channel.rpartition(".")
        target = name or (f"{owner}.{_NEXT[quantity]}" if quantity in _NEXT else None)
        if target is None:
            raise ExperimentError(
                f'{self.name}: the derivative of "{channel}" has no customary name; give one', channel=channel
            )
        if target in self:
            raise ExperimentError(
                f'{self.name}: the channel "{target}" is there already; give another name to the derivative',
                channel=target,
            )
        unit = parse_unit(f"({self.unit(channel)})/s").si
        sentence = f"{target} is the derivative of {channel} by central differences of fourth order."
        return self._with_column(target, differentiate(self[channel], self.dt), unit, sentence)

    def with_channel(self, name: str, values: ArrayLike, unit: str = "1") -> Self:
        """Record with a further or a replaced channel.

        Parameters
        ----------
        values : array-like, shape (N,)
        unit : str
            In which the values are given; they are stored in SI.
        """
        column = np.asarray(values, dtype=np.float64)
        if column.shape != self.time.shape:
            raise ExperimentError(
                f'{self.name}: values of shape {column.shape} were given for "{name}", and the record has shape '
                f"{self.time.shape}; give one value per sample",
                channel=name,
            )
        check_finite(column, self.time, f'the channel "{name}"', Source(self.name), channel=name)
        parsed = parse_unit(unit)
        verb = "replaced by" if name in self else "added from"
        sentence = f"{name} was {verb} values in {unit}."
        changed = self._with_column(name, parsed.to_si(column), parsed.si, sentence)
        slower, retained = (_without(one, name) for one in (self.slower, self.retained))
        return replace(changed, slower=slower, retained=retained, read_at=_without(self.read_at, name))

    def align(self, delays: Mapping[str, float]) -> Self:
        """Record with some channels moved back by the times by which they lag the others.

        Parameters
        ----------
        delays : mapping of str to float
            Channel to delay, s; negative where a channel runs ahead. Samples at the ends for which a moved channel has
            no value are cut.
        """
        latest, earliest = max(0.0, *delays.values()), min(0.0, *delays.values())
        slack = 1e-6 * self.dt
        inside = (self.time + earliest >= self.time[0] - slack) & (self.time + latest <= self.time[-1] + slack)
        if inside.sum() < FEWEST_SAMPLES:
            raise ExperimentError(
                f"{self.name}: delays from {earliest:g} s to {latest:g} s leave {inside.sum()} of {len(self)} samples "
                f"over {self.duration:g} s; check their unit, which is the second"
            )
        data = self.data[inside].copy()
        moved = []
        for channel, delay in delays.items():
            at = np.clip(self.time[inside] + delay, self.time[0], self.time[-1])
            data[:, self._index(channel)] = interpolate(self.time, self[channel], at, smooth=is_smooth(channel))
            moved.append(f"{channel} by {delay:.6g} s")
        lost = len(self) - int(inside.sum())
        sentence = f"Moved back {', '.join(moved)}; {lost} samples at the ends, which have no value there, were cut."
        read_at = {channel: time - delays.get(channel, 0.0) for channel, time in self.read_at.items()}
        return self._changed(sentence, time=self.time[inside], data=data, read_at=read_at)

    def to_csv(self, path: str | PathLike[str]) -> Path:
        """Write a record as a table, ``time [s]`` and each channel with its unit in brackets, for `load`."""
        with replacing(path) as beside, beside.open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(["time [s]", *(f"{channel} [{self.unit(channel)}]" for channel in self)])
            columns = [self.time, *(self[channel] for channel in self)]
            writer.writerows([repr(float(value)) for value in row] for row in zip(*columns, strict=True))
        return Path(path)

    def plot(self) -> Figure:
        """Plot all channels of a record over time. Needs the extra ``plot``."""
        from vpm.plot import plot_channels

        return plot_channels(self.time, self.data, self.channels, self.units, title=self.name)

    def _index(self, channel: str) -> int:
        try:
            return self.channels.index(channel)
        except ValueError:
            raise ExperimentError(
                f'{self.name} has no channel "{channel}"; {near_match(channel, self.channels, what="it has")}',
                channel=channel,
            ) from None

    def _with_column(self, channel: str, values: Array, unit: str, sentence: str) -> Self:
        if channel in self:
            at = self._index(channel)
            data = self.data.copy()
            data[:, at] = values
            return self._changed(sentence, data=data, units=(*self.units[:at], unit, *self.units[at + 1 :]))
        return self._changed(
            sentence,
            data=np.column_stack([self.data, values]),
            channels=(*self.channels, channel),
            units=(*self.units, unit),
        )

    def _changed(self, sentence: str, **changes: Any) -> Self:  # noqa: ANN401  other values of fields
        return replace(self, history=(*self.history, sentence), **changes)

    def _headline(self) -> Mapping[str, object]:
        shown: dict[str, object] = {"name": self.name, "samples": len(self), "rate_hz": self.rate}
        shown["channels"] = self.channels
        if self.unused_columns:
            shown["unused_columns"] = self.unused_columns
        return shown

    def _html_rows(self) -> Mapping[str, object]:
        rows: dict[str, object] = {"name": self.name, "samples": len(self), "rate": f"{self.rate:.6g} Hz"}
        for channel, unit, column in zip(self.channels, self.units, self.data.T, strict=True):
            rows[channel] = f"{column.min():.6g} ... {column.max():.6g} {unit}"
        if self.unused_columns:
            rows["unused columns"] = ", ".join(self.unused_columns)
        return {**rows, **{f"history {at}": sentence for at, sentence in enumerate(self.history, 1)}}

    def _frame_columns(self) -> Mapping[str, object]:
        return {"time_s": self.time, **dict(zip(self.channels, self.data.T, strict=True))}


def _without(known: Mapping[str, _Known], channel: str) -> dict[str, _Known]:
    """What is known of a record's other channels."""
    return {other: value for other, value in known.items() if other != channel}


def _read_from(path: str | PathLike[str], record: _Record, how: Mapping[str, Any]) -> _Record:
    """The record, which knows its file: a path is no part of what makes two records equal."""
    record.__dict__.update(path=str(path), reading=how)
    return record
