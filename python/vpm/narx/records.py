"""Records as the core reads them: one output, some inputs, sample by sample."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import overload

import numpy as np
from numpy.typing import ArrayLike

from vpm.errors import IdentificationError, check_known
from vpm.experiment import Experiment
from vpm.numbers import Array

#: A log, or arrays by name, which have no clock: their time counts samples.
RecordLike = Experiment | Mapping[str, ArrayLike]


@dataclass(frozen=True)
class Series:
    """Output and inputs of one record."""

    name: str
    time: Array  #: Shape (N,); s, or samples where the record has no clock.
    dt: float
    output: Array  #: Shape (N,).
    inputs: Array  #: Shape (N, m).


def series(record: RecordLike, output: str, inputs: Sequence[str], name: str = "record") -> Series:
    """Output and inputs of a record by the names of their channels.

    ``record``: each of shape (N,); ``name``: of a record without a name.
    """
    names = [output, *inputs]
    known = record.channels if isinstance(record, Experiment) else tuple(record)
    title = record.name if isinstance(record, Experiment) else name
    check_known(names, known, IdentificationError, f"record {title} has no channel", what="it has")
    try:
        columns = [np.asarray(record[channel], dtype=np.float64) for channel in names]
    except (TypeError, ValueError) as error:
        raise IdentificationError(f"record {title} holds something else than numbers: {error}") from error
    for channel, column in zip(names, columns, strict=True):
        if column.shape != (columns[0].size,):
            raise IdentificationError(
                f'"{channel}" of record {title} has shape {column.shape}, but "{output}" has {columns[0].size} '
                "samples; give one number for each sample"
            )
    table = columns[1][:, None] if len(inputs) == 1 else np.empty((columns[0].size, len(inputs)))
    for at, column in enumerate(columns[1:] if len(inputs) > 1 else ()):
        table[:, at] = column
    if isinstance(record, Experiment):
        return Series(title, record.time, record.dt, columns[0], table)
    return Series(title, np.arange(columns[0].size, dtype=np.float64), 1.0, columns[0], table)


def as_list(records: RecordLike | Sequence[RecordLike]) -> list[RecordLike]:
    """One record or several as a list."""
    return [records] if isinstance(records, Experiment | Mapping) else list(records)


@overload
def split_in_time(record: Experiment, share: float, overlap: int = 0) -> tuple[Experiment, Experiment]: ...


@overload
def split_in_time(
    record: Mapping[str, ArrayLike], share: float, overlap: int = 0
) -> tuple[Mapping[str, ArrayLike], Mapping[str, ArrayLike]]: ...


def split_in_time(record: RecordLike, share: float, overlap: int = 0) -> tuple[RecordLike, RecordLike]:
    """Split a record into a first and a last part.

    Neighbouring samples of a motion are almost the same sample, so that parts are contiguous in time and never drawn at
    random.

    Parameters
    ----------
    record : Experiment or mapping of str to array-like, shape (N,)
    share : float
        Of the first part, between 0 and 1.
    overlap : int
        Samples at the end of the first part that the second repeats, for the start of a free run.

    Returns
    -------
    tuple of two records

    Raises
    ------
    IdentificationError
        One of the parts would be empty.
    """
    length = len(record) if isinstance(record, Experiment) else len(np.asarray(next(iter(record.values()))))
    at = round(share * length)
    if not 0 < at < length or not 0 <= overlap <= at:
        raise IdentificationError(
            f"a share of {share:g} of {length} samples with {overlap} repeated leaves no two parts; give a share "
            "between 0 and 1 and repeat no more than the first part has"
        )
    if isinstance(record, Experiment):
        first, last = slice(0, at), slice(at - overlap, length)
        return (
            replace(record, name=f"{record.name}, first part", time=record.time[first], data=record.data[first]),
            replace(record, name=f"{record.name}, last part", time=record.time[last], data=record.data[last]),
        )
    columns = {name: np.asarray(values) for name, values in record.items()}
    return {name: c[:at] for name, c in columns.items()}, {name: c[at - overlap :] for name, c in columns.items()}
