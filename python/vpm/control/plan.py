"""What a feed-forward holds: commands and references of a motion, as a result and as a log."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vpm.errors import SimulationError, check_known
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.numbers import Array
from vpm.results import Result

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, repr=False, eq=False)
class FlexibleFeedforward(Result):
    """Commands and references of a motion, from rest to rest.

    Attributes
    ----------
    time : ndarray, shape (N,)
        s; the target moves from zero to its duration, what comes before is the pre-actuation.
    commands : ndarray, shape (N, nu)
        Of all inputs of the model, each for the sample that begins there, SI; what is not at work has its usual value.
    target, reached : ndarray, shape (N, m)
        What the outputs should do, and what they do.
    position, velocity, acceleration : ndarray, shape (N, n)
        References of joints and elastic coordinates.
    strain : ndarray, shape (N, gauges)
    zeros : ndarray, shape (internal motions,)
        Poles of the internal motions at the start (1/s); those to the right make the feed-forward begin early.
    """

    model_name: str
    method: str
    time: Array
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    coordinates: tuple[str, ...]
    strains: tuple[str, ...]
    commands: Array
    target: Array
    reached: Array
    position: Array
    velocity: Array
    acceleration: Array
    strain: Array
    zeros: NDArray[np.complex128]

    @property
    def time_step(self) -> float:
        """Time between samples of a feed-forward plan, s."""
        return float(self.time[1] - self.time[0])

    @property
    def pre_actuation(self) -> float:
        """Time before the target in which a plan already moves the machine, s."""
        return abs(float(self.time[0]))

    @property
    def state(self) -> Array:
        """Planned reference of the state (N, nx), named by ``model.state_names``."""
        return np.concatenate([self.position, self.velocity], axis=1)

    def to_experiment(self, model: Model) -> Experiment:
        """Feed-forward plan as a log, for `vpm.simulate`, files and `vpm simulate`.

        Parameters
        ----------
        model : Model
            That plays it. Where a controller of the model commands an actuator by the position of a joint, the log has
            the joint's reference, and the feed-forward as a disturbance of the command; elsewhere commands.

        Returns
        -------
        Experiment
            Its time begins at zero, with the pre-actuation.

        Raises
        ------
        SimulationError
            The model lacks a joint or an actuator.
        """
        values: dict[str, Array] = {}
        check_known(self.inputs, model.inputs, SimulationError, f"{model.name} has no input")
        for place, name in enumerate(self.inputs):
            measured = model.held_channels.get(name)
            if measured is None:
                values[f"{name}.command"] = self.commands[:, place]
                continue
            joint = measured.removesuffix(".position")
            if joint not in self.coordinates:
                raise SimulationError(
                    f"the controller of {name} follows {measured}, for which a feed-forward has no reference; "
                    "play it with a model without that controller"
                )
            values[f"{name}.reference"] = self.position[:, self.coordinates.index(joint)]
            values[f"{name}.disturbance"] = self.commands[:, place]
        return Experiment.from_arrays(self.time - self.time[0], values, model=model, name=f"{self.method} feed-forward")

    def _headline(self) -> Mapping[str, object]:
        return {
            "model": self.model_name,
            "method": self.method,
            "outputs": ", ".join(self.outputs),
            "seconds": float(np.ptp(self.time)),
            "pre_actuation": self.pre_actuation,
        }

    def _frame_columns(self) -> Mapping[str, object]:
        columns: dict[str, object] = {"time_s": self.time}
        columns |= {f"{name}.command": self.commands[:, place] for place, name in enumerate(self.inputs)}
        columns |= {f"{name}.target": self.target[:, place] for place, name in enumerate(self.outputs)}
        columns |= {f"{name}.position": self.position[:, place] for place, name in enumerate(self.coordinates)}
        return columns | {name: self.strain[:, place] for place, name in enumerate(self.strains)}

    def plot(self) -> Figure:
        """Plot a plan: outputs, commands, joints and strains over time. Needs the extra ``plot``."""
        from vpm.plot import plot_channels

        kinds = (
            ("", self.outputs, self.reached),
            (".command", self.inputs, self.commands),
            ("", self.strains, self.strain),
        )
        names = [f"{name}{end}" for end, own, _ in kinds for name in own]
        table = np.hstack([values for _, _, values in kinds])
        return plot_channels(self.time, table, names, [""] * len(names), title=f"{self.model_name}, {self.method}")
