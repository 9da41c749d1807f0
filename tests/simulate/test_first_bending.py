"""Links that ring where a record begins: how they bend follows from what is read there, not from rest."""

import numpy as np
import pytest

import vpm
from vpm.initial import measured_states
from vpm.model import Model
from vpm.numbers import Array

STEP, COUNT = 2e-3, 2500
#: Damping over stiffness of the link, s, and how far its slowest mode is bent at the first sample, m.
TIME, BENT = 4e-4, 0.01
DAMPING = "blade.damping.stiffness"

WIPER = """
name = "wiper"
gravity = [0.0, 0.0, -9.81]
bodies.hub = { mass = 1.0, inertia = [0.02, 0.02, 0.02, 0.0, 0.0, 0.0] }
joints.turn = { type = "revolute", parent = "world", child = "hub", axis = [0, 0, 1] }
gauges.root = { beam = "blade", at = 0.03, y = -0.003 }
actuators.motor = { joint = "turn", gain = 1.0, command_unit = "A" }

[beams.blade]
parent = "hub"
rotation = [0.0, 1.5707963267948966, 0.0]
length = 0.9
level = "modal(2)"
deforms = ["bending_x"]
material = { young = { value = 70e9, uncertainty = 2e9 }, poisson = 0.33, density = 2700.0 }
section = { shape = "rectangle", width = 0.03, height = 0.006 }
damping = { stiffness = { value = 4e-4, uncertainty = inf } }

[[effects]]
type = "viscous_friction"
at = "turn"
viscous = { value = 0.05, uncertainty = 0.02 }
"""


def rung(channels: tuple[str, ...]) -> tuple[vpm.Experiment, Array]:
    """Record of a link that rings with 6 Hz from the first sample on, and the true states."""
    random, time = np.random.default_rng(1), STEP * np.arange(COUNT)
    machine = Model.from_toml(WIPER)
    start = np.zeros(machine.core.n_states)
    start[1] = BENT
    command = 0.6 * np.sin(5.0 * time) + 0.5 * np.sin(9.0 * time + 0.7)
    outputs, states, _ = machine.core.simulate(
        machine.theta, start, command[:, None], STEP, 4, "linearly_implicit", [], "zero_order"
    )
    noise = {"turn.position": 1e-5, "root.strain": 1e-7}
    read = {
        name: outputs[:, machine.output_channels.index(name)] + noise[name] * random.standard_normal(COUNT)
        for name in channels
    }
    return vpm.Experiment.from_arrays(time, {**read, "motor.command": command}, model=machine), np.asarray(states)


def bending(channels: tuple[str, ...]) -> tuple[Array, Array]:
    """Bending (n,) of the slowest mode as the log tells it and as it is."""
    record, states = rung(channels)
    machine, rows = Model.from_toml(WIPER), np.arange(50, 1000)
    told = measured_states(machine, record, machine.theta, rows, None)
    return told[:, 1], states[rows, 1]


def test_a_gauge_tells_how_a_link_bends_where_a_record_begins() -> None:
    told, true = bending(("turn.position", "root.strain"))
    assert np.std(told - true) < 0.02 * np.std(true)
    without, _ = bending(("turn.position",))
    assert np.std(without - true) > 0.2 * np.std(true)


def test_restarts_find_the_damping_of_a_link_that_rings_already() -> None:
    """A wrong first state looks like damping: it dies away by that alone."""
    record, _ = rung(("turn.position", "root.strain"))
    model = Model.from_toml(WIPER).with_parameters({DAMPING: 2e-4})
    fit = vpm.identify(model, record, mode="restarts")
    # The filter of the joint leaves a little of the first state wrong; taken for rest it gives ten times the damping.
    assert fit.model.parameters[DAMPING].value == pytest.approx(TIME, rel=0.3)


def test_a_ranking_misses_no_damping_of_a_link_that_rings_already() -> None:
    record, _ = rung(("turn.position", "root.strain"))
    model = Model.from_toml(WIPER.replace("{ value = 4e-4, uncertainty = inf }", "4e-4"))
    assert not vpm.rank(model, record, effects=["structural_damping"]).effects
    (found,) = vpm.rank(model.with_parameters({DAMPING: 1e-4}), record, effects=["structural_damping"]).effects
    assert found.values["blade.structural_damping.time"] == pytest.approx(3e-4, rel=0.1)
