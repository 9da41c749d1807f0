"""What the runs of a scenario gave, side by side."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from vpm.errors import ScenarioError, near_match
from vpm.experiment import Experiment
from vpm.numbers import Array
from vpm.results import Result, html_table
from vpm.simulate import Run

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Extremes(NamedTuple):
    """A channel of a run in three numbers, in its unit."""

    channel: str
    unit: str
    least: float
    largest: float
    final: float


@dataclass(frozen=True, repr=False, eq=False)
class ScenarioRun(Result):
    """What the runs of a scenario gave.

    Attributes
    ----------
    name : str
        Of the scenario.
    time : ndarray, shape (N,)
        Time base of all runs, s.
    runs : dict of str to Run
        By name; one that diverged reaches up to its last finite sample.
    inputs : dict of str to Experiment
        What drove each run.
    failures : dict of str to str
        What went wrong, by the name of the run; empty as a rule.
    panels : tuple of tuple of str
        Channels of each panel of the picture.
    columns : dict of str to tuple of str
        Names of the runs of each column of the picture, by its heading; empty where all runs share one.
    """

    _samples = ("time", "inputs")

    name: str
    time: Array
    runs: dict[str, Run]
    inputs: dict[str, Experiment]
    failures: dict[str, str]
    panels: tuple[tuple[str, ...], ...]
    columns: dict[str, tuple[str, ...]] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Run:
        """Outcome of a scenario's run by its name."""
        if name not in self.runs:
            reason = self.failures.get(name, near_match(name, self.runs, what="it has"))
            raise ScenarioError(f'{self.name} has no run "{name}": {reason}', where=name)
        return self.runs[name]

    def traces(self, channel: str) -> Mapping[str, tuple[Array, Array]]:
        """Time (s) and values (SI) of a channel in each run of the outcome that has it."""
        found = {}
        for name, run in self.runs.items():
            if channel in run.channels:
                found[name] = (run.time, run[channel])
            elif channel in self.inputs[name]:
                found[name] = (run.time, self.inputs[name][channel][: run.time.size])
        return found

    def unit(self, channel: str) -> str:
        """SI unit of a channel in the outcome."""
        for name, run in self.runs.items():
            if channel in run.channels:
                return run.units[run.channels.index(channel)]
            if channel in self.inputs[name]:
                return self.inputs[name].unit(channel)
        known = {known for run in self.runs.values() for known in run.channels}
        raise ScenarioError(f'{self.name} has no channel "{channel}"; {near_match(channel, known)}', where=channel)

    def experiment(self, name: str) -> Experiment:
        """Outcome of a run as a log: inputs and outputs, for `vpm.identify` and others.

        Parameters
        ----------
        name : str
            Of the run.
        """
        run, inputs = self[name], self.inputs[name]
        driven = [channel for channel in inputs.channels if channel not in run.channels]
        columns = [*run.values.T, *(inputs[channel][: run.time.size] for channel in driven)]
        units = (*run.units, *(inputs.unit(channel) for channel in driven))
        history = (f'Simulated: run "{name}" of the scenario "{self.name}".', *run.notes)
        label = f"{self.name}, {name}"
        return Experiment(label, run.time, np.column_stack(columns), (*run.channels, *driven), units, history)

    def extremes(self, name: str) -> tuple[Extremes, ...]:
        """Outcome of each channel of the picture in a run: smallest, largest and final value."""
        rows = []
        for channel in dict.fromkeys(channel for panel in self.panels for channel in panel):
            _, values = self.traces(channel).get(name, (None, np.empty(0)))
            if values.size:
                numbers = (float(values.min()), float(values.max()), float(values[-1]))
                rows.append(Extremes(channel, self.unit(channel), *numbers))
        return tuple(rows)

    @property
    def told(self) -> tuple[str, ...]:
        """Outcome's failures as sentences that name the run."""
        return tuple(f'run "{name}": {reason}' for name, reason in self.failures.items())

    def plot(self) -> Figure:
        """Plot the outcome of all runs over time, a panel for each list of channels. Needs the extra ``plot``."""
        from vpm.plot import plot_scenario

        return plot_scenario(self)

    def __str__(self) -> str:
        return "\n".join(self._lines())

    def _lines(self) -> Iterator[str]:
        yield f"{self.name}: {len(self.inputs) - len(self.failures)} of {len(self.inputs)} runs, {self.time[-1]:g} s"
        for name in self.inputs:
            yield f"{name}:"
            if name in self.runs:
                yield f"  {'channel':32s} {'min':>12s} {'max':>12s} {'final':>12s}"
                for row in self.extremes(name):
                    numbers = " ".join(f"{number:12.5g}" for number in row[2:])
                    yield f"  {row.channel:32s} {numbers} {row.unit if row.unit != '1' else ''}".rstrip()
                yield from (f"  note: {note}" for note in self.runs[name].messages)
            if name in self.failures:
                yield f"  failed: {self.failures[name]}"

    def _headline(self) -> Mapping[str, object]:
        shown: dict[str, object] = {"name": self.name, "runs": tuple(self.runs), "samples": self.time.size}
        return {**shown, "failed": tuple(self.failures)} if self.failures else shown

    def _repr_html_(self) -> str:
        rows: list[tuple[object, ...]] = [(name, *row) for name in self.runs for row in self.extremes(name)]
        rows += [(name, note, "", "", "", "") for name in self.runs for note in self.runs[name].messages]
        rows += [(name, f"failed: {reason}", "", "", "", "") for name, reason in self.failures.items()]
        return html_table(self.name, ("run", "channel", "unit", "min", "max", "final"), rows)

    def _frame_columns(self) -> Mapping[str, object]:
        """Outcome as one row per run and sample; NaN where a run does not have a channel."""
        runs = self.runs.values()
        columns: dict[str, object] = {
            "run": [name for name, run in self.runs.items() for _ in run.time],
            "time": np.concatenate([np.empty(0), *(run.time for run in runs)]),
        }
        for channel in dict.fromkeys(channel for run in runs for channel in run.channels):
            parts = [run[channel] if channel in run.channels else np.full(run.time.size, np.nan) for run in runs]
            columns[channel] = np.concatenate(parts)
        return columns


class ScenarioInterruptedError(KeyboardInterrupt):
    """Ctrl-C while the runs of a scenario went on.

    Attributes
    ----------
    result : ScenarioRun
        The runs that were finished; all others stand in its ``failures``.
    """

    def __init__(self, result: ScenarioRun) -> None:
        super().__init__("interrupted")
        self.result = result
