"""State spaces for python-control: flexible and hydraulic machines with the names of all their states."""

from typing import Any

import numpy as np
import pytest

from places import EXAMPLES
from test_batched import BEAM
from vpm.errors import SimulationError
from vpm.model import Model

control = pytest.importorskip("control", reason="python-control is not installed (pip install 'vpm-dynamics[control]')")
DRIVE = '\n[actuators.motor]\njoint = "shoulder"\ngain = 1.0\n'
HYDRAULIC = EXAMPLES / "crane" / "crane.toml"


def machines() -> dict[str, Model]:
    return {"beam": Model.from_toml(BEAM + DRIVE), "hydraulic": Model.load(HYDRAULIC)}


@pytest.mark.parametrize("name", ["beam", "hydraulic"])
def test_all_states_and_inputs_keep_their_names(name: str) -> None:
    model = machines()[name]
    linear = model.linearize()
    system: Any = linear.to_control()
    for given, made in (
        (linear.states, system.state_labels),
        (linear.inputs, system.input_labels),
        (linear.outputs, system.output_labels),
    ):
        assert made == [label.replace(".", "_") for label in given]
        assert len(set(made)) == len(made)
    assert len(linear.states) > 2 * len(model.joints)
    np.testing.assert_allclose(system(2j * np.pi * 3.0), linear.response([3.0])[0], rtol=1e-6, atol=1e-12)


def test_sampled_systems_answer_as_held_commands_do() -> None:
    linear = machines()["beam"].linearize()
    system: Any = linear.to_control(1e-3)
    A, B = linear.sampled(1e-3)
    assert system.dt == 1e-3
    np.testing.assert_array_equal(system.A, A)
    np.testing.assert_array_equal(system.B, B)
    with pytest.raises(SimulationError, match="positive"):
        linear.to_control(0.0)
