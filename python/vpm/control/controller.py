"""A controller that knows that its machine bends: feed-forward, state feedback and an observer, sample by sample."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from vpm.control.closed_loops import check_loops
from vpm.control.feedback import StateFeedback, at_axes
from vpm.control.plan import FlexibleFeedforward
from vpm.errors import DivergedError, SimulationError, check_known
from vpm.model import Model
from vpm.numbers import Array
from vpm.observer import Noise, Observer
from vpm.simulate import AUTOMATIC, Setup

if TYPE_CHECKING:
    from vpm.stepping import Simulation


class FlexibleController:
    """Plays a feed-forward, and corrects it by what an observer makes of encoders and strain gauges.

    A sample's commands come from the state that was expected for it, so they are ready when the sample begins; its
    readings count from the next one on. After the motion the last reference stands.

    Parameters
    ----------
    model : Model
        Of the controller, without delays.
    feedback : StateFeedback, optional
        Without it commands are the feed-forward alone.
    noise : Noise, optional
        Of readings, and of forces that nobody knows of; a feedback needs it.
    channels : sequence of str, optional
        What is measured; by default positions of all joints and all strains.
    limits : mapping of str to float, optional
        Largest absolute commands; where one is reached errors are not summed on.
    integrator, substeps
        Of the observer, see :class:`vpm.simulate.Setup`: it has to resolve what the feedback acts on.

    Attributes
    ----------
    channels : tuple of str
        Order of the measurements.

    Raises
    ------
    SimulationError
        A name is wrong, parts are of different machines or time steps, a flexible machine has no gauge, or the steps
        of the observer are so far from the machine that the loop is unstable.

    Examples
    --------
    >>> controller = FlexibleController(arm, plan, feedback, noise)
    >>> run = vpm.Simulation(arm, 1e-3, state=plan.state[0]).run(controller, 2.0)
    """

    def __init__(
        self,
        model: Model,
        feedforward: FlexibleFeedforward,
        feedback: StateFeedback | None = None,
        noise: Noise | None = None,
        *,
        channels: Sequence[str] | None = None,
        limits: Mapping[str, float] | None = None,
        integrator: str = AUTOMATIC,
        substeps: int = 1,
    ) -> None:
        self.model, self.feedforward, self.feedback = model, feedforward, feedback
        _match(model, feedforward, feedback)
        self.channels = _measured(model, channels) if feedback is not None or channels else ()
        self._largest = _limits(model, limits or {})
        self._commands, self._states = feedforward.commands, feedforward.state
        self._last = len(feedforward.time) - 1
        self._observer: Observer | None = None
        if feedback is not None:
            if noise is None:
                raise SimulationError(
                    "a feedback needs an observer; give noise, the deviations of readings and of unknown forces"
                )
            self._schedule(feedback, noise, Setup(integrator, substeps))
        self.reset()

    def _schedule(self, feedback: StateFeedback, noise: Noise, setup: Setup) -> None:
        """Gains of the controller at every sample, computed once: a step then takes a row of a table."""
        step, places = self.feedforward.time_step, feedback.schedule

        def made(steps: Setup) -> Observer:
            settings = (self.model, step, self.channels, noise)
            return Observer(*settings, state=self._states[0], integrator=steps.integrator, substeps=steps.substeps)

        observer = made(setup)
        self._steady = [
            observer.settled(state, command) for state, command in zip(places.states, places.commands, strict=True)
        ]
        check_loops(made, feedback, self._steady, setup)
        values = at_axes(places, self.model, self.feedforward.time, self.feedforward.position)
        around = [places.weights(row) for row in values]
        self._nearest = [int(points[np.argmax(shares)]) for points, shares in around]
        tables = (feedback.gains, feedback.integral_gains, feedback.outputs)
        self._gains, self._integral_gains, self._outputs = (
            np.array([np.tensordot(shares, table[points], axes=1) for points, shares in around]) for table in tables
        )
        self._observer, self._time_step = observer, step

    def reset(self, state: Mapping[str, float] | ArrayLike | None = None) -> None:
        """Reset the controller, with the machine in this state; by default in the first reference.

        Parameters
        ----------
        state : mapping of str to float, or array_like of shape (nx,), optional
        """
        self._sample, self._kept = 0, -1
        if self.feedback is not None and self._observer is not None:
            self._sums = np.zeros(len(self.feedback.integrated))
            self._observer.reset(self._states[0] if state is None else state)

    def step(self, measurements: ArrayLike = ()) -> Array:
        """Step of the controller: commands of this sample from the readings at its beginning.

        Parameters
        ----------
        measurements : array_like, shape (m,)
            In the order of `channels`; not a number where a reading did not come. None without a feedback.

        Returns
        -------
        ndarray, shape (nu,)
            In the order of ``model.inputs``.

        Raises
        ------
        SimulationError
            A size is wrong, or a number is infinite.
        DivergedError
            The observer left its bounds; only `reset` leads on.
        """
        at = min(self._sample, self._last)
        self._sample += 1
        observer = self._observer
        if observer is None:
            return self._within(self._commands[at])
        if self._nearest[at] != self._kept:
            self._kept = self._nearest[at]
            observer.keep(self._steady[self._kept])
        reference = self._states[at]
        wanted = self._commands[at] - self._gains[at] @ (observer.predicted - reference)
        wanted -= self._integral_gains[at] @ self._sums
        if not np.isfinite(wanted).all():
            raise DivergedError(
                f"{self.model.name}: the observer of the controller expects no finite state at t = {self.time:g} s; "
                "reset it, and check that its model is that of the machine",
                run=None,
                time=None,
            )
        command = self._within(wanted)
        estimate = observer.step(measurements, command)
        if (command == wanted).all():
            self._sums += self._time_step * (self._outputs[at] @ (estimate - reference))
        return command

    def _within(self, wanted: Array) -> Array:
        # A clip of two calls: `numpy.clip` takes several times as long for a few numbers.
        kept: Array = np.minimum(np.maximum(wanted, -self._largest), self._largest)
        return kept

    def __call__(self, simulation: Simulation) -> Array:
        """Commands for a `vpm.Simulation`, by whose outputs they are corrected: ``simulation.run(controller, 2.0)``."""
        return self.step([simulation[name] for name in self.channels])

    @property
    def time(self) -> float:
        """Time of the controller's coming sample, s; the target begins at zero."""
        return float(self.feedforward.time[0] + self._sample * self.feedforward.time_step)

    @property
    def estimate(self) -> Array:
        """State (nx,) that the controller last corrected; without a feedback the reference."""
        return self._states[min(self._sample, self._last)] if self._observer is None else self._observer.state

    def step_times(self, steps: int = 2000, clock: Callable[[], float] = perf_counter) -> Array:
        """Times of single steps (steps,), s, on readings that are as expected; the controller begins again after it.

        A controller at work takes as long: what a step does hangs on no reading. ``time.thread_time`` as a clock leaves
        out what other programs take on a machine that they share.
        """
        self.reset()
        missing, times = np.full(len(self.channels), np.nan), np.empty(steps)
        for place in range(steps):
            if self._sample > self._last:
                self.reset()
            begin = clock()
            self.step(missing)
            times[place] = clock() - begin
        self.reset()
        return times

    def __repr__(self) -> str:
        parts = "feed-forward" if self.feedback is None else "feed-forward, feedback, observer"
        return f"FlexibleController({self.model.name!r}, {parts}, channels={', '.join(self.channels) or 'none'})"


