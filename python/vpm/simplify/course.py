"""Inputs for the timing of reduced models: commands of each model, and its start state."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vpm.budget import commands, start_state
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.simplify.judge import Judge
from vpm.simplify.replacement import commanded

Array = NDArray[np.float64]


class Courses:
    """Commands along the first record to judge on, worked out once for all models with the same drives.

    Parameters
    ----------
    model : Model
        The full one.
    judge : Judge
    """

    def __init__(self, model: Model, judge: Judge) -> None:
        self._full, self._judge = model, judge
        self._known: dict[tuple[str, ...], Array] = {}

    def record(self, model: Model) -> Experiment:
        """Record that drives a model.

        Parameters
        ----------
        model : Model
        """
        return commanded(model, self._full, self._judge.driven)

    def of(self, model: Model) -> tuple[Array, Array | None]:
        """Inputs (N, inputs) of a model, and the state that it starts from; see `vpm.budget.start_state`.

        Parameters
        ----------
        model : Model
        """
        record = self.record(model)
        kinds = tuple(model.actuator_type(name) for name in model.actuators) + model.controlled_actuators
        if kinds not in self._known:
            # Reduced models of the same drives get what the first of them got, which is the full model.
            self._known[kinds] = commands(model, self._judge.rate, record)
        return self._known[kinds], start_state(model, record)
