"""The slow part of a residual, and what a bound lets a candidate do in screening."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from vpm import Experiment, Model
from vpm.catalogue import EFFECTS
from vpm.discrepancy.candidates import Candidate
from vpm.discrepancy.screening import Baseline, probe
from vpm.discrepancy.slow import AVERAGED, has_impacts, slow
from vpm.identify import InverseDynamicsProblem

TEXT = """name = "slide"
gravity = [0.0, 0.0, -9.81]

[bodies.body]
mass = { value = 2.0, uncertainty = 0.2, unit = "kg" }

[joints.axis]
type = "prismatic"
parent = "world"
child = "body"
axis = [1.0, 0.0, 0.0]

[actuators.drive]
joint = "axis"
gain = { value = 1.0, unit = "N/N" }
command_unit = "N"
"""


@pytest.fixture(scope="module")
def problem() -> InverseDynamicsProblem:
    """A slide that is pushed about at 0.8 and 1.7 Hz for 6 s, with forces that no mass explains: they pull it on."""
    time = 1e-3 * np.arange(6000)
    rates = 2.0 * np.pi * np.array([[0.8], [1.7]])
    path = (np.array([[0.1], [0.04]]) * np.sin(rates * time)).sum(0)
    acceleration = -(np.array([[0.1], [0.04]]) * rates**2 * np.sin(rates * time)).sum(0)
    data = {"axis.position": path, "drive.command": -0.5 * acceleration}
    record = Experiment.from_arrays(time, data, units={"axis.position": "m", "drive.command": "N"}, name="log")
    return InverseDynamicsProblem(Model.from_toml(TEXT), [record])


def test_what_is_slow_keeps_what_lasts_and_loses_what_is_over_soon(problem: InverseDynamicsProblem) -> None:
    block = problem.blocks[0]
    lasting = np.sin(2.0 * np.pi * 0.2 / AVERAGED * block.time)
    short = np.sin(2.0 * np.pi * 2.5 / AVERAGED * block.time)
    middle = slice(block.time.size // 4, 3 * block.time.size // 4)
    kept = slow(problem, lasting + short)[middle]
    assert np.std(kept) == pytest.approx(np.std(lasting[middle]) * np.sinc(0.2) ** 2, rel=0.05)


def test_only_play_has_impacts() -> None:
    model = Model.from_toml(TEXT)
    assert not has_impacts(model)
    assert has_impacts(model.with_effect("backlash", at="axis", gap=1e-3, stiffness=1e5))


def test_no_candidate_is_credited_with_what_a_bound_forbids(problem: InverseDynamicsProblem) -> None:
    model = Model.from_toml(TEXT).with_parameters({"body.mass": 1e-9})
    residual, jacobian = problem.evaluate(model, model.theta, [model.index("body.mass")])
    base = Baseline(model, ("body.mass",), residual, jacobian)
    constant = Candidate(EFFECTS["bias_force"], "axis", ({},))
    assert probe(base, problem, constant).drop > 0.9  # a mass below zero explains all of it
    assert probe(replace(base, pushed={"body.mass": -1}), problem, constant).drop < 0.01
    assert probe(replace(base, pushed={"body.mass": 1}), problem, constant).drop > 0.9
