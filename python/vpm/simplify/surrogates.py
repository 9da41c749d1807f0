"""Elements in sampled time in the place of servo-cylinders and their controllers, learnt from the full model.

An element replaces a drive with its loop: a Maxwell element (D'Imperio 2016, section 5.2.5) or a polynomial NARX model.
Its input is the reference of the controller, or the command of a drive without one. It is fitted to what the full model
does on the records to learn from.

The force of a servo-cylinder whose spool follows at once and whose pressures are quasi-static depends on the command
and the velocity alone: a table replaces the drive alone (docs/hydraulics.md). The ends of the stroke are not in it.
"""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np

from vpm.catalogue import EFFECTS
from vpm.errors import VpmError
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.numbers import Array
from vpm.simplify.hydraulics import CLEARANCE, NO_STATE, hydraulic_drives, simpler
from vpm.simplify.learnt import maxwell_entry, narx_entry, trained
from vpm.simplify.reductions import Reduction
from vpm.simplify.replacement import TABLE, Replacement
from vpm.simulate import Run, simulate

Record = dict[str, Array]

#: Nodes along commands and velocities; odd, so that zero is one of them.
NODES = (41, 25)
#: How much closer nodes are in the middle than at the ends: the exponent of a hyperbolic sine.
CROWDED = 4.0
#: A table reaches this much farther than the fastest motion that it is learnt for.
SPARE = 1.5
#: Clearances that are tried for a valve without one, in parts of its stroke.
CLEARANCES = (0.0025, 0.005, 0.01, 0.02, 0.05)
#: Mass (kg) and step (s) of the rig on which the drive is read: nothing moves while it is.
MASS, STEP = 1e9, 1e-9
#: What a supply can have besides its pressure and its oil.
SAGGING = ("source", "resistance", "capacitance")


def surrogates(
    model: Model, records: Sequence[Experiment], mode: str, rate: float, channels: Sequence[str] | None = None
) -> tuple[Reduction, ...]:
    """Elements and a table for each servo-cylinder that they can be found for.

    - ``mode``: sampled drives run in free runs and closed loops only
    - ``rate``: samples of the element in a second, Hz
    - ``channels``: what is to come out right; by default all that the records hold
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


def tables(
    model: Model, taught: Sequence[Mapping[str, Array]], runs: Callable[[Model], Sequence[Run]]
) -> Iterator[Replacement]:
    """A table for each servo-cylinder that one can be read of.

    Where its valve has no clearance, that one is taken with which the quasi-static drive moves most like the full one.

    - ``taught``: each of shape (N,), what it does on the records to learn from
    - ``runs``: what another model does on these
    """
    for drive in hydraulic_drives(model):
        channel = model.rate_channel(drive)
        fastest = SPARE * max(float(np.max(np.abs(each[channel]))) for each in taught)
        value = {key: model.parameters[f"{drive}.valve.{key}"].value for key in ("stroke", "gain")}
        if not fastest > 0.0 or value["gain"] == 0.0:
            continue
        commands, velocities = (
            _axis(reach, count)
            for reach, count in zip((value["stroke"] / abs(value["gain"]), fastest), NODES, strict=True)
        )
        try:
            likest = _with_clearance(model, drive, channel, taught, runs)
            if likest is None:
                continue
            efforts = force_map(likest, drive, commands, velocities)
        except VpmError:
            continue
        unit = model.to_dict()["actuators"][drive].get("command_unit", "A")
        axes = {"commands": commands.tolist(), "velocities": velocities.tolist(), "efforts": efforts.tolist()}
        yield Replacement("drive", TABLE, drive, json.dumps({"type": TABLE, "command_unit": unit, **axes}))


def _with_clearance(
    model: Model,
    drive: str,
    channel: str,
    taught: Sequence[Mapping[str, Array]],
    runs: Callable[[Model], Sequence[Run]],
) -> Model | None:
    """Quasi-static model for a table, with the clearance that suits best; None without a simulation."""
    content = model.to_dict()
    content["effects"] = [e for e in content.get("effects", ()) if not (e["at"] == drive and _is_of_spool(e["type"]))]
    reduced = simpler(type(model)(content), drive, NO_STATE)
    name = f"{drive}.valve.clearance"
    given = f"{drive}.valve.clearance" in model.parameters
    sizes = [1.0] if given else [share / CLEARANCE for share in CLEARANCES]
    best, least = None, np.inf
    for size in sizes:
        candidate = reduced.with_parameters({name: size * reduced.parameters[name].value})
        try:
            pairs = zip(runs(candidate), taught, strict=True)
            gap = float(np.sqrt(sum(np.sum(np.square(run[channel] - each[channel])) for run, each in pairs)))
        except VpmError:
            continue
        if gap < least:
            best, least = candidate, gap
    return best


def _axis(reach: float, count: int) -> Array:
    axis: Array = reach * np.sinh(CROWDED * np.linspace(-1.0, 1.0, count)) / np.sinh(CROWDED)
    return axis


def force_map(model: Model, drive: str, commands: Array, velocities: Array) -> Array:
    """Force table of a servo-cylinder with a static spool and quasi-static pressures at mid-stroke.

    ``commands``: shape (n,), SI; ``velocities``: shape (m,), m/s.
    Result: shape (n, m), N, the friction of the seals in it.
    """
    rig = _rig(model, drive)
    grid = np.array([(u, v) for u in commands for v in velocities])
    states = np.column_stack([np.zeros(len(grid)), grid[:, 1]])
    inputs = np.repeat(grid[:, :1], 2, axis=0)
    starts = 2 * np.arange(len(grid))
    outputs, _ = rig.core.restart(rig.theta, states, starts, 2, inputs, STEP, 1, "semi_implicit", [])
    forces = outputs[:, 0, rig.output_channels.index(f"{drive}.force")]
    efforts: Array = np.reshape(forces, (len(commands), len(velocities)))
    return efforts


def _is_of_spool(effect: str) -> bool:
    """Whether an effect slows the spool, which a table cannot have."""
    return EFFECTS[effect].late == "spool"


def _is_of_oil(effect: str) -> bool:
    """Whether an effect is one of a cylinder's oil, which a table contains."""
    return EFFECTS[effect].site == "cylinder" and not _is_of_spool(effect)


def _rig(model: Model, drive: str) -> Model:
    """Rig for a table: the drive alone, pushing a mass that nothing moves, its piston at mid-stroke."""
    content = simpler(model, drive, NO_STATE).to_dict()
    entry = {key: value for key, value in content["actuators"][drive].items() if key not in ("line", "joint")}
    stroke = model.parameters[f"{drive}.cylinder.stroke"].value
    supply = {key: value for key, value in content["supplies"][entry["supply"]].items() if key not in SAGGING}
    return type(model)(
        {
            "name": f"{drive} alone",
            "gravity": [0.0, 0.0, 0.0],
            "bodies": {"slide": {"mass": MASS}},
            "joints": {"axis": {"type": "prismatic", "parent": "world", "child": "slide", "axis": [1.0, 0.0, 0.0]}},
            "supplies": {entry["supply"]: supply},
            "actuators": {drive: {**entry, "joint": "axis", "retracted_length": -0.5 * stroke}},
            "effects": [e for e in content.get("effects", ()) if e["at"] == drive and _is_of_oil(e["type"])],
        }
    )
