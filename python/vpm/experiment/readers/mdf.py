"""MDF files of versions 2 to 4, as measurement systems of vehicles write them: channels in groups with clocks."""

from __future__ import annotations

import io
import traceback
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vpm.errors import VpmError
from vpm.experiment.readers import guarded
from vpm.experiment.readers.base import Log, reading
from vpm.experiment.readers.clocked import TIME, ClockedLog, silent
from vpm.expression import Quantity, read_expression
from vpm.numbers import Array
from vpm.units import is_unit

if TYPE_CHECKING:
    from asammdf import MDF


#: Synchronisation of a master channel by time, in both versions; the others count angles, lengths or samples.
BY_TIME = 1
#: Frames of buses are not decoded when a file is opened, because that works out formulas.
_AS_IT_IS: dict[str, Any] = {"process_bus_logging": False}
#: First bytes of a file whose recorder was stopped before it had written all counts.
UNFINISHED = b"UnFinMF"


class _Place(NamedTuple):
    """Group and channel number at which an MDF file holds a channel."""

    group: int
    channel: int


def open_mdf(path: str | PathLike[str]) -> Log:
    """MDF reader that runs in a process of its own."""
    return guarded.GuardedLog(path, MdfLog)


class MdfLog(ClockedLog):
    """Channels of an MDF file by their names.

    Where one name stands in several groups, it is ``group.channel``: the name of its group, or its number where that
    has none of its own. Values are converted as the file says, and samples that it marks as invalid are NaN.

    Its library does not withstand damaged files: `guarded` has this class work in a process of its own.
    """

    package, extra, kind = "asammdf", "mdf", "an MDF file"
    _file: MDF

    def __init__(self, path: str | PathLike[str]) -> None:
        super().__init__(path)
        self._places: dict[str, _Place] = {}
        self._numbers: dict[str, int] = {}
        self._formulas: dict[_Place, Any] = {}
        with self._opened() as file:
            labels = _labels(file)
            for place, name in _names(file, labels).items():
                self._add(file, place, name, labels[place.group])
        if not self._places:
            raise self.error(f"{path} has no channel of numbers with a clock; record its channels anew")
        self.header = (TIME, *self._places)

    def _add(self, file: MDF, place: _Place, name: str, label: str) -> None:
        """Sort an MDF channel into clocks, columns, and what is no column."""
        group = file.groups[place.group]
        master = file.masters_db.get(place.group)
        reason = _group_reason(group, master)
        if master is not None and _Place(place.group, master) in self._formulas:
            reason = "is in a group whose clock is converted by a formula; record its time in seconds"
        if reason:
            self.refused[name] = reason
            return
        self._numbers[label] = place.group
        self.sizes[label] = int(group.channel_group.cycles_nr)
        if place.channel == master:
            self.clocks[name] = label
            return
        first, _ = _samples(file, place, count=1)
        if reason := self._formula_reason(place) or _value_reason(first):
            self.refused[name] = reason
            return
        self._places[name] = place
        self.groups[name] = label
        channel = group.channels[place.channel]
        conversion = self._formulas.get(place, channel.conversion)
        unit = str(getattr(conversion, "unit", "") or getattr(channel, "unit", ""))
        if is_unit(unit):
            self.units[name] = unit

    @contextmanager
    def held(self) -> Iterator[None]:
        """MDF file held open while it is read; see `ClockedLog.held`."""
        with self._opened() as self._file:
            yield

    def times(self, group: str) -> Array:
        """Times of an MDF group from the start of the measurement, s."""
        return np.array(self._file.get_master(self._numbers[group]), dtype=np.float64)

    def values(self, column: str) -> Array:
        """Numbers of a channel of an MDF file; those that are invalid are NaN."""
        place = self._places[column]
        samples, invalid = _samples(self._file, place)
        if reason := _value_reason(samples):  # conversions may give numbers and text by turns
            raise self.error(f'{self.path}: "{column}" {reason}')
        values = np.array(samples, dtype=np.float64)
        if conversion := self._formulas.get(place):
            values = _by_formula(_formula(conversion), values)
        if invalid is not None:
            values[np.asarray(invalid, dtype=bool)] = np.nan
        return values

    def _formula_reason(self, place: _Place) -> str:
        """Why the formula of an MDF channel cannot be computed, or ""."""
        conversion = self._formulas.get(place)
        if conversion is None:
            return ""
        try:
            _by_formula(_formula(conversion), np.ones(1))
        except VpmError as error:
            return f"is converted by a formula that is not known ({error}); record it without"
        return ""

    @contextmanager
    def _opened(self) -> Iterator[MDF]:
        from asammdf import MDF

        with reading(self.path, self.kind):
            try:
                # Through a stream of our own, because the library leaves files that it cannot read open.
                with silent("asammdf"), _stream(self.path) as stream, MDF(stream, **_AS_IT_IS) as file:
                    _check_records(file)
                    self._formulas = _without_formulas(file)
                    yield file
            except Exception as error:
                _close_halves(error)
                raise


def _stream(path: str | PathLike[str]) -> io.BufferedReader | io.BytesIO:
    """MDF file, or a copy in memory of one whose recorder was stopped; the library completes it in place."""
    stream = Path(path).open("rb")  # noqa: SIM115  # closed by whoever asked for it
    if stream.read(len(UNFINISHED)) == UNFINISHED:
        with stream:
            stream.seek(0)
            return io.BytesIO(stream.read())
    stream.seek(0)
    return stream


