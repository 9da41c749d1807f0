"""Encoders that repeat a count: of a drum that rests below a brake while its load swings, and of a broken one."""

import numpy as np

from vpm.experiment import Experiment
from vpm.log_check import Settings
from vpm.log_check.stretches import odd_stretches
from winch import MODEL

STEP, COUNT = 1e-3, np.radians(0.01)
NAMES = ("shaft.position", "cell.fz")


def test_an_encoder_that_counts_rests_while_the_load_swings() -> None:
    """Interpolation onto an even grid leaves roundings of a number, which are no steps of the encoder and no noise."""
    random, time = np.random.default_rng(1), STEP * np.arange(6000)
    phase = np.where(time < 3.0, time, np.maximum(3.0, time - 0.3))  # the drum stands for 0.3 s
    counts = COUNT * np.floor((7.0 + 2.0 * np.sin(phase)) / COUNT)
    rounded = counts * (1.0 + 4.0 * np.finfo(np.float64).eps * (np.arange(time.size) % 30 == 0))
    swing = 590.0 + 40.0 * np.sin(20.0 * time)

    def kinds(position: np.ndarray) -> list[str]:
        values = dict(zip((*NAMES, "motor.command"), (position, swing, np.sin(time)), strict=True))
        record = Experiment.from_arrays(time, values, {}, name="log", model=MODEL)
        return [one.kind for one in odd_stretches(record, NAMES, (), Settings())]

    assert "frozen" not in kinds(counts)
    assert "frozen" not in kinds(rounded)
    noisy = rounded + 5.0 * COUNT * random.standard_normal(time.size)
    noisy[3000:3300] = noisy[3000]
    assert "frozen" in kinds(noisy)
