"""Environments: gymnasium's own check, and a batch that is its single copies bit for bit."""

from typing import Any

import numpy as np
import pytest

from test_observer import CART
from vpm.errors import SimulationError
from vpm.model import Model

pytest.importorskip("gymnasium", reason="gymnasium is not installed (pip install 'vpm-dynamics[gym]')")
from gymnasium.utils.env_checker import check_env

from vpm.gym import Environment, VectorEnvironment

SETTINGS: dict[str, Any] = {
    "commands": {"drive": (-20.0, 20.0)},
    "reward": lambda seen, action: -(seen[:, 0] ** 2) - 1e-4 * action[:, 0] ** 2,
    "time_step": 0.01,
    "samples": 2,
    "duration": 0.6,
    "bounds": {"axis.position": (-0.35, 0.35)},
    "spread": {"axis.position": 0.3, "axis.velocity": 2.0},
}


@pytest.mark.filterwarnings("ignore")
def test_gymnasium_finds_nothing_wrong() -> None:
    check_env(Environment(Model.from_toml(CART), **SETTINGS), skip_render_check=True)


def test_a_batch_is_its_copies_bit_for_bit() -> None:
    model, random = Model.from_toml(CART), np.random.default_rng(0)
    batch = VectorEnvironment(model, 6, **SETTINGS)
    single = [Environment(model, **SETTINGS) for _ in range(6)]
    seen, _ = batch.reset(seed=7)
    for number, one in enumerate(single):
        np.testing.assert_array_equal(one.reset(seed=7 + number)[0], seen[number])
    ended, ways = np.zeros(6, dtype=bool), set()
    for _ in range(80):
        actions = random.uniform(-20.0, 20.0, (6, 1))
        seen, rewards, terminated, truncated, _ = batch.step(actions)
        for number, one in enumerate(single):
            if ended[number]:
                np.testing.assert_array_equal(one.reset()[0], seen[number])
                assert rewards[number] == 0.0
                continue
            own, reward, *ends, _ = one.step(actions[number])
            np.testing.assert_array_equal(own, seen[number])
            assert (reward, *ends) == (rewards[number], terminated[number], truncated[number])
        ended = terminated | truncated
        ways |= {("out", bool(terminated.any())), ("late", bool(truncated.any()))}
    assert {("out", True), ("late", True)} <= ways


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"commands": {}}, "commands lack"),
        ({"commands": {"drive": (1.0, -1.0)}}, "no range"),
        ({"bounds": {"axis.postion": (0.0, 1.0)}}, "bounds"),
        ({"duration": 0.0}, "positive"),
    ],
)
def test_wrong_settings_are_refused(change: dict[str, Any], words: str) -> None:
    with pytest.raises(SimulationError, match=words):
        Environment(Model.from_toml(CART), **(SETTINGS | change))