def _check_records(file: MDF) -> None:
    """Refuse MDF channels that lie outside of their records, which the library does not check."""
    groups: list[Any] = list(file.groups)
    for at, group in enumerate(groups):
        room = 8 * int(group.channel_group.samples_byte_nr)
        for channel in group.channels:
            if hasattr(channel, "start_offset"):  # version 3 counts bits
                first = channel.start_offset + 8 * getattr(channel, "additional_byte_offset", 0)
            else:
                first = 8 * channel.byte_offset + channel.bit_offset
            if first + channel.bit_count > room:
                raise ValueError(
                    f'the channel "{channel.name}" of group {at} ends at bit {first + channel.bit_count} of a record '
                    f"of {room}"
                )


def _without_formulas(file: MDF) -> dict[_Place, Any]:
    """MDF channels without formulas: the library may run what they say as Python.

    Result: the conversion of each channel that has one, itself or within a table.
    """
    found = {}
    groups: list[Any] = list(file.groups)
    for at, group in enumerate(groups):
        for index, channel in enumerate(group.channels):
            if _has_formula(channel.conversion):
                found[_Place(at, index)] = channel.conversion
                channel.conversion = None
    return found


def _has_formula(conversion: Any) -> bool:  # noqa: ANN401
    if conversion is None or isinstance(conversion, bytes):
        return False
    inner = (getattr(conversion, "referenced_blocks", None) or {}).values()
    return bool(getattr(conversion, "formula", "")) or any(map(_has_formula, inner))


def _formula(conversion: Any) -> str:  # noqa: ANN401
    """Formula of an MDF conversion that is one."""
    formula = conversion.formula
    if not formula:
        raise VpmError("a table of formulas")
    text = formula.decode("latin-1") if isinstance(formula, bytes) else str(formula)
    return text.strip(" \0\r\n")


def _by_formula(formula: str, raw: Array) -> Array:
    """Values of a formula of ``X`` or ``X1``, the raw value (ASAM MDF 4.1, conversion type 3; 3.3, type 10).

    Letters of any size: some writers make each x a large one, also that of ``exp``.
    """
    expression = read_expression(formula.lower())
    unknown = [name for name in expression.names if name not in {"x", "x1"}]
    if unknown:
        raise VpmError(f'"{formula}" names {unknown[0]}')
    return np.asarray(expression(dict.fromkeys(expression.names, Quantity(raw))).values, dtype=np.float64)


def _close_halves(error: Exception) -> None:
    """Close half-built MDF objects of the library, before it complains about them."""
    for frame, _ in traceback.walk_tb(error.__traceback__):
        half: Any = frame.f_locals.get("self")
        if type(half).__module__.startswith("asammdf") and hasattr(half, "close"):
            with suppress(AttributeError):
                half.close()


def _labels(file: MDF) -> list[str]:
    """Names of MDF groups: their own where no other group has it, else their number."""
    own = [str(getattr(group.channel_group, "acq_name", "") or "") for group in file.groups]
    seen = Counter(own)
    return [name if name and seen[name] == 1 else str(at) for at, name in enumerate(own)]


def _names(file: MDF, labels: list[str]) -> dict[_Place, str]:
    """Name of each MDF channel, with its group or a number where the name is not unique."""
    groups: list[Any] = list(file.groups)
    plain = {
        _Place(at, index): str(channel.name)
        for at, group in enumerate(groups)
        for index, channel in enumerate(group.channels)
    }
    seen = Counter(plain.values())
    masters = {_Place(at, index) for at, index in file.masters_db.items()}
    names: dict[_Place, str] = {}
    used: Counter[str] = Counter()
    for place, name in plain.items():
        # "time" alone is the clock of whichever group is read
        unique = seen[name] == 1 and (name != TIME or place in masters)
        full = name if unique else f"{labels[place.group]}.{name}"
        names[place] = f"{full}[{used[full]}]" if used[full] else full
        used[full] += 1
    return names


def _samples(file: MDF, place: _Place, count: int | None = None) -> tuple[NDArray[Any], NDArray[Any] | None]:
    """Samples of an MDF channel and which of them are invalid."""
    samples, invalid = file.get(
        group=place.group, index=place.channel, samples_only=True, ignore_invalidation_bits=True, record_count=count
    )
    return samples, invalid


def _group_reason(group: Any, master: int | None) -> str:  # noqa: ANN401
    """Why the channels of an MDF group are no columns, or ""."""
    if not group.channel_group.cycles_nr:
        return "has no samples; record it, or do not map it"
    if master is None:
        return "is in a group without a clock; record it with one"
    if getattr(group.channels[master], "sync_type", BY_TIME) != BY_TIME:
        return f'is measured over "{group.channels[master].name}", which is no time; record it over time'
    return ""


def _value_reason(samples: NDArray[Any]) -> str:
    """Why samples of an MDF channel are no numbers, or ""."""
    if samples.dtype.names or samples.ndim != 1:
        return "is an array or a structure; record its elements as channels"
    if samples.dtype.kind in "SUO":
        return "holds text; map a channel of numbers"
    if samples.dtype.kind not in "biuf":
        return f"holds {samples.dtype}, which is no real number; map a channel of numbers"
    return ""
