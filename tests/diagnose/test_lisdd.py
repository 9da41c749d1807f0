"""LISDD, the baseline of `benches/diagnosis`: what it finds on closed forms, and how often its test rejects noise."""

import sys
from functools import lru_cache
from importlib import import_module
from typing import Any

import numpy as np
import pytest

from model_texts import DAMPED_AXIS, changed
from places import ROOT
from vpm.experiment import Experiment
from vpm.model import Model

BENCH = ROOT / "benches" / "diagnosis"
STEP = 2e-3


@pytest.fixture
def lisdd(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.setattr(sys, "path", [str(BENCH), *sys.path])
    return import_module("lisdd")


def believed() -> Model:
    return changed(DAMPED_AXIS, ("value = 2.0, uncertainty = 0.2", "value = 1.8, uncertainty = 0.4"))


@lru_cache
def record(seed: int, coulomb: float) -> Experiment:
    """Sines by closed forms, with noise of an encoder and of a drive whose command holds for a sample."""
    generator = np.random.default_rng(seed)
    time = STEP * np.arange(6000, dtype=np.float64)
    rates, phases = 2.0 * np.pi * generator.uniform(0.2, 2.5, 6), generator.uniform(0.0, 2.0 * np.pi, 6)
    position, speed, acceleration = (
        np.sum(
            (0.3 / (1.0 + rates) * rates**order)[:, None]
            * np.sin(rates[:, None] * (time + late) + (phases + 0.5 * np.pi * order)[:, None]),
            axis=0,
        )
        for order, late in ((0, 0.0), (1, 0.5 * STEP), (2, 0.5 * STEP))
    )
    effort = 2.0 * acceleration + 3.0 * speed + coulomb * np.tanh(speed / 2e-3)
    values = {
        "axis.position": position + 2e-6 * generator.standard_normal(time.size),
        "drive.command": effort + 0.02 * generator.standard_normal(time.size),
    }
    return Experiment.from_arrays(time, values, units={"axis.position": "m", "drive.command": "N"}, name=f"{seed}")


@pytest.mark.parametrize("way", ["everywhere", "flagged"])
def test_friction_is_found(lisdd: Any, way: str) -> None:
    training, unseen = [record(1, 0.8), record(2, 0.8)], [record(3, 0.8)]
    found = lisdd.lisdd(believed(), training, unseen, way)
    assert found.named[0] == ("coulomb_friction", "axis")
    assert found.verdict == "effect_found"


@pytest.mark.parametrize("way", ["everywhere", "flagged"])
def test_nothing_is_named_where_nothing_is_missing(lisdd: Any, way: str) -> None:
    training, unseen = [record(1, 0.0), record(2, 0.0)], [record(3, 0.0)]
    found = lisdd.lisdd(believed(), training, unseen, way)
    assert found.named == ()
    assert found.verdict == "no_disagreement"


def test_more_axes_are_refused(lisdd: Any) -> None:
    two = {**believed().to_dict()}
    two["bodies"] = {**two["bodies"], "tool": {"mass": 1.0}}
    two["joints"] = {**two["joints"], "second": {**two["joints"]["axis"], "parent": "carriage", "child": "tool"}}
    with pytest.raises(ValueError, match="not a single axis: 2 joints"):
        lisdd.lisdd(Model.from_dict(two), [record(1, 0.0)], [record(2, 0.0)])


def test_an_unknown_way_is_refused(lisdd: Any) -> None:
    with pytest.raises(ValueError, match="choose from everywhere, flagged"):
        lisdd.lisdd(believed(), [record(1, 0.0)], [record(2, 0.0)], "nowhere")


@pytest.mark.parametrize("level", [0.05, 0.2])
def test_the_test_rejects_noise_as_often_as_it_says(lisdd: Any, level: float) -> None:
    draws, generator = 600, np.random.default_rng(5)
    columns = generator.standard_normal((80, 4))
    noise = generator.standard_normal((draws, 80))
    rejected = sum(lisdd.log_level(columns[:, :2], columns, target) < np.log(level) for target in noise)
    # Four standard deviations of the count.
    assert abs(rejected - level * draws) < 4.0 * np.sqrt(level * (1.0 - level) * draws)


def test_noise_with_memory_counts_for_less(lisdd: Any) -> None:
    """With all samples the test rejects far too often; with the effective number it keeps its level."""
    level, draws, memory, generator = 0.05, 300, 0.6, np.random.default_rng(6)
    noise, columns = generator.standard_normal((2, draws, 400))
    for k in range(1, 400):
        noise[:, k] += memory * noise[:, k - 1]
        columns[:, k] += memory * columns[:, k - 1]
    known = np.ones((400, 1))
    every = np.ones(400, dtype=np.bool_)
    data = lisdd.Samples(noise[0], known, known, np.zeros((400, 4)), np.zeros(400, dtype=np.int64), every, ())
    plain = effective = 0
    for target, column in zip(noise, columns, strict=True):
        full = np.column_stack([known, column])
        left = target - full @ np.linalg.lstsq(full, target, rcond=None)[0]
        plain += lisdd.log_level(known, full, target) < np.log(level)
        effective += lisdd.log_level(known, full, target, lisdd.effective_count(data, left)) < np.log(level)
    assert plain > 2 * level * draws
    assert effective < level * draws + 4.0 * np.sqrt(level * draws)


@pytest.mark.usefixtures("lisdd")
def test_two_methods_are_compared_by_what_one_of_them_alone_solves() -> None:
    """Of ten cases one method solves one and the other nine: twice the binomial tail, 2 (1 + 10) / 1024."""
    level = import_module("side_by_side").level
    assert level(1, 9) == pytest.approx(22.0 / 1024.0)
    assert level(0, 0) == 1.0
