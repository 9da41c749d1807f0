"""Moments of inertia that a real body can have."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vpm import Experiment, Model, identify
from vpm.identify.moments import beside_known, free_moments, on_the_border, real_bodies, to_the_border

BODY = """
name = "arm"
gravity = [0, 0, -9.81]
bodies.arm.mass = 1.0
bodies.arm.inertia = [%s, %s, %s, 0.0, 0.0, 0.0]
joints.hinge = { type = "revolute", parent = "world", child = "arm", axis = [0, 0, 1] }
"""
SIZES = st.tuples(*[st.floats(1e-3, 10.0)] * 3)


def of_points(sizes: tuple[float, float, float]) -> np.ndarray:
    """Moments (3,) of a body from its second moments of mass along the axes, which are positive and nothing else."""
    return np.asarray(np.sum(sizes) - np.array(sizes))


@given(SIZES, SIZES, st.floats(0.0, 10.0))
def test_moments_go_as_far_as_a_body_can_have_them(first: tuple[float, float, float], way: object, far: float) -> None:
    before = of_points(first)
    after = before + far * (np.array(way) - 3.0)
    there = to_the_border(before, after)
    room = np.sum(there) - 2.0 * there
    assert np.all(room > -1e-9 * np.sum(before))
    if np.all(np.sum(after) - 2.0 * after >= 0.0):
        assert there == pytest.approx(after)
    else:
        assert np.min(room) == pytest.approx(0.0, abs=1e-9 * np.sum(np.abs(after) + before))


def test_one_free_moment_lies_between_difference_and_sum_of_the_others() -> None:
    free = "{ value = 0.25, uncertainty = 0.1 }"
    model = Model.from_toml(BODY % (0.1, free, 0.2))
    (names,) = free_moments(model, model.adjustable)
    assert beside_known(model, names) == pytest.approx((0.1, 0.3))
    _, low, high = real_bodies(model, names, np.zeros(1), np.full(1, np.inf))
    assert (low[0], high[0]) == pytest.approx((0.1, 0.3))
    several = Model.from_toml(BODY % (free, free, 0.2))
    assert beside_known(several, *free_moments(several, several.adjustable)) is None


def test_a_moment_is_named_that_no_measurement_tells_from_the_sum_of_the_others() -> None:
    told = []
    for moment in (0.3, 0.3 * (1.0 - 1e-4), 0.28):
        model = Model.from_toml(BODY % (0.1, f"{{ value = {moment}, uncertainty = 0.1 }}", 0.2))
        told.append([names for names, _ in on_the_border(model, list(model.adjustable))])
    (name,) = model.adjustable
    assert told == [[[name]], [[name]], []]


@pytest.mark.parametrize(("highest", "found"), [(0.2, 0.06), (0.05, 0.05)])
def test_bounds_of_two_moments_do_not_hold_back_what_a_slender_body_has(highest: float, found: float) -> None:
    """The motion shows one moment across a rod; the other one, which nothing shows, has to be as large."""
    across = f"{{ value = 0.035, uncertainty = 0.01, min = 1e-3, max = {highest} }}"
    model = Model.from_toml(BODY % (across, 0.002, across) + 'actuators.drive = { joint = "hinge", gain = 1.0 }')
    time, speeds = np.arange(1500) / 300.0, np.array([3.1, 5.3, 7.9])
    phases = speeds * time[:, None]
    channels = {
        "hinge.position": np.sum(np.sin(phases), axis=1) + np.random.default_rng(1).normal(0.0, 1e-5, len(time)),
        "drive.command": -0.06 * np.sum(np.sin(phases) * speeds**2, axis=1),
    }
    fit = identify(model, Experiment.from_arrays(time, channels, model=model))
    values = {name: fit.model.parameters[f"arm.inertia.{name}"].value for name in ("xx", "zz")}
    assert values["zz"] == pytest.approx(found, rel=1e-3)
    assert abs(values["zz"] - values["xx"]) <= 0.002 * (1.0 + 1e-6)
    assert ("arm.inertia.zz" in fit.at_bounds) == (found == highest)
