"""A test without a log: which machines, from which state, driven by what, for how long."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, partial
from os import PathLike
from pathlib import Path
from types import MappingProxyType
from typing import Self

import numpy as np
from pydantic import ValidationError

from vpm.batch import side_by_side
from vpm.errors import DivergedError, ScenarioError, SimulationError, VpmError, near_match
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.model.messages import raise_first
from vpm.model.reading import parse_toml, read_toml
from vpm.numbers import Array
from vpm.results import html_table
from vpm.scenario.clock import check_numbers, clock_of
from vpm.scenario.form import schema_problems
from vpm.scenario.inputs import given_inputs
from vpm.scenario.machine import machines
from vpm.scenario.messages import in_file, refuse
from vpm.scenario.outcome import ScenarioInterruptedError, ScenarioRun
from vpm.scenario.panels import checked_columns, checked_panels
from vpm.scenario.schema import Document
from vpm.scenario.start import held_inputs, start_state
from vpm.simulate import Run, Setup, simulate
from vpm.tasks import BatchInterruptedError


class Scenario:
    """A test without a log, read from a file and checked against the models of its runs; it does not change.

    Build it with `load`, `from_toml` or `from_dict`.

    Examples
    --------
    >>> scenario = Scenario.load("examples/emps/step.toml")
    >>> result = scenario.run()
    >>> figure = result.plot()
    """

    _document: Document
    _path: str | None

    def __init__(
        self, content: Mapping[str, object], *, folder: str | PathLike[str] = ".", path: str | None = None
    ) -> None:
        with in_file(path):
            try:
                self._document = Document.model_validate(content)
            except ValidationError as error:
                raise_first(schema_problems(error), path, ScenarioError)
            self._path = path
            self._clock = clock_of(self._document)
            self._setup = _setup(self._document)
            self._models = machines(self._document.runs, Path(folder))
            check_numbers(self._clock, self._models.values())
            # All that can be wrong is found here, before the first run takes its time.
            self._starts = {name: self._start(f'run "{name}"', model) for name, model in self._models.items()}
            self._panels = checked_panels(self._document, self._models)
            self._columns = checked_columns(self._document, self._models)

    # ---- ways in -----------------------------------------------------------------------------------------------------

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Self:
        """Read a scenario file and the model files that it names.

        Parameters
        ----------
        path : path-like
            TOML file; the paths of model files lead from its folder.

        Raises
        ------
        ScenarioError
            The file is no scenario, or does not fit its models; one sentence with the place, the numbers, the repair.
        ModelError
            A file cannot be read or is no TOML, or a model file is wrong.
        """
        return cls(read_toml(path), folder=Path(path).parent, path=str(path))

    @classmethod
    def from_toml(cls, text: str, *, folder: str | PathLike[str] = ".") -> Self:
        """Read a scenario from the text of a file; the paths of model files lead from `folder`.

        Raises
        ------
        ScenarioError, ModelError
            As `load`.
        """
        return cls(parse_toml(text), folder=folder)

    @classmethod
    def from_dict(cls, content: Mapping[str, object], *, folder: str | PathLike[str] = ".") -> Self:
        """Build a scenario from content as a TOML parser gives it.

        Raises
        ------
        ScenarioError, ModelError
            As `load`.
        """
        return cls(content, folder=folder)

    # ---- what it says ------------------------------------------------------------------------------------------------

    @property
    def name(self) -> str:
        """Name of a scenario."""
        return self._document.scenario

    @property
    def path(self) -> str | None:
        """File that the scenario was read from."""
        return self._path

    @property
    def duration(self) -> float:
        """Time from the first to the last sample of the scenario, s."""
        return self._clock.duration

    @property
    def time_step(self) -> float:
        """Time between samples of a scenario, s."""
        return self._clock.time_step

    @property
    def setup(self) -> Setup:
        """Integrator and substeps of a scenario."""
        return self._setup

    @cached_property
    def models(self) -> Mapping[str, Model]:
        """Model of each run of the scenario, as changed by it, by the name of the run."""
        return MappingProxyType(dict(self._models))

    @property
    def panels(self) -> tuple[tuple[str, ...], ...]:
        """Channels of each panel of the scenario's picture."""
        return self._panels

    # ---- what it gives -----------------------------------------------------------------------------------------------

    def experiment(self, model: Model | str) -> Experiment:
        """What drives a machine in this scenario, as a record: for `vpm.simulate`, with `initial_state` and `mode`.

        Parameters
        ----------
        model : Model or str
            A machine, or the name of a run.

        Returns
        -------
        Experiment
            ``ACTUATOR.reference`` of actuators with a controller, ``ACTUATOR.command`` of the others, pressures of
            supplies that are given. Its history names references that hold the initial position, as none is given.

        Raises
        ------
        ScenarioError
            The scenario does not fit the machine.
        """
        owner, machine = self._named(model)
        with in_file(self._path):
            given = dict(given_inputs(self._document, owner, machine, self._clock))
        held = held_inputs(machine, self.initial_state(model), given)
        rest = np.zeros(self._clock.steps + 1)
        values = given | {channel: np.full(len(rest), level) for channel, (level, _) in held.items()}
        for actuator in machine.actuators:
            if actuator not in machine.controlled_actuators:
                values.setdefault(f"{actuator}.command", rest)
        units = tuple(machine.channel_unit(channel) for channel in values)
        data = np.column_stack([np.empty((len(rest), 0)), *values.values()])
        return Experiment(
            self.name, self._clock.time, data, tuple(values), units, tuple(sentence for _, sentence in held.values())
        )

    def initial_state(self, model: Model | str) -> Array:
        """State of a scenario's machine at time zero, shape (nx,), named by ``model.state_names``.

        Parameters
        ----------
        model : Model or str
            A machine, or the name of a run.

        Raises
        ------
        ScenarioError
            The scenario does not fit the machine.
        """
        if isinstance(model, str) and model in self._starts:
            return self._starts[model].copy()
        owner, machine = self._named(model)
        with in_file(self._path):
            return self._start(owner, machine)

    def mode(self, model: Model | str) -> str:
        """Mode of `vpm.simulate` for the scenario: ``closed_loop`` with controllers, else ``free_run``."""
        return "closed_loop" if self._named(model)[1].controlled_actuators else "free_run"

    def run(self, *, progress: Callable[[int, int], object] | bool = False, workers: int | None = None) -> ScenarioRun:
        """Simulate all runs of the scenario, side by side.

        Parameters
        ----------
        progress : callable or bool
            Called as ``progress(done, total)`` in the calling thread after each run; True draws a bar.
        workers : int, optional
            Runs at a time; by default one per core.

        Returns
        -------
        ScenarioRun
            A run that fails is named in its ``failures``; the others are there.

        Raises
        ------
        ScenarioInterruptedError
            Ctrl-C, a `KeyboardInterrupt` with the runs that were finished; all others stop.
        """
        inputs = {name: self.experiment(name) for name in self._models}
        jobs = [partial(self._one, name, inputs[name]) for name in self._models]
        try:
            return self._result(inputs, side_by_side(jobs, workers, progress))
        except BatchInterruptedError as stopped:
            raise ScenarioInterruptedError(self._result(inputs, stopped.outcomes)) from stopped

    def _result(self, inputs: dict[str, Experiment], outcomes: Sequence[Run | VpmError | None]) -> ScenarioRun:
        found = dict(zip(self._models, outcomes, strict=True))
        runs = dict(_finished(found, inputs))
        failures = {name: str(error) for name, error in found.items() if isinstance(error, VpmError)}
        failures |= {name: "it was interrupted" for name, outcome in found.items() if outcome is None}
        return ScenarioRun(self.name, self._clock.time, runs, inputs, failures, self._panels, dict(self._columns))

    def _one(self, name: str, inputs: Experiment) -> Run:
        return simulate(
            self._models[name],
            inputs,
            self.mode(name),
            integrator=self._setup.integrator,
            substeps=self._setup.substeps,
            initial_state=self._starts[name],
        )

    def _start(self, owner: str, model: Model) -> Array:
        return start_state(self._document, owner, model, given_inputs(self._document, owner, model, self._clock))

    def _named(self, model: Model | str) -> tuple[str, Model]:
        """Name of a scenario's machine in messages, and the machine."""
        if isinstance(model, Model):
            return f'"{model.name}"', model
        if model not in self._models:
            repair = near_match(model, self._models, what="it has")
            raise ScenarioError(f'{self.name} has no run "{model}"; {repair}', where=model, path=self._path)
        return f'run "{model}"', self._models[model]

    # ---- manners -----------------------------------------------------------------------------------------------------

    def __repr__(self) -> str:
        runs = f"{len(self._models)} run{'' if len(self._models) == 1 else 's'}"
        return f"Scenario({self.name!r}: {runs}, {self.duration:g} s in steps of {self.time_step:g} s)"

    def _repr_html_(self) -> str:
        rows: list[tuple[object, ...]] = [
            (entry.name, entry.model, ", ".join([*entry.set, *(f"{e.type} at {e.owner}" for e in entry.with_effects)]))
            for entry in self._document.runs
        ]
        return html_table(self.name, ("run", "model", "changes"), rows)


def _setup(document: Document) -> Setup:
    try:
        return Setup(document.integrator, document.substeps)
    except SimulationError as error:
        refuse(("integrator",), f"is wrong: {error}")


def _finished(
    found: Mapping[str, Run | VpmError | None], inputs: Mapping[str, Experiment]
) -> Iterator[tuple[str, Run]]:
    """Runs that came somewhere, with notes on references that the scenario does not give."""
    for name, outcome in found.items():
        run = outcome.run if isinstance(outcome, DivergedError) else outcome
        if isinstance(run, Run):
            yield name, replace(run, notes=(*inputs[name].history, *run.notes))
