"""Rankings of a link that bends: no law of bending is exact, and what a gauge reads is that law."""

from __future__ import annotations

import numpy as np
import pytest

import vpm
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.ranking import Ranking

STEP, COUNT = 2e-3, 5000

LINK = """
name = "wiper"
gravity = [0.0, 0.0, -9.81]

[bodies.hub]
mass = 1.0
inertia = [0.02, 0.02, 0.02, 0.0, 0.0, 0.0]

[joints.turn]
type = "revolute"
parent = "world"
child = "hub"
axis = [0.0, 0.0, 1.0]

[beams.blade]
parent = "hub"
rotation = [0.0, 1.5707963267948966, 0.0]
length = 0.6
level = "strain(2)"
deforms = ["bending_x"]
material = { young = 70e9, poisson = 0.33, density = 2700.0 }
section = { shape = "rectangle", width = 0.03, height = 0.006 }
damping = { stiffness = 2e-3 }

[gauges.root]
beam = "blade"
at = 0.03
y = -0.003

[actuators.motor]
joint = "turn"
gain = { value = 1.0, unit = "N m/A", uncertainty = 0.05 }
command_unit = "A"

[sensors.encoder]
measures = "turn.position"

[sensors.bridge]
measures = "root.strain"

[[effects]]
type = "viscous_friction"
at = "turn"
viscous = { value = 0.3, uncertainty = 0.1 }
"""


def swung(gain: float, seed: int) -> Experiment:
    """Record of the link whose gauge reads ``gain`` times what theory says, with noise of an encoder and a bridge."""
    random = np.random.default_rng(seed)
    time = STEP * np.arange(COUNT)
    waves = random.uniform(0.3, 3.0, 6)
    command = np.sum(0.25 * np.sin(2.0 * np.pi * np.outer(time, waves) + random.uniform(0.0, 6.3, 6)), axis=1)
    machine = Model.from_toml(LINK).with_parameters({"turn.friction.viscous": 0.35})
    sent = Experiment.from_arrays(time, {"turn.position": 0.0 * time, "motor.command": command}, model=machine)
    run = vpm.simulate(machine, sent, initial_state=np.zeros(machine.core.n_states))
    turn, strain = run["turn.position"], run["root.strain"]
    read = {
        "turn.position": turn + 2e-6 * random.standard_normal(COUNT),
        "root.strain": gain * strain + 2e-8 * random.standard_normal(COUNT),
        "motor.command": command,
    }
    return Experiment.from_arrays(time, read, model=machine, name=f"wiper {seed}")


def ranked(gain: float) -> Ranking:
    return vpm.rank(Model.from_toml(LINK), [swung(gain, seed) for seed in (1, 2)])


def test_what_a_gauge_reads_is_no_more_exact_than_the_law_of_bending() -> None:
    assert ranked(0.994).effects == ()


def test_a_gain_of_a_gauge_that_no_law_of_bending_misses_is_named() -> None:
    ranking = ranked(0.95)
    assert [(one.effect, one.site) for one in ranking.effects] == [("sensor_gain", "bridge")]
    assert ranking.effects[0].values["bridge.gain.value"] == pytest.approx(0.95, abs=0.01)
