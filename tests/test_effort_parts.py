"""What is remembered part by part is what the machine as a whole gives, whatever was asked before."""

from __future__ import annotations

import sys
from collections.abc import Callable, Hashable, Sequence
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

import vpm
import vpm._core
from model_texts import TWO_LINKS
from vpm.identify import InverseDynamicsProblem
from vpm.identify.drive_memory import DriveMemory
from vpm.identify.effort_parts import part_delivered, parts_needed

Array = NDArray[np.float64]

DRIVES = "".join(
    f"""
[actuators.{joint}_motor]
joint = "{joint}"
gain = 2.0
command_unit = "A"
[sensors.{joint}_encoder]
measures = "{joint}.position"
"""
    for joint in ("hip", "knee")
)
# Thicker, so that a tenth more or less of any inertia is still that of a body.
LINKS = TWO_LINKS.replace("[0.1, 0.1, 0.01,", "[0.1, 0.1, 0.05,").replace("[0.05, 0.05, 0.01,", "[0.05, 0.05, 0.03,")
NOMINAL = vpm.Model.from_toml('name = "leg"\ngravity = [0.0, 0.0, -9.81]\n' + LINKS + DRIVES)
JOINT_EFFECTS = {
    "viscous_friction": {"viscous": 0.4},
    "coulomb_friction": {"coulomb": 0.7, "transition_velocity": 0.02},
    "asymmetric_friction": {"coulomb_difference": 0.3, "viscous_difference": 0.1},
    "stribeck_friction": {"stribeck": 0.4, "stribeck_velocity": 0.1},
    "bias_force": {"force": 0.6},
    "spring": {"stiffness": 3.0, "rest": 0.1},
    "torque_ripple": {"period": 0.3, "cosine": 0.2, "sine": -0.1},
    "hysteresis": {"force": 0.5, "displacement": 0.02},
    "end_stop": {"stiffness": 50.0, "damping": 1.0, "low": -0.2, "high": 0.25},
    "rotor_inertia": {"inertia": 0.05},
    "empirical_force": {"middle": 0.0, "reach": 0.5, "speed": 2.0, "transition_velocity": 0.1, "dry": 0.3, "drag": 0.2},
}
OTHER_EFFECTS = {
    ("payload", "shank"): {"mass": 0.4, "z": -0.3},
    ("input_delay", "hip_motor"): {"time": 0.003},
    ("actuator_lag", "knee_motor"): {"time_constant": 0.004},
    ("saturation", "hip_motor"): {"limit": 1.5},
    ("sensor_gain", "knee_encoder"): {"value": 1.02},
    ("sensor_delay", "hip_encoder"): {"time": 0.002},
    ("sensor_offset", "hip_encoder"): {"value": 0.03},
}
EFFECTS = {(name, joint): values for name, values in JOINT_EFFECTS.items() for joint in ("hip", "knee")} | OTHER_EFFECTS


def record() -> vpm.Experiment:
    """Two tones on each joint; what the commands are does not matter."""
    time = 1e-3 * np.arange(1200)
    values = {
        "hip.position": 0.3 * np.sin(9.0 * time) + 0.05 * np.sin(31.0 * time + 1.0),
        "knee.position": 0.4 * np.sin(7.0 * time + 0.5) - 0.04 * np.cos(40.0 * time),
        "hip_motor.command": np.sin(11.0 * time),
        "knee_motor.command": np.cos(13.0 * time),
    }
    units = {name: "A" if name.endswith("command") else "rad" for name in values}
    return vpm.Experiment.from_arrays(time, values, units=units)


@pytest.fixture(scope="module")
def problem() -> InverseDynamicsProblem:
    """It is shared by all examples, so that whatever one of them left behind is there for the next."""
    return InverseDynamicsProblem(NOMINAL, [record()], cutoff=60.0)


def whole(problem: InverseDynamicsProblem, model: vpm.Model, theta: Array, columns: list[int]) -> tuple[Array, Array]:
    """The same without any parts: the machine at once, filtered afterwards."""
    m = problem.motions[0]
    motion = (m.position, m.velocity, m.acceleration, m.inputs, m.dt)
    required, applied, slopes = model.core.inverse_dynamics(theta, *motion, columns)
    counts = np.column_stack([block.moving * block.weight for block in problem.blocks])
    residual = m.parallel(applied - required) * counts
    jacobian = m.parallel(slopes.reshape(len(slopes), -1)).reshape(len(counts), counts.shape[1], len(columns))
    weighed = -(jacobian * counts[:, :, None]).transpose(1, 0, 2)
    return residual.T.ravel(), weighed.reshape(residual.size, len(columns))


def near(found: Array, expected: Array, size: float) -> None:
    assert np.abs(found - expected).max(initial=0.0) <= 1e-10 * size


@given(data=st.data())
@settings(max_examples=60, deadline=None)
def test_remembered_parts_are_what_the_whole_machine_gives(
    data: st.DataObject, problem: InverseDynamicsProblem
) -> None:
    model = NOMINAL
    for name, site in data.draw(st.lists(st.sampled_from(sorted(EFFECTS)), max_size=5, unique=True)):
        model = model.with_effect(name, at=site, **EFFECTS[name, site])
    assert parts_needed(model) is not None
    assert part_delivered(model) is not None
    theta = model.theta.copy()
    moved = data.draw(st.lists(st.sampled_from(range(theta.size)), max_size=4, unique=True))
    for place in moved:
        theta[place] *= data.draw(st.sampled_from([0.9, 1.0, 1.05]))
    columns = data.draw(st.lists(st.sampled_from(range(theta.size)), max_size=6, unique=True))
    residual, jacobian = problem.evaluate(model, theta, columns)
    expected, slopes = whole(problem, model, theta, columns)
    near(residual, expected, float(np.abs(expected).max()))
    for mine, other in zip(jacobian.T, slopes.T, strict=True):
        near(mine, other, float(np.abs(other).max(initial=0.0)) + 1e-9)


