"""Whether records show any motion at all."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vpm.errors import DiagnosisError
from vpm.experiment import Experiment
from vpm.model import Model

#: Change of a position that is rounding, in steps from one number of its size to the next.
ROUNDING = 8.0


def check_moving(model: Model, records: Sequence[Experiment]) -> None:
    """Complain where no joint moves in any record: any effect would explain that as well as any other.

    Raises
    ------
    DiagnosisError
        All positions that are measured are constant.
    """
    shown = [f"{joint}.position" for joint in model.joints]
    measured = [(record, channel) for record in records for channel in shown if channel in record]
    if not measured or any(_moves(record, channel) for record, channel in measured):
        return
    record, channel = measured[0]
    names = ", ".join(dict.fromkeys(record.name for record, _ in measured))
    value, unit = f"{record[channel][0]:.6g}", record.unit(channel)
    raise DiagnosisError(
        f"no joint moves in {names}: {channel} is {value} {unit} all the time, and any effect explains that; "
        "check that its column is the right one, or record a motion"
    )


def _moves(record: Experiment, channel: str) -> bool:
    values = record[channel]
    return float(np.ptp(values)) > ROUNDING * float(np.spacing(np.max(np.abs(values))))
