"""What counts as left: a channel that is above its noise and more than nothing beside its signal."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from vpm.discrepancy.diagnosis import ChannelGap
from vpm.discrepancy.verdict import verdict

SIGNAL, NOISE = 1.0, 1e-3


def told(elbow: float) -> str:
    """Verdict on a structured residual with a strain of 2 ‰ at twice its noise, and so much at the elbow."""
    noise = np.random.default_rng(1).normal(0.0, 1.0, 400)
    data: Any = SimpleNamespace(unseen=SimpleNamespace(blocks=(SimpleNamespace(samples=slice(0, 400)),)))
    nominal: Any = SimpleNamespace(unseen=3.0 * noise)
    recalibrated: Any = SimpleNamespace(unseen=noise)
    found: Any = SimpleNamespace(accepted=(), left={}, within_laws=False)
    left: Any = SimpleNamespace(present=True)
    gap = {
        "strain": ChannelGap(3e-3, 2e-3, 2e-3, NOISE, "1", SIGNAL, "inverse_dynamics"),
        "elbow": ChannelGap(2e-2, elbow, elbow, 7.0 * NOISE, "N m", SIGNAL, "inverse_dynamics"),
    }
    return verdict(data, nominal, recalibrated, found, gap, left, None)[0]


@pytest.mark.parametrize(("elbow", "word"), [(8e-3, "parameters_only"), (1.4e-2, "unexplained")])
def test_a_trifle_above_its_noise_says_nothing_of_another_channel(elbow: float, word: str) -> None:
    assert told(elbow) == word