def test_what_is_linear_is_worked_out_once(problem: InverseDynamicsProblem, monkeypatch: pytest.MonkeyPatch) -> None:
    model = NOMINAL.with_effect("coulomb_friction", at="hip", coulomb=0.7).with_effect("payload", at="shank", mass=0.4)
    columns = [model.index(name) for name in ("thigh.mass", "shank.payload.mass", "hip.friction.coulomb")]
    first, jacobian = problem.evaluate(model, model.theta, columns)
    asked: list[Sequence[str]] = []
    recall = DriveMemory.recall

    def counted(
        memory: DriveMemory, key: Hashable, names: Sequence[str], work: Callable[[Sequence[str]], tuple[Array, Array]]
    ) -> tuple[Array, Array]:
        def told(missing: Sequence[str]) -> tuple[Array, Array]:
            asked.append(missing)
            return work(missing)

        return recall(memory, key, names, told)

    monkeypatch.setattr(DriveMemory, "recall", counted)
    theta = model.theta.copy()
    theta[columns] *= [1.2, 0.5, 3.0]
    moved, again = problem.evaluate(model, theta, columns)
    assert not asked
    np.testing.assert_array_equal(again, jacobian)
    near(moved, first + jacobian @ (theta - model.theta)[columns], float(np.abs(moved).max()))


def test_the_order_of_questions_does_not_matter() -> None:
    model = NOMINAL.with_effect("stribeck_friction", at="knee", stribeck=0.4, stribeck_velocity=0.1)
    names = ("shank.mass", "knee.friction.stribeck", "knee.friction.stribeck_velocity")
    columns = [model.index(name) for name in names]
    theta = model.theta.copy()
    theta[columns[:2]] *= 1.1
    answers = []
    for first in (model.theta, theta):
        problem = InverseDynamicsProblem(NOMINAL, [record()], cutoff=60.0)
        problem.evaluate(model, first, columns[:1])
        answers.append([problem.evaluate(model, each, columns) for each in (theta, model.theta)])
    for one, other in zip(*answers, strict=True):
        np.testing.assert_array_equal(one[0], other[0])  # to the last digit: threads ask in any order
        np.testing.assert_array_equal(one[1], other[1])


def test_values_that_make_no_machine_are_refused(problem: InverseDynamicsProblem) -> None:
    problem.evaluate(NOMINAL, NOMINAL.theta)
    theta = NOMINAL.theta.copy()
    theta[NOMINAL.index("thigh.inertia.xx")] = 10.0
    with pytest.raises(ValueError, match="inertia"):
        problem.evaluate(NOMINAL, theta)


def test_a_share_of_the_load_does_not_add_up() -> None:
    shape = {"middle": 0.0, "reach": 0.5, "speed": 2.0, "transition_velocity": 0.1}
    assert parts_needed(NOMINAL.with_effect("empirical_force", at="hip", load_dry=0.1, **shape)) is None


def test_a_memory_forgets_what_is_oldest(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys.modules["vpm.identify.drive_memory"], "MOST_NUMBERS", 50)
    memory = DriveMemory(lambda values: values)
    worked: list[int] = []

    def work(key: int, names: Sequence[str]) -> tuple[Array, Array]:
        worked.append(key)
        return np.ones((10, 1)), np.ones((10, 1, len(names)))

    for key in (1, 2, 3, 3, 2, 1):
        memory.recall(key, ["a"], partial(work, key))
    assert worked == [1, 2, 3, 1]


def test_flights_are_those_of_one_step_after_the_other() -> None:
    generator = np.random.default_rng(5)
    pull = np.cumsum(generator.standard_normal(3000)) * 0.05
    gaps, rates, dampings = np.array([1e-5, 3e-4, 2e-3]), np.array([50.0, 90.0, 200.0]), np.array([0.5, 1.0, 0.2])
    swing = vpm._core.soft_flights(pull, gaps, rates, dampings, 1e-3)
    np.testing.assert_allclose(swing, step_by_step(pull, 0.5 * gaps, rates, dampings, 1e-3), rtol=1e-9, atol=1e-9)
    with pytest.raises(ValueError, match="give one of each"):
        vpm._core.soft_flights(pull, gaps, rates[:2], dampings, 1e-3)


def step_by_step(pull: Array, half: Array, rates: Array, dampings: Array, interval: float) -> Array:
    """All plays together, one sample after the other."""
    place, speed, swing = np.zeros_like(half), np.zeros_like(half), np.zeros((pull.size, half.size))
    for k, acceleration in enumerate(pull.tolist()):
        beyond = place - np.clip(place, -half, half)
        new = speed + interval * (acceleration - rates**2 * beyond)
        new = np.where(beyond == 0.0, new, new / (1.0 + 2.0 * interval * dampings * rates))
        swing[k], speed = (new - speed) / interval, new
        place = place + interval * speed
    return swing
