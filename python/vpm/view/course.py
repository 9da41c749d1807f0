"""The motion that is shown: of a run, of a log, or of a single pose."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from vpm.errors import ExperimentError, SimulationError, near_match
from vpm.experiment import Experiment, joints_from_sensors
from vpm.model import Model
from vpm.numbers import Array
from vpm.simulate import Run, simulate

if TYPE_CHECKING:
    from vpm.scenario import ScenarioRun


#: Channels whose numbers are drawn as arrows.
LOADS = (".fx", ".fy", ".fz", ".tension", ".effort")


@dataclass(frozen=True, eq=False)
class Course:
    """Coordinates of a machine over time."""

    subtitle: str  #: What moves it.
    time: Array  #: Shape (N,); s.
    coordinates: Array  #: Shape (N, n); of joints and flexible links.
    measured: Array | None = None  #: Shape (N, n); the same with the joints where they were measured.
    loads: Mapping[str, Array] = field(default_factory=dict)  #: Each of shape (N,); forces and efforts by channel (SI).
    notes: tuple[str, ...] = ()  #: What to know before the picture is trusted.


def course_of(model: Model, source: Run | ScenarioRun | Experiment | None, mode: str | None = None) -> Course:
    """Course of a run, or of a log after a simulation; without either the machine at zero.

    - ``source``: of a scenario the first run whose model it is
    - ``mode``: how a log is simulated: by default ``free_run`` on its commands, ``closed_loop`` on references, or
      ``prescribed_motion`` with neither

    Raises `SimulationError`: the run is of another model, or does not tell where its joints are.
    Raises `ExperimentError`: the log does not.
    """
    if source is None:
        return Course("at rest with all joints at zero", np.zeros(1), resting(model, np.zeros(len(model.joints))))
    if isinstance(source, Experiment):
        return _of_log(model, source, mode)
    if mode is not None:
        raise SimulationError(f"a run has been simulated already, so the mode {mode} says nothing; leave it out")
    return _of_run(model, source if isinstance(source, Run) else _of_scenario(model, source))


def resting(model: Model, joints: Array) -> Array:
    """Course of rest: coordinates (1, n) with the joints held, flexible links hanging."""
    return np.asarray(model.equilibrium(joints)[0] if len(model.coordinates) > joints.size else joints)[None]


def _of_scenario(model: Model, source: ScenarioRun) -> Run:
    for run in source.runs.values():
        if run.model_name == model.name and _fits(model, run):
            return run
    names = ", ".join(sorted({run.model_name for run in source.runs.values()})) or "none"
    raise SimulationError(
        f"the scenario {source.name} has no run of {model.name}, but of: {names}; name its model file"
    )


def _fits(model: Model, run: Run) -> bool:
    whole = (run.time.size, len(run.channels))
    same = run.coordinates is None or run.coordinates.shape == (run.time.size, len(model.coordinates))
    return same and whole == run.values.shape == run.measured.shape and set(run.channels) <= set(model.channels)


def _of_run(model: Model, run: Run) -> Course:
    if run.model_name != model.name or not _fits(model, run):
        raise SimulationError(
            f"the run is of the model {run.model_name} with {len(run.channels)} channels, which is not {model.name} as "
            "its file describes it; name the model file of the run"
        )
    if run.time.size == 0:
        raise SimulationError("the run has no samples, so nothing moves; simulate it anew")
    notes = list(run.notes)
    coordinates = _coordinates(model, run)
    measured = _measured(model, run, coordinates, notes)
    loads = {name: run[name] for name in run.channels if name.endswith(LOADS)}
    shown = np.flatnonzero(np.all(np.isfinite(coordinates), axis=1) & np.isfinite(run.time))
    if shown.size == 0:
        raise SimulationError("no sample of the run has finite positions, so nothing can be shown; simulate it anew")
    if shown.size < run.time.size:
        notes.append(f"{run.time.size - shown.size} samples without finite positions are left out.")
    return replace(
        Course(f"{run.experiment_name}, {run.mode.replace('_', ' ')}", run.time[shown], coordinates[shown]),
        measured=None if measured is None else measured[shown],
        loads={name: np.nan_to_num(values[shown]) for name, values in loads.items()},
        notes=tuple(notes),
    )


def _coordinates(model: Model, run: Run) -> Array:
    """Coordinates of a run's course; from its channels where no run goes through."""
    if run.coordinates is not None:
        return run.coordinates
    missing = [name for name in model.joints if f"{name}.position" not in run.channels]
    if missing or len(model.coordinates) > len(model.joints):
        what = f"the position of {missing[0]}" if missing else "the shapes of its flexible links"
        raise SimulationError(
            f"the run in mode {run.mode} does not hold {what}; view the log with its model file, or a run in the mode "
            "free_run"
        )
    return np.column_stack([run[f"{name}.position"] for name in model.joints])


def _measured(model: Model, run: Run, coordinates: Array, notes: list[str]) -> Array | None:
    """Measured course of the joints, as the log says; the rest as simulated."""
    if run.mode == "prescribed_motion":
        notes.append("The joints move as they were measured; only what they carry is simulated.")
        return None
    joints = (name for name in model.joints if f"{name}.position" in run.channels)
    columns = {name: run.channels.index(f"{name}.position") for name in joints}
    found = {name: run.measured[:, column] for name, column in columns.items()}
    seen = [name for name, values in found.items() if np.all(np.isfinite(values))]
    if not seen:
        return None
    measured = coordinates.copy()
    for name in seen:
        measured[:, model.joints.index(name)] = found[name]
    notes += _told(model, seen)
    return measured


def _told(model: Model, seen: list[str]) -> Iterator[str]:
    rest = [name for name in model.joints if name not in seen]
    if rest:
        yield f"Not measured, and drawn as simulated in the measured machine too: {', '.join(rest)}."
    if model.beams:
        yield "Flexible links of the measured machine are bent as in the simulation: the log tells its joints alone."


def _of_log(model: Model, log: Experiment, mode: str | None) -> Course:
    told_by = {"command": "free_run", "reference": "closed_loop"}
    driven = [mode for kind, mode in told_by.items() if any(f"{name}.{kind}" in log for name in model.actuators)]
    told = joints_from_sensors(log, model)
    there = [name for name in model.joints if f"{name}.position" in told]
    if not there and not driven:
        wanted = ", ".join(f"{name}.position" for name in model.joints)
        repair = (
            near_match(f"{model.joints[0]}.position", log.channels, what="its channels are") if model.joints else ""
        )
        raise ExperimentError(f"{log.name} has neither joint positions ({wanted}) nor commands to show; {repair}")
    course = _of_run(model, simulate(model, log, mode or (*driven, "prescribed_motion")[0]))
    if not there:
        return replace(
            course, notes=(*course.notes, f"{log.name} has no joint positions: nothing is measured to show.")
        )
    return course
