"""Records as this package reads them: a clock and some channels, checked once."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from vpm.errors import ExperimentError, IdentificationError, check_known
from vpm.experiment import Experiment
from vpm.narx.records import RecordLike
from vpm.numbers import Array

#: ``"applied"``: the force that moves the part, ``F = k x + c dx/dt``. ``"reaction"``: what the part answers with, as a
#: cylinder's force that pushes its ends apart, ``F = k (x0 - x) - c dx/dt``.
Sense: TypeAlias = Literal["applied", "reaction"]


@dataclass(frozen=True)
class Columns:
    """Clock and channels of one record."""

    name: str
    time: Array  #: Shape (N,); s, strictly increasing.
    values: tuple[Array, ...]  #: Each of shape (N,); in the order of the names asked for, finite.


def columns(record: RecordLike, names: tuple[str, ...], fewest: int) -> Columns:
    """Clock and channels of a record by name.

    - ``record``: shape (N,); a mapping has its clock under ``"time"``, s
    - ``fewest``: samples that the question needs at least
    """
    is_log = isinstance(record, Experiment)
    title = record.name if isinstance(record, Experiment) else "record"
    known = record.channels if isinstance(record, Experiment) else tuple(record)
    check_known(
        names if is_log else ("time", *names), known, IdentificationError, f"{title} has no channel", what="it has"
    )
    clock = record.time if isinstance(record, Experiment) else _numbers(title, "time", record["time"])
    values = tuple(_numbers(title, name, record[name]) for name in names)
    for name, column in zip(names, values, strict=True):
        if column.shape != clock.shape:
            raise ExperimentError(
                f'{title}: "{name}" has {column.size} samples and its clock {clock.size}; give one for each time',
                channel=name,
            )
    if clock.size < fewest:
        raise ExperimentError(f"{title} has {clock.size} samples, and this needs at least {fewest}; record longer")
    backward = np.flatnonzero(np.diff(clock) <= 0.0)
    if backward.size:
        at = int(backward[0]) + 1
        raise ExperimentError(
            f"{title}: time does not increase at sample {at} ({clock[at - 1]:g} s, then {clock[at]:g} s); sort the "
            "samples and drop those that are there twice",
            time=float(clock[at]),
        )
    return Columns(title, clock, values)


def _numbers(title: str, name: str, given: ArrayLike) -> Array:
    """One channel as a flat array of finite numbers."""
    try:
        column = np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ExperimentError(f'{title}: "{name}" holds something else than numbers: {error}', channel=name) from error
    if column.ndim != 1:
        raise ExperimentError(f'{title}: "{name}" has shape {column.shape}; give one number per sample', channel=name)
    bad = np.flatnonzero(~np.isfinite(column))
    if bad.size:
        raise ExperimentError(
            f'{title}: "{name}" is {column[bad[0]]} at sample {bad[0]}, one of {bad.size} that are no finite numbers; '
            "cut them out or repair them before",
            channel=name,
        )
    return column


def check_sense(sense: str) -> float:
    """Check the sense of a force channel: the factor that makes it an applied one."""
    if sense not in {"applied", "reaction"}:
        raise IdentificationError(f'sense is "{sense}"; give "applied" for F = k x + c dx/dt, or "reaction" for -F')
    return 1.0 if sense == "applied" else -1.0


def check_moves(columns: Columns, displacement: str) -> None:
    """Refuse a displacement channel that stands still."""
    x = columns.values[0]
    if np.ptp(x) <= 16.0 * np.finfo(np.float64).eps * float(np.abs(x).max()):
        raise IdentificationError(
            f'{columns.name}: "{displacement}" is constant at {x[0]:g} m, and a part that does not move shows neither '
            "stiffness nor damping; give the channel that moves"
        )
