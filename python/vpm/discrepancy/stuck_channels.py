"""Stuck channels of records: positions or sensors that stand still although the machine moves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vpm.discrepancy.settings import ROUNDING, STEPS
from vpm.errors import DiagnosisError, VpmError
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.observer import measured_outputs
from vpm.simulate import judging_mode, simulate


def is_moving(record: Experiment, channel: str) -> bool:
    """Whether a channel moves by more than rounding, so that it is not stuck."""
    return _changes(record[channel])


def check_moving(model: Model, records: Sequence[Experiment]) -> None:
    """Raise an error where records show no motion: all channels are stuck, and any effect would explain them.

    Raises DiagnosisError: all positions that are measured are constant, or a channel is that the model itself moves.
    """
    shown = [f"{joint}.position" for joint in model.joints]
    measured = [(record, channel) for record in records for channel in shown if channel in record]
    if measured and not any(is_moving(record, channel) for record, channel in measured):
        names = ", ".join(dict.fromkeys(record.name for record, _ in measured))
        raise DiagnosisError(
            f"no joint moves in {names}: {_constant(*measured[0])}, and any effect explains that; "
            "check that its column is the right one, or record a motion"
        )
    check_stuck(model, records)


def check_stuck(model: Model, records: Sequence[Experiment]) -> None:
    """Raise an error about a channel that is stuck while the simulated model moves it measurably.

    Raises DiagnosisError: there is one.
    """
    for record in records:
        _check_record(model, record)


def _check_record(model: Model, record: Experiment) -> None:
    read = (*measured_outputs(model, record), *model.input_channels)
    still = [channel for channel in read if channel in record and not is_moving(record, channel)]
    if not still:
        return
    try:
        run = simulate(model, record, judging_mode(model, [record]))
    except VpmError:
        return  # whoever has to simulate the record says why that cannot be
    for channel in (name for name in still if name in run.channels):
        way = float(np.ptp(run[channel]))
        if np.isfinite(way) and way > _step(record, channel) and _changes(run[channel]):
            held = "describe its joint as fixed" if channel.endswith(".position") else "leave that channel out"
            raise DiagnosisError(
                f"{record.name}: {_constant(record, channel)}, and the model moves it by "
                f"{_value(record, channel, way, 3)}; check that its column is the right one, or {held}"
            )


def _step(record: Experiment, channel: str) -> float:
    """Largest quantisation step of a channel that looks stuck, from channels of its unit."""
    unit, own = record.unit(channel), 0.0 if channel.endswith(".position") else abs(float(record[channel][0]))
    alike = (float(np.ptp(record[name])) for name in record.channels if record.unit(name) == unit)
    return max(own, *alike) / STEPS


def _constant(record: Experiment, channel: str) -> str:
    return f"{channel} is {_value(record, channel, float(record[channel][0]), 6)} all the time"


def _value(record: Experiment, channel: str, value: float, digits: int) -> str:
    unit = record.unit(channel)
    return f"{value + 0.0:.{digits}g}" + ("" if unit == "1" else f" {unit}")


def _changes(values: NDArray[np.float64]) -> bool:
    return float(np.ptp(values)) > ROUNDING * float(np.spacing(np.max(np.abs(values))))