def _match(model: Model, feedforward: FlexibleFeedforward, feedback: StateFeedback | None) -> None:
    if feedforward.coordinates != model.coordinates or feedforward.inputs != model.inputs:
        raise SimulationError(
            f"the feed-forward is of a machine with {len(feedforward.coordinates)} coordinates, {model.name} has "
            f"{len(model.coordinates)}; make both from the same model"
        )
    if feedback is None:
        return
    if feedback.states != model.state_names or feedback.inputs != model.inputs:
        raise SimulationError(
            f"the feedback is of a machine with {len(feedback.states)} states, {model.name} has "
            f"{len(model.state_names)}; make both from the same model"
        )
    if not np.isclose(feedback.time_step, feedforward.time_step, rtol=1e-9):
        raise SimulationError(
            f"the feedback is made for samples of {feedback.time_step:g} s, the feed-forward for "
            f"{feedforward.time_step:g} s; give both the same time step"
        )


def _measured(model: Model, channels: Sequence[str] | None) -> tuple[str, ...]:
    if channels is not None:
        return tuple(channels)
    strains = tuple(name for name in model.output_channels if name.endswith(".strain"))
    if model.core.n_elastic and not strains:
        raise SimulationError(
            f"{model.name} has flexible links but no strain gauge that would show them; add [gauges.NAME] to the model "
            "file, or name what is measured in channels"
        )
    return (*(f"{joint}.position" for joint in model.joints), *strains)


def _limits(model: Model, limits: Mapping[str, float]) -> Array:
    largest = np.full(len(model.inputs), np.inf)
    check_known(limits, model.inputs, SimulationError, "limits:", "is unknown")
    for name, value in limits.items():
        if not value > 0.0:
            raise SimulationError(f'limits: "{name}" is {value:g}; give a positive number')
        largest[model.inputs.index(name)] = value
    return largest
