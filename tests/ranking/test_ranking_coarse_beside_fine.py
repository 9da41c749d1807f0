"""A coarse sensor behind a spring beside a fine encoder before it: its noise moves the encoder, and nothing falls."""

import numpy as np

from model_texts import on_rail, sliding
from vpm import Experiment, Model, simulate
from vpm.ranking import Settings
from vpm.ranking.tracked_records import TrackedRecords, Tracker

STEP, COARSE, FINE = 2e-3, 1e-3, 1e-6

ROPE = """
[transmissions.rope]
ratios = { winch = 1.0, cage = -1.0 }

[[effects]]
type = "spring"
at = "rope"
stiffness = 1e4

[[effects]]
type = "viscous_friction"
at = "rope"
viscous = 30.0
"""


def test_noise_of_a_coarse_sensor_that_moves_a_fine_one_is_no_fall() -> None:
    model = Model.from_toml(on_rail("drum", joint="winch") + sliding("load", "2.0", "cage", "world") + ROPE)
    time = STEP * np.arange(3000)
    command = {"drive.command": 20.0 * np.sin(6.0 * time) + 10.0 * np.sin(17.0 * time)}
    run = simulate(model, Experiment.from_arrays(time, command, model=model))
    random = np.random.default_rng(1)
    noise = {"winch.position": FINE, "cage.position": COARSE}
    read = {name: run[name] + size * random.standard_normal(len(time)) for name, size in noise.items()}
    records = TrackedRecords(model, [Experiment.from_arrays(time, command | read, model=model)], Settings())
    assert not records.falls(model, model.theta, Tracker(1.0))
