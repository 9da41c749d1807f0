"""What only validation records reach is said: no fit to the training records can name it."""

import numpy as np
import pytest

from model_texts import DAMPED_AXIS
from vpm import diagnose
from vpm.experiment import Experiment
from vpm.model import Model

MODEL = Model.from_toml(DAMPED_AXIS)
#: Limit of the drive, N, that the model file does not know.
LIMIT = 1.5


def pushed(name: str, size: float) -> Experiment:
    """A mass of 2 kg with friction, pushed by a force of up to ``size`` (N), of which the drive passes on 1.5 N."""
    dt, steps, random = 2e-3, 4000, np.random.default_rng(11)
    time = dt * np.arange(steps)
    force = size * np.sin(2.0 * np.pi * 0.5 * time)
    position, velocity = np.zeros(steps), 0.0
    for k in range(steps - 1):
        velocity += dt * (np.clip(force[k], -LIMIT, LIMIT) - 3.0 * velocity) / 2.0
        position[k + 1] = position[k] + dt * velocity
    readings = np.round(position + random.normal(0.0, 1e-6, steps), 6)
    return Experiment.from_arrays(time, {"axis.position": readings, "drive.command": force}, model=MODEL, name=name)


@pytest.mark.parametrize(("size", "beyond"), [(1.2, False), (6.0, True)])
def test_commands_far_beyond_the_training_records_are_told(size: float, beyond: bool) -> None:
    why = diagnose(MODEL, [pushed("low", 1.2), pushed("low too", 1.0)], pushed("high", size), workers=1)
    notes = [note for note in why.notes if note.startswith("high: drive.command runs from")]
    assert bool(notes) == beyond
    if beyond:
        assert why.verdict == "unexplained"
        assert "from -6 to 6 N, but in training records from -1.2 to 1.2; train on" in notes[0]
