"""Environments: gymnasium's own check, and a batch that is its single copies bit for bit."""

from typing import Any

import numpy as np
import pytest

from places import EXAMPLES
from test_observer import CART
from vpm.errors import SimulationError
from vpm.model import Model
from vpm.stepping import Simulation

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


def test_springs_of_lines_and_closed_loops_need_nothing_of_actions() -> None:
    """Episodes of a parallelogram on a spring begin closed, and a step is that of a simulation."""
    content = Model.load(EXAMPLES / "loops" / "parallelogram.toml").to_dict()
    ends = {
        "from": {"parent": "world", "point": [0.3, 0.0, 0.6]},
        "to": {"parent": "coupler", "point": [0.1, 0.0, 0.0]},
    }
    pull = {"type": "spring_damper", "line": "coil", "stiffness": 40.0, "free_length": 0.2, "damping": 1.0}
    model = Model.from_dict({**content, "lines": {"coil": ends}, "actuators": {"pull": pull, **content["actuators"]}})
    drives = [name for name in model.actuators if name != "pull"]
    batch = VectorEnvironment(
        model,
        3,
        commands=dict.fromkeys(drives, (-2.0, 2.0)),
        reward=lambda seen, _: -(seen[:, 0] ** 2),
        time_step=1e-3,
        samples=5,
        state={"left_crank.position": 0.3},
        spread={"left_crank.position": 0.1, "left_crank.velocity": 0.2},
    )
    seen, _ = batch.reset(seed=3)
    assert batch.single_action_space.shape == (len(drives),)
    assert np.ptp(seen[:, 0]) > 1e-3
    for row in seen:
        assert np.abs(model.loops.at(row[::2]).gap).max() < 1e-12
    alone = Simulation(model, 1e-3, state=dict(zip(batch.channels[:2], seen[1, :2], strict=True)))
    after, *_ = batch.step(np.full((3, len(drives)), 0.7))
    for _ in range(5):
        alone.step([0.0 if name == "pull" else 0.7 for name in model.inputs])
    np.testing.assert_allclose([alone[name] for name in batch.channels], after[1], atol=1e-9)
