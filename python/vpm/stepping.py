"""A simulation that somebody else drives, one sample at a time: for controllers, for filters, for games."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from vpm.errors import DivergedError, SimulationError, near_match, refused_as
from vpm.model import Model
from vpm.numbers import Array, array_of
from vpm.simulate import AUTOMATIC, Resolution, Run, Setup, judged
from vpm.simulate.resolution import outermost, resolution

if TYPE_CHECKING:
    from vpm._core import Simulation as Core
    from vpm._core import Snapshot


#: What drives a simulation: it sees the simulation and gives one command per actuator.
Controller = Callable[["Simulation"], ArrayLike | Mapping[str, float]]


class Simulation:
    """A machine in simulated time.

    At time ``k time_step`` it is in ``state`` and shows ``outputs``. A step holds one command per actuator until the
    next sample and shows what the sensors see there, with that command still held. Positions and velocities are those
    of `vpm.simulate` on the same commands; delays of actuators and sensors count from the beginning. The model's own
    controllers rest.

    Parameters
    ----------
    time_step : float
        Time between samples, s.
    integrator, substeps
        See :class:`vpm.simulate.Setup`.
    state : mapping of str to float, or array_like of shape (nx,), optional
        As ``model.state`` takes it, for example ``{"axis.position": 0.1}``; what is not named is zero.
    compiled : bool
        Make machine code of the model now, up to some tenths of a second for links with many coordinates, and step by
        it: worth while from some ten thousand steps on. The code is kept with the model. A machine that has none is
        evaluated directly; `not_compiled` then says why.

    Raises
    ------
    SimulationError, ModelError
        A setting, a name or a size is wrong.

    Examples
    --------
    >>> sim = Simulation(model, 1e-3, state={"axis.position": 0.1})
    >>> while sim.time < 2.0:
    ...     sim.step(-80.0 * sim["axis.position"] - 9.0 * sim["axis.velocity"])
    """

    def __init__(
        self,
        model: Model,
        time_step: float,
        *,
        integrator: str = AUTOMATIC,
        substeps: int = 1,
        state: Mapping[str, float] | ArrayLike | None = None,
        compiled: bool = False,
    ) -> None:
        from vpm._core import Simulation as Core

        setup = Setup(integrator, substeps)
        setup = replace(setup, integrator=setup.method(model))
        self._model, self._time_step, self._setup = model, float(time_step), setup
        self._start = model.state(state)
        with refused_as(SimulationError):
            self._core = Core(model.core, model.theta, self._start, float(time_step), substeps, setup.integrator)
        self._not_compiled = self._core.compile() if compiled else None
        self._outputs = self._core.outputs
        # States that a run passed, for links whose kinematics hold up to a slope only; empty where there are none.
        self._passed: list[Array] = []
        self._limited = self._has_limited_links()

    # ---- what it is --------------------------------------------------------------------------------------------------

    @property
    def model(self) -> Model:
        """Machine of the stepping simulation."""
        return self._model

    @property
    def time_step(self) -> float:
        """Time between samples of a stepping simulation, s."""
        return self._time_step

    @property
    def not_compiled(self) -> str | None:
        """Why a stepping simulation has no machine code; ``None`` if it has or none was asked for."""
        return self._not_compiled

    @property
    def inputs(self) -> tuple[str, ...]:
        """Input names of a stepping simulation: commands of actuators, then logged supply pressures."""
        return self._model.inputs

    @cached_property
    def channels(self) -> tuple[str, ...]:
        """Output names of a stepping simulation."""
        return self._model.output_channels

    @cached_property
    def units(self) -> tuple[str, ...]:
        """SI units of a stepping simulation's outputs."""
        return tuple(self._model.channel_unit(name) for name in self.channels)

    @cached_property
    def _columns(self) -> dict[str, int]:
        return {name: column for column, name in enumerate(self.channels)}

    @property
    def resolution(self) -> Resolution:
        """What the stepping simulation does not resolve about its state, over one second.

        `Run.resolution` says it of a run, over its own time.
        """
        commands = self._outputs[None, self._commanded]
        return resolution(self._model, self.state[None, :], commands, self._time_step, self._setup, 1.0)

    @property
    def core(self) -> Core:
        """Core of a stepping simulation, for those who step many in one call."""
        return self._core

    # ---- where it is -------------------------------------------------------------------------------------------------

    @property
    def time(self) -> float:
        """Time of a stepping simulation since the beginning, s."""
        return self._core.time

    @property
    def state(self) -> Array:
        """State of a stepping simulation, shape (nx,), named by ``model.state_names``; a copy."""
        return self._core.state

    @property
    def outputs(self) -> Array:
        """Sensor outputs of a stepping simulation, shape (ny,), in the order of `channels`."""
        return self._outputs

    def __getitem__(self, channel: str) -> float:
        """Sensor output of one channel of a stepping simulation."""
        try:
            return float(self._outputs[self._columns[channel]])
        except KeyError:
            repair = near_match(channel, self.channels, what="it has")
            raise SimulationError(f"the simulation has no channel '{channel}'; {repair}") from None

    # ---- how it goes on ----------------------------------------------------------------------------------------------

    def step(self, inputs: ArrayLike | Mapping[str, float] = ()) -> Array:
        """Step the simulation: hold commands for one sample.

        Parameters
        ----------
        inputs : array_like, shape (nu,), or mapping of str to float
            One command per actuator, in command units, then the pressure of each logged supply; a number where there
            is one input. In a mapping, a command that is not named is zero, a pressure that of the model.

        Returns
        -------
        ndarray, shape (ny,)
            What the sensors show at the end of the sample.

        Raises
        ------
        SimulationError
            The number of commands is wrong or one is not finite.
        DivergedError
            A state left its bounds; all stays at the sample before, and only `reset` or `restore` leads on.
        """
        from vpm._core import Diverged

        command = self._command(inputs)
        try:
            self._outputs = self._core.step(command)
        except Diverged as error:
            raise DivergedError(str(error), time=error.sample_index * self._time_step) from None
        except ValueError as error:
            raise SimulationError(str(error)) from None
        return self._outputs

    def run(self, inputs: ArrayLike | Controller, duration: float | None = None) -> Run:
        """Step many times: through a table of commands, or with a controller asked before every step.

        Parameters
        ----------
        inputs : array_like, shape (N, nu), or callable
            Commands, row by row; or a function that takes this simulation and gives the commands of the next step.
        duration : float, optional
            How long a controller is at work, s; it is rounded to whole samples.

        Returns
        -------
        Run
            Row k is what the sensors show after step k; nothing is measured.

        Raises
        ------
        SimulationError
            A size or a number is wrong.
        DivergedError
            A state left its bounds.

        Warns
        -----
        ValidityWarning
            A flexible link in displacement coordinates bends more than its kinematics allow.
        """
        begin = self.time
        self._passed.clear()
        about = self.state
        rows = self._controlled(inputs, duration) if callable(inputs) else self._driven(inputs)
        steps = self._unresolved(about, rows) if len(rows) else None
        time = begin + self._time_step * np.arange(1.0, len(rows) + 1.0)
        run = Run(
            self._model.name,
            "simulation",
            "steps",
            np.asarray(time, dtype=np.float64),
            self.channels,
            self.units,
            rows,
            np.full(rows.shape, np.nan),
            settings={"integrator": self._setup.integrator, "substeps": self._setup.substeps},
            resolution=steps,
        )
        if not self._passed:
            return run
        states = np.array(self._passed)
        run = replace(run, coordinates=states[:, : len(self._model.coordinates)])
        return judged(self._model, run, states)

    def reset(self, state: Mapping[str, float] | ArrayLike | None = None) -> None:
        """Reset the stepping simulation to time zero, with nothing remembered.

        Parameters
        ----------
        state : mapping of str to float, or array_like of shape (nx,), optional
            By default the one that the simulation was made with.
        """
        start = self._start if state is None else self._model.state(state)
        with refused_as(SimulationError):
            self._core.reset(start)
        self._outputs = self._core.outputs

    def snapshot(self) -> Snapshot:
        """Snapshot of a stepping simulation with what delays and sampled actuators remember.

        Returns
        -------
        Snapshot
            For `restore`, as often as wanted; it does not change as the simulation goes on.
        """
        return self._core.snapshot()

    def restore(self, snapshot: Snapshot) -> None:
        """Restore a stepping simulation from a snapshot: what follows is the same to the last bit.

        Parameters
        ----------
        snapshot : Snapshot
            Of this simulation, or of one of the same model object with the same steps.

        Raises
        ------
        SimulationError
            The snapshot is of another model or of other steps.
        """
        with refused_as(SimulationError):
            self._core.restore(snapshot)
        self._outputs = self._core.outputs

    def _command(self, inputs: ArrayLike | Mapping[str, float]) -> ArrayLike:
        if isinstance(inputs, np.ndarray) and inputs.ndim == 1:
            return inputs
        return (
            self._model.command(inputs)
            if isinstance(inputs, Mapping)
            else np.atleast_1d(array_of(inputs, "the command", SimulationError))
        )

    def _driven(self, inputs: ArrayLike) -> Array:
        from vpm._core import Diverged

        table = np.ascontiguousarray(array_of(inputs, "the commands", SimulationError))
        if table.ndim == 1 and len(self.inputs) == 1:
            table = table[:, None]
        columns = len(self.inputs)
        if table.ndim != 2 or table.shape[1] != columns:
            raise SimulationError(
                f"the commands have shape {table.shape}, but {columns} inputs need (N, {columns}); "
                "give one row per step"
            )
        if self._limited:
            return np.array([self._kept(self.step(command)) for command in table]).reshape(-1, len(self.channels))
        try:
            rows = self._core.run(table)
        except Diverged as error:
            raise DivergedError(str(error), time=error.sample_index * self._time_step) from None
        except ValueError as error:
            raise SimulationError(str(error)) from None
        self._outputs = self._core.outputs
        return rows

    def _controlled(self, controller: Controller, duration: float | None) -> Array:
        if duration is None or not duration > 0.0:
            raise SimulationError(
                f"a controller needs a duration, got {duration}; say for how many seconds it is at work"
            )
        count = max(1, round(duration / self._time_step))
        rows = np.empty((count, len(self.channels)))
        for row in rows:
            row[:] = self._kept(self.step(controller(self)))
        return rows

    def _kept(self, outputs: Array) -> Array:
        if self._limited:
            self._passed.append(self.state)
        return outputs

    @cached_property
    def _commanded(self) -> list[int]:
        """Output columns of a stepping simulation that show what is held."""
        return [self._columns[name] for name in self._model.input_channels]

    def _unresolved(self, about: Array, rows: Array) -> Resolution:
        """What a stepping run that began in the state ``about`` did not resolve.

        Of the states that followed, its rows show some; the others are taken for those of the beginning.
        """
        shown = [place for place, name in enumerate(self._model.state_names) if name in self._columns]
        columns = [self._columns[self._model.state_names[place]] for place in shown]
        found = outermost(rows[:, columns + self._commanded])
        states = np.tile(about, (len(found) + 1, 1))
        states[1:, shown] = rows[np.ix_(found, columns)]
        commands = rows[np.ix_([0, *found], self._commanded)]
        duration = len(rows) * self._time_step
        return resolution(self._model, states, commands, self._time_step, self._setup, duration)

    def _has_limited_links(self) -> bool:
        if not self._model.core.n_elastic:
            return False
        slopes = self._model.core.slopes(self._model.theta, self._start[None, :])
        return not bool(np.isnan(slopes).all())

    def __repr__(self) -> str:
        return f"Simulation({self._model.name!r}, time={self.time:.6g} s, time_step={self._time_step:g} s)"
