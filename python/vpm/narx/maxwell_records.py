"""Records of an element between two points: its force, its length and, where there is one, its drive signal."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vpm.errors import IdentificationError
from vpm.experiment import Experiment
from vpm.narx.records import RecordLike, as_list, series
from vpm.numbers import Array
from vpm.results import Storable


@dataclass(frozen=True, repr=False, eq=False)
class MaxwellSignals(Storable):
    """Names of the channels of an element.

    Attributes
    ----------
    force : str
        N, positive where the element pulls its ends together.
    length : str
        m.
    drive : str, optional
        Drive signal u, for example a valve current; without it the maps depend on the length alone.
    """

    force: str = "force"
    length: str = "length"
    drive: str | None = None


@dataclass(frozen=True)
class Samples:
    """Force, length and drive of a Maxwell element in one record; arrays of shape (N,)."""

    name: str
    unit: str
    time: Array
    step: float
    force: Array
    length: Array
    drive: Array


def element_samples(
    records: RecordLike | Sequence[RecordLike], signals: MaxwellSignals, step: float | None = None, least: int = 3
) -> list[Samples]:
    """Records of an element as arrays.

    - ``records``: each of shape (N,)
    - ``step``: time between samples of mappings, which have no clock, s
    - ``least``: fewest samples of a record
    """
    found = [_samples(record, signals, step, f"record {at}", least) for at, record in enumerate(as_list(records))]
    if not found:
        raise IdentificationError("there is no record; give one at least")
    steps = np.array([one.step for one in found])
    other = int(np.argmax(np.abs(steps - steps[0])))
    if abs(steps[other] - steps[0]) > 1e-6 * steps[0]:
        raise IdentificationError(
            f"record {found[other].name} is sampled every {steps[other]:g} s, but {found[0].name} every {steps[0]:g} "
            "s; a difference equation has one step: resample one of them"
        )
    return found


def _samples(record: RecordLike, signals: MaxwellSignals, step: float | None, name: str, least: int) -> Samples:
    inputs = [signals.length] + ([signals.drive] if signals.drive else [])
    given = series(record, signals.force, inputs, name)
    clocked = isinstance(record, Experiment)
    if not clocked and step is None:
        raise IdentificationError(f"{name} is a mapping and has no clock; give the time between its samples as step=")
    dt = given.dt if clocked or step is None else step
    if given.output.size < least:
        raise IdentificationError(
            f"record {given.name} has {given.output.size} samples, but needs {least} at least; give a longer record"
        )
    for channel, column in zip((signals.force, *inputs), (given.output, *given.inputs.T), strict=True):
        wrong = np.flatnonzero(~np.isfinite(column))
        if wrong.size:
            raise IdentificationError(
                f'"{channel}" of record {given.name} is {column[wrong[0]]} at sample {wrong[0]}; repair it or '
                "cut it off"
            )
    drive = given.inputs[:, 1].copy() if signals.drive else np.zeros(given.output.size)
    unit = record.unit(signals.force) if isinstance(record, Experiment) else "1"
    time = given.time if clocked else given.time * dt
    return Samples(given.name, unit, time, dt, given.output, given.inputs[:, 0].copy(), drive)
