"""Hidden first states: no channel shows where unmeasured joints begin, and friction may hold them there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vpm.model import Model
from vpm.numbers import Array
from vpm.weighing.priors import Prior

#: By which share of its size a first state is moved for a derivative.
STEP = 1e-3


def hidden_states(model: Model, channels: Sequence[str]) -> tuple[str, ...]:
    """Hidden states of a model: positions of joints without a position channel, and velocities that none shows.

    Of machines with closed loops none: first states next to one another would leave their loops open.
    """
    if model.loops:
        return ()
    hidden = [name for name in model.joints if name not in model.added_joints and f"{name}.position" not in channels]
    names = [f"{name}.{what}" for what in ("position", "velocity") for name in hidden]
    return tuple(name for name in names if name in model.state_names and name not in channels)


@dataclass(frozen=True)
class HiddenFirstStates:
    """Hidden first states of each record, as differences from equilibrium."""

    states: tuple[str, ...] = ()
    sizes: tuple[float, ...] = ()  #: How far each of them moves in the records: it may begin as far from balance.
    records: int = 0

    @property
    def priors(self) -> dict[str, Prior]:
        """Priors of the hidden first states in each record."""
        return {
            f"{state} where record {record + 1} begins": Prior(0.0, size, -np.inf, np.inf)
            for record in range(self.records)
            for state, size in zip(self.states, self.sizes, strict=True)
        }

    def added(self, model: Model, start: Array, moves: Array) -> Array:
        """First state (nx,) of a model with the hidden ones moved by ``moves`` (len(states),)."""
        start = start.copy()
        start[[model.state_names.index(state) for state in self.states]] += moves
        return start
