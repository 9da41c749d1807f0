"""An observer fed sample by sample: the record's filter to rounding, consistent with simulated noise."""

import numpy as np
import pytest

from model_texts import effect_text, on_rail
from two_link_arm import nominal
from vpm.errors import SimulationError
from vpm.model import Model
from vpm.numbers import Array
from vpm.observer import Noise, Observer

CHANNELS = ["shoulder.position", "elbow.position"]
CART = on_rail("cart") + effect_text("spring", "axis", stiffness=50.0, rest=0.0)
STEP = 0.01
CART_NOISE = Noise({"axis.position": 1e-3}, {"axis": 2.0}, {"axis.position": 1e-5, "axis.velocity": 1e-4})


def cart_record(observer: Observer, samples: int, seed: int) -> tuple[Array, Array, Array]:
    """Squared errors of estimates and of innovations in units of what they are said to be, and innovations."""
    random, model = np.random.default_rng(seed), observer.model
    linear = model.linearize()
    transition, _ = linear.sampled(STEP)
    push = 0.5 * STEP * (transition + np.eye(2)) @ np.array([0.0, 0.5])
    state = random.normal(size=2) * [1e-2, 1.0]
    observer.reset()
    errors, sizes, innovations = [], [], []
    for _ in range(samples):
        found = observer.step([state[0] + 1e-3 * random.normal()], [0.0])
        off = found - state
        errors.append(off @ np.linalg.solve(observer.covariance, off))
        innovations.append(observer.innovation[0] / np.sqrt(observer.innovation_covariance[0, 0]))
        sizes.append(innovations[-1] ** 2)
        state = transition @ state + 2.0 * random.normal() * push + random.normal(size=2) * [1e-5, 1e-4]
    return np.array(errors), np.array(sizes), np.array(innovations)


@pytest.mark.parametrize("steady", [False, True])
def test_estimates_err_as_much_as_the_observer_says(steady: bool) -> None:
    observer = Observer(Model.from_toml(CART), STEP, ["axis.position"], CART_NOISE, steady=steady)
    runs = [cart_record(observer, 300, seed) for seed in range(4)]
    errors, sizes, innovations = (np.concatenate([run[part][50:] for run in runs]) for part in range(3))
    # Means of chi squared over 1000 samples; errors of estimates are correlated over some five samples.
    assert np.mean(errors) == pytest.approx(2.0, abs=4.0 * np.sqrt(4.0 * 10.0 / 1000.0))
    assert np.mean(sizes) == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / 1000.0))
    ahead = [np.mean(innovations[lag:] * innovations[:-lag]) for lag in range(1, 6)]
    assert np.abs(ahead).max() < 4.0 / np.sqrt(1000.0)


def test_samples_one_by_one_are_the_filter_of_the_record() -> None:
    arm, random = nominal(), np.random.default_rng(3)
    n, states = len(arm.actuators), len(arm.state_names)
    noise = Noise(dict.fromkeys(CHANNELS, 1e-3), {"shoulder": 0.3, "elbow": 0.1}, {"elbow.velocity": 1e-3})
    observer = Observer(arm, 2e-3, CHANNELS, noise)
    inputs, readings = random.normal(size=(60, n)), 0.01 * random.normal(size=(60, 2))
    spreads = (*noise.placed(arm, CHANNELS), np.array([1e-2, 1e-2, 1.0, 1.0, *[0.01] * (states - 4)]))
    places = [arm.output_channels.index(name) for name in CHANNELS]
    method = "rosenbrock"
    observer = Observer(arm, 2e-3, CHANNELS, noise, deviations=spreads[3], integrator=method)
    innovations, covariances, _, filtered, deviations = arm.core.filter(
        arm.theta, arm.state(), inputs, places, readings, spreads, 2e-3, 1, method
    )
    for row in range(60):
        np.testing.assert_allclose(observer.step(readings[row], inputs[row]), filtered[row], rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(observer.innovation, innovations[row], rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(observer.innovation_covariance, covariances[row], rtol=1e-9)
        np.testing.assert_allclose(np.sqrt(np.diag(observer.covariance)), deviations[row], rtol=1e-9)


def test_a_steady_gain_is_where_the_filter_settles() -> None:
    model = Model.from_toml(CART)
    settled, steady = (Observer(model, STEP, ["axis.position"], CART_NOISE, steady=kind) for kind in (False, True))
    for _ in range(400):
        settled.step([0.0], [0.0])
    steady.step([0.0], [0.0])
    np.testing.assert_allclose(steady.covariance, settled.covariance, rtol=1e-6)
    np.testing.assert_allclose(steady.innovation_covariance, settled.innovation_covariance, rtol=1e-6)
    for observer in (settled, steady):
        observer.step([0.01], [1.0])
    np.testing.assert_allclose(steady.predicted, settled.predicted, rtol=1e-6)


def test_a_reading_that_does_not_come_tells_nothing() -> None:
    observer = Observer(Model.from_toml(CART), STEP, ["axis.position"], CART_NOISE)
    observer.step([0.0], [0.0])
    expected, before = observer.predicted, observer.covariance
    np.testing.assert_array_equal(observer.step([np.nan], [0.0]), expected)
    assert np.isnan(observer.innovation[0])
    assert observer.covariance[0, 0] > before[0, 0]


def test_what_cannot_be_observed_is_refused() -> None:
    model = Model.from_toml(CART)
    with pytest.raises(SimulationError, match="unknown"):
        Observer(model, STEP, ["axis.positon"], CART_NOISE)
    with pytest.raises(SimulationError, match="at least one channel"):
        Observer(model, STEP, [], CART_NOISE)
    with pytest.raises(SimulationError, match=r'"axis.velocity" has none'):
        Observer(model, STEP, ["axis.velocity"], CART_NOISE)
    with pytest.raises(SimulationError, match="time_step"):
        Observer(model, 0.0, ["axis.position"], CART_NOISE)
    free = CART.replace("stiffness = 50.0", "stiffness = 0.0")
    with pytest.raises(SimulationError, match="no steady gain"):
        Observer(Model.from_toml(free), STEP, ["axis.velocity"], Noise({"axis.velocity": 1e-3}), steady=True)
    late = CART + '\n[[effects]]\ntype = "input_delay"\nat = "drive"\ntime = 0.02\n'
    with pytest.raises(SimulationError, match="delay"):
        Observer(Model.from_toml(late), STEP, ["axis.position"], CART_NOISE)
    observer = Observer(model, STEP, ["axis.position"], CART_NOISE)
    with pytest.raises(SimulationError, match="readings"):
        observer.step([0.0, 0.0], [0.0])
    with pytest.raises(SimulationError, match="inputs"):
        observer.step([0.0], [np.nan])
    with pytest.raises(SimulationError, match="covariance"):
        observer.reset(covariance=[[1.0]])
