"""The flexible model in the controller: what cannot work is refused in one sentence."""

from typing import Any

import numpy as np
import pytest

import vpm
from test_flexible_control import CARTS, NOISE, RODS, feedback, plan, rods, turn
from vpm.errors import CoreError, SimulationError
from vpm.model import Model


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"output": ["tip.w"]}, "cannot be prescribed"),
        ({"output": ["tip.y", "tip.x"]}, "one output for each input"),
        ({"inputs": ["engine"]}, "engine"),
        ({"method": "magic"}, "no method"),
        ({"time_step": 0.1}, "twentieth"),
        ({"start": {"elbow": 1.0}}, "no joint"),
        ({"start": [1.0]}, "a number for each"),
        ({"pre_actuation": 1e-3}, "give at least"),
        ({"pre_actuation": -1.0}, "not negative"),
        ({"limits": {"motor": 1e-9}}, "beyond its limit"),
        ({"limits": {"engine": 1.0}}, "engine"),
        ({"limits": {"motor": np.nan}}, "positive number"),
        ({"time_step": 1e-6}, "samples"),
        ({"start": {"hub": "far"}}, "no number"),
    ],
)
def test_what_cannot_be_fed_forward_is_one_sentence(given: dict[str, object], message: str) -> None:
    with pytest.raises(SimulationError, match=message):
        vpm.flexible_feedforward(rods(), turn(), **{"output": ["tip.y"], **given})  # type: ignore[arg-type]


def test_targets_out_of_reach_and_impossible_ones_are_refused() -> None:
    far = vpm.TargetMotion.rest_to_rest([0.0], [3.0], 0.4)
    with pytest.raises(SimulationError, match="within reach"):
        vpm.flexible_feedforward(rods(), far, ["tip.y"])
    wide = vpm.TargetMotion.rest_to_rest([0.0, 1.0], [0.1, 1.0], 0.4)
    with pytest.raises(SimulationError, match="2 columns"):
        vpm.flexible_feedforward(rods(), wide, ["tip.y"])
    for wrong in ([np.nan], [0.0, 1.0]):
        with pytest.raises(SimulationError, match="target"):
            vpm.TargetMotion.rest_to_rest([0.0], wrong, 1.0)
    with pytest.raises(SimulationError, match="positive time"):
        vpm.TargetMotion.rest_to_rest([0.0], [1.0], 0.0)
    with pytest.raises(SimulationError, match="ascend"):
        vpm.TargetMotion.through([0.0, 0.0], [[0.0], [1.0]])
    with pytest.raises(SimulationError, match="at least two"):
        vpm.TargetMotion.through([0.0], [[0.0]])


def test_motions_that_no_input_moves_and_deviations_that_see_nothing_are_named() -> None:
    with pytest.raises(SimulationError, match="shows in no deviation"):
        vpm.state_feedback(rods(), {"hub": [0.0]}, deviations={"bend.position": 1.0}, efforts={"motor": 1.0})
    apart = Model.from_toml(RODS.replace('parent = "inner"\nchild', 'parent = "world"\nchild'))
    with pytest.raises(SimulationError, match=r"bend.*moved by no input"):
        vpm.state_feedback(apart, {"hub": [0.0]}, deviations={"tip.y": 1.0}, efforts={"motor": 1.0})
    for given, message in (
        ({"deviations": {"tip.q": 1.0}}, "tip.q"),
        ({"efforts": {"motor": -1.0}}, "positive"),
        ({"efforts": {}}, "at least one"),
        ({"integrate": {"tip.x": 1.0, "tip.y": 1.0}}, "integrate fewer"),
    ):
        own: Any = {"deviations": {"tip.y": 1.0}, "efforts": {"motor": 1.0}, **given}
        with pytest.raises(SimulationError, match=message):
            vpm.state_feedback(rods(), {"hub": [0.0]}, **own)
    for axis, message in (({"hub": [1.0, 0.0]}, "ascend"), ({"elbow": [0.0]}, "no joint")):
        with pytest.raises(SimulationError, match=message):
            vpm.state_feedback(rods(), axis, deviations={"tip.y": 1.0}, efforts={"motor": 1.0})


def test_parts_that_do_not_go_together_are_refused() -> None:
    carts = Model.from_toml(CARTS)
    with pytest.raises(SimulationError, match="give noise"):
        vpm.FlexibleController(rods(), plan(), feedback())
    with pytest.raises(SimulationError, match="same model"):
        vpm.FlexibleController(Model.from_toml(RODS.replace("motor", "engine")), plan())
    with pytest.raises(SimulationError, match="unknown"):
        vpm.FlexibleController(rods(), plan(), limits={"engine": 1.0})
    other = vpm.state_feedback(carts, {"way": [0.0]}, deviations={"load.x": 1.0}, efforts={"motor": 1.0})
    with pytest.raises(SimulationError, match="feedback is of a machine"):
        vpm.FlexibleController(rods(), plan(), other, NOISE)
    slow = vpm.state_feedback(
        rods(), plan(), deviations={"tip.y": 1.0}, efforts={"motor": 1.0}, time_step=2e-3, points=2
    )
    with pytest.raises(SimulationError, match="same time step"):
        vpm.FlexibleController(rods(), plan(), slow, NOISE)
    late = rods().with_effect("input_delay", "motor", time=2e-3)
    with pytest.raises((SimulationError, CoreError), match="delay"):
        vpm.FlexibleController(late, plan(), feedback(), NOISE)
