"""Elements in sampled time in the place of servo-cylinders and their controllers, learnt from the full model.

An element replaces a drive with its loop: a Maxwell element (D'Imperio 2016, section 5.2.5) or a polynomial NARX model.
Its input is the reference of the controller, or the command of a drive without one. It is fitted to what the full model
does on the records to learn from.
"""

import json
from collections.abc import Iterator, Sequence

import numpy as np

from vpm.experiment import Experiment
from vpm.model import Model
from vpm.numbers import Array
from vpm.simplify.hydraulics import hydraulic_drives
from vpm.simplify.learnt import maxwell_entry, narx_entry, trained
from vpm.simplify.reductions import Reduction
from vpm.simplify.replacement import Replacement
from vpm.simplify.tables import tables
from vpm.simulate import Run, simulate

Record = dict[str, Array]


def surrogates(
    model: Model, records: Sequence[Experiment], mode: str, rate: float, channels: Sequence[str] | None = None
) -> tuple[Reduction, ...]:
    """Elements and a table for each servo-cylinder that they can be found for.

    Parameters
    ----------
    model : Model
        The full one, which is learnt from.
    records : sequence of Experiment
        To learn from.
    mode : str
        Sampled drives run in free runs and closed loops only.
    rate : float
        Samples of the element in a second, Hz.
    channels : sequence of str, optional
        What is to come out right; by default all that the records hold.
    """
    drives = hydraulic_drives(model)
    if not drives or mode not in ("free_run", "closed_loop"):
        return ()
    taught = [_taught(model, record, mode, rate) for record in records]
    fine = [_held(record, round(record.dt * rate), model) for record in records]
    learnt = (found for drive in drives for found in _learnt(model, drive, taught, 1.0 / rate))
    elements = (trained(model, each, fine, mode, channels) if each.name == "narx" else each for each in learnt)

    def moved(other: Model) -> list[Run]:
        return [simulate(other, each, mode, integrator="guarded") for each in fine]

    return (*elements, *tables(model, taught, moved))


def _taught(model: Model, record: Experiment, mode: str, rate: float) -> Record:
    """Channels that teach surrogates: a simulation of the full model in the controller's samples."""
    fine = _held(record, round(record.dt * rate), model)
    run = simulate(model, fine, mode)
    inputs = {name: fine[name] for name in fine.channels if name.endswith((".reference", ".command"))}
    return {**inputs, **{name: run[name] for name in run.channels}}


def _held(record: Experiment, count: int, model: Model) -> Experiment:
    """Record for surrogates with its inputs held over ``count`` samples for each of its own."""
    if count == 1:
        return record
    time = record.time[0] + record.dt / count * np.arange(count * len(record))
    values = {name: np.repeat(record[name], count) for name in record.channels}
    return Experiment.from_arrays(time, values, model=model, name=record.name)


def _learnt(model: Model, drive: str, taught: Sequence[Record], step: float) -> Iterator[Replacement]:
    """Surrogates learnt in the place of one drive: Maxwell and NARX, the one with fewer numbers last."""
    line = model.line_of_actuator(drive)
    moving = [f"{line}.length", f"{line}.rate"]
    if line is None:
        joint = model.joint_of_actuator(drive)
        moving = [f"{joint}.position", f"{joint}.velocity"]
    signal = "reference" if drive in model.controlled_actuators else "command"
    names = dict(zip(("length", "rate"), moving, strict=True))
    records = [
        {
            "force": -each[f"{drive}.force"],
            "drive": each[f"{drive}.{signal}"],
            **{name: each[channel] for name, channel in names.items()},
        }
        for each in taught
    ]
    narx = narx_entry(records, step, {**names, "drive": f"{drive}.command"})
    for entry in (narx, maxwell_entry(records, step)):
        if entry is not None:
            yield Replacement("drive", str(entry["type"]), drive, json.dumps(entry))
