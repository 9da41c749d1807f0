"""What a refitted candidate is refused for."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import pytest

from vpm.demo import MODEL
from vpm.discrepancy.confirmation import Trial
from vpm.discrepancy.refusal import NEGLIGIBLE, Thresholds, refuse_trial
from vpm.identify import Gain
from vpm.model import Model


def gained() -> Gain:
    """A gain on unseen data that nobody would doubt."""
    return Gain(before=1.0, after=0.1, weight=1.0, score=50.0, pieces=40)


def trial(value: float) -> Trial:
    """A refitted gain of the demonstration arm's encoder that explains much in every view."""
    model = Model.load(MODEL).with_effect("sensor_gain", at="encoder", value=value)
    candidate = SimpleNamespace(effect=SimpleNamespace(name="sensor_gain", site="sensor"), site="encoder")
    judged = SimpleNamespace(model=model, bounds={})
    return cast(
        "Trial",
        SimpleNamespace(
            probe=SimpleNamespace(candidate=candidate),
            judged=judged,
            parameters=("encoder.gain.value",),
            unseen=gained(),
            training=gained(),
            simulated=None,
            diverged="",
            away=None,
            clear=True,
        ),
    )


@pytest.mark.parametrize("error", [-0.8 * NEGLIGIBLE, 0.8 * NEGLIGIBLE])
def test_a_gain_that_no_instrument_keeps_is_no_finding(error: float) -> None:
    reason = refuse_trial(trial(1.0 + error), Thresholds(30, 1e-3))
    assert reason.startswith(f"encoder.gain.value comes out as {1.0 + error:.4g}: less than 0.5 % of the signal")


@pytest.mark.parametrize("error", [-1.2 * NEGLIGIBLE, 1.2 * NEGLIGIBLE])
def test_a_gain_beyond_that_is_one(error: float) -> None:
    assert refuse_trial(trial(1.0 + error), Thresholds(30, 1e-3)) == ""
