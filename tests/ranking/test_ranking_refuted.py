"""What validation records say of an effect: they refute one that does harm there, and none that they do not excite."""

from __future__ import annotations

import numpy as np
import pytest

import vpm
from model_texts import DAMPED_AXIS
from vpm.numbers import Array

STEP, MASS, DRAG = 2e-3, 2.0, 3.0
STOP, HARD = 0.12, 4e3  # m, N/m: where a bumper begins, and how stiff it is


def record(seed: int, size: float, push: float = 0.0) -> vpm.Experiment:
    """Sines whose effort follows from them, with a bumper above and a constant push."""
    generator = np.random.default_rng(seed)
    time: Array = STEP * np.arange(5000, dtype=np.float64)
    rates, phases = 2.0 * np.pi * generator.uniform(0.2, 1.5, 5), generator.uniform(0.0, 2.0 * np.pi, 5)
    turned = rates[:, None] * (time + 0.5 * STEP) + phases[:, None]
    sizes = (size * generator.uniform(0.5, 1.0, 5))[:, None]
    speeds = rates[:, None]
    way, speed = np.sum(sizes * np.sin(turned), axis=0), np.sum(sizes * speeds * np.cos(turned), axis=0)
    acceleration = -np.sum(sizes * speeds**2 * np.sin(turned), axis=0)
    effort = MASS * acceleration + DRAG * speed + HARD * np.maximum(way - STOP, 0.0) - push
    read = np.sum(sizes * np.sin(rates[:, None] * time + phases[:, None]), axis=0)
    values = {
        "axis.position": read + 1e-6 * generator.standard_normal(time.size),
        "drive.command": effort + 5e-3 * generator.standard_normal(time.size),
    }
    return vpm.Experiment.from_arrays(time, values, units={"axis.position": "m", "drive.command": "N"}, name=f"r{seed}")


def ranked(training: list[vpm.Experiment], validation: list[vpm.Experiment], *effects: str) -> vpm.Ranking:
    return vpm.rank(vpm.Model.from_toml(DAMPED_AXIS), training, validation, effects=effects, workers=1)


def test_a_push_that_only_the_fitted_records_felt_is_refuted() -> None:
    training = [record(seed, 0.03, push=0.3) for seed in (1, 2)]
    assert [one.effect for one in ranked(training, [], "bias_force").effects] == ["bias_force"]
    assert [one.effect for one in ranked(training, [record(3, 0.03, push=0.3)], "bias_force").effects] == ["bias_force"]
    found = ranked(training, [record(3, 0.03)], "bias_force")
    assert found.effects == ()
    ((refuted, *_), *_) = found.rounds
    assert refuted.judgement.refuted > 1.0
    harm = "but makes that of validation records more than 10 times as large"
    assert refuted.judgement.lacks(vpm.ranking.Settings()).endswith(harm)


def test_a_bumper_that_validation_records_never_reach_stays() -> None:
    training = [record(seed, 0.06) for seed in (4, 5)]
    assert max(float(np.max(one["axis.position"])) for one in training) > STOP + 0.01
    still = record(6, 0.02)
    assert float(np.max(still["axis.position"])) < STOP - 0.01
    (found,) = ranked(training, [still], "end_stop", "cubic_spring").effects
    assert found.effect == "end_stop"
    (high,) = (value for name, value in found.values.items() if name.endswith(".high"))
    assert high == pytest.approx(STOP, abs=2e-3)
