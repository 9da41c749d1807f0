"""What a model shows in one state."""

from collections.abc import Mapping, Sequence

import numpy as np

import vpm
from validation.row import Array


def at_rest(model: vpm.Model, position: Sequence[float] | Array = ()) -> Mapping[str, float]:
    """All outputs in equilibrium under gravity, with the joints held at ``position``."""
    coordinates, _ = model.equilibrium(position)
    state = np.concatenate([coordinates, np.zeros(model.core.n_states - coordinates.size)])
    return outputs(model, state)


def outputs(model: vpm.Model, state: Array) -> Mapping[str, float]:
    """All outputs in a state, with no command on any actuator."""
    none = np.zeros((1, len(model.actuators)))
    found, _, _ = model.core.simulate(model.theta, state, none, 1e-3, 1, "linearly_implicit", [])
    return dict(zip(model.output_channels, found[0], strict=True))
