"""The optimum: the motion, how exact it is, and as a log."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vpm.errors import OptimisationError, check_known
from vpm.experiment import Experiment
from vpm.numbers import Array
from vpm.results import Result

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from vpm.model import Model
    from vpm.simulate import Run


@dataclass(frozen=True, repr=False, eq=False)
class Optimum(Result):
    """A motion that makes a task's goal least.

    Attributes
    ----------
    name, model_name : str
        Of the task and of the model.
    status : {"optimal", "interrupted"}
        ``interrupted`` is the last iterate of a search that Ctrl-C ended: it need not keep all limits.
    objective : float
        What was made least, SI.
    durations : dict of str to float
        Of each phase, s.
    time : ndarray, shape (N,)
        Of the log, s; the machine moves from zero on, and stands before if it begins at rest.
    data : ndarray, shape (N, C)
        All outputs of the model; commands are those held until the next sample.
    initial_state : ndarray, shape (nx,)
    mesh_time : ndarray, shape (Q,)
        Times of the collocation points, s.
    mesh_states : ndarray, shape (Q, nx)
    node_time : ndarray, shape (K,)
        Times of the nodes between which commands run straight; twice where two phases meet.
    node_commands : ndarray, shape (K, nu)
    states, commands : tuple of str
        Names of the columns.
    error : float
        Largest error of an interval, in sizes of the states: what the polynomials miss of the equations between points.
    binding : tuple of str
        Limits that hold the motion back.
    played : dict of str to float
        How far a simulation of the log by vpm strays, as a share of each channel's range: joints, markers and gauges.
    played_in_full : dict of str to float
        The same on the model of the file, where the search took another level of detail; else empty.
    """

    _samples = ("time", "data", "mesh_time", "mesh_states", "node_time", "node_commands")

    name: str
    model_name: str
    status: str
    objective: float
    durations: dict[str, float]
    time: Array
    data: Array
    channels: tuple[str, ...]
    units: tuple[str, ...]
    initial_state: Array
    mesh_time: Array
    mesh_states: Array
    node_time: Array
    node_commands: Array
    states: tuple[str, ...]
    commands: tuple[str, ...]
    error: float
    intervals: int
    rounds: int
    iterations: int
    binding: tuple[str, ...]
    played: dict[str, float]
    played_in_full: dict[str, float]
    notes: tuple[str, ...]

    @property
    def duration(self) -> float:
        """Duration of the optimal motion, s."""
        return sum(self.durations.values())

    @property
    def strayed(self) -> float:
        """Largest error of an optimum when `played`."""
        return max(self.played.values(), default=float("nan"))

    def __getitem__(self, channel: str) -> Array:
        """Samples of a channel in the optimum's log, shape (N,)."""
        check_known([channel], self.channels, OptimisationError, f"{self.name} has no channel")
        return self.data[:, self.channels.index(channel)]

    def experiment(self) -> Experiment:
        """Optimum as a log, whose commands `vpm.simulate` takes."""
        history = (f"Optimum of {self.name}: {self.status}, {self.duration:.6g} s.", *self.binding, *self.notes)
        return Experiment(self.name, self.time, self.data, self.channels, self.units, history)

    def play(self, model: Model) -> Run:
        """Play the optimum: simulate its commands on a model, from its first state.

        Parameters
        ----------
        model : Model
            The one that was optimised, or another with the same commands; then its own rest at the first positions.
        """
        from vpm.simulate import simulate

        own = tuple(model.state_names) == self.states
        return simulate(model, self.experiment(), "free_run", initial_state=self.initial_state if own else None)

    def to_csv(self, path: str | PathLike[str]) -> Path:
        """Write the optimum's log, which `vpm simulate MODEL LOG` plays."""
        return self.experiment().to_csv(path)

    def plot(self) -> Figure:
        """Plot an optimum: commands, and all channels that move. Needs the extra ``plot``."""
        from vpm.plot import plot_channels

        shown = [at for at, channel in enumerate(self.channels) if self._is_shown(channel)]
        names, units = ([part[at] for at in shown] for part in (self.channels, self.units))
        return plot_channels(self.time, self.data[:, shown], names, units, title=self.name)

    def _is_shown(self, channel: str) -> bool:
        values = self[channel]
        moves = float(np.ptp(values)) > 1e-9 * max(1e-9, float(np.abs(values).max()))
        return moves and not channel.endswith((".acceleration", ".effort", ".force", ".fx", ".fy", ".fz"))

    def __str__(self) -> str:
        parts = ", ".join(f"{name} {1e3 * value:.5g} ms" for name, value in self.durations.items())
        return "\n".join([
            f"{self.name}: {self.status}, goal {self.objective:.6g}, {parts}",
            f"  {self.intervals} intervals, {self.rounds} meshes, {self.iterations} iterations; between points the "
            f"equations are missed by {self.error:.1e} of the states' sizes",
            *self._strayed("", self.played),
            *self._strayed(" at the level of the model file", self.played_in_full),
            *(f"  {text}" for text in self.binding),
            *(f"  note: {text}" for text in self.notes),
        ])  # fmt: skip

    def _strayed(self, where: str, played: dict[str, float]) -> list[str]:
        if not played:
            return []
        worst, step = max(played, key=lambda name: played[name]), 1e3 * float(self.time[1] - self.time[0])
        words = f"played by vpm{where} in samples of {step:.4g} ms"
        return [f"  {words}, {worst} strays most, by {played[worst]:.1e} of its range"]

    def _headline(self) -> Mapping[str, object]:
        shown = ("name", "status", "objective", "intervals", "error")
        return {**{name: getattr(self, name) for name in shown}, "duration": self.duration, "strayed": self.strayed}

    def _frame_columns(self) -> Mapping[str, object]:
        return {"time_s": self.time, **dict(zip(self.channels, self.data.T, strict=True))}
