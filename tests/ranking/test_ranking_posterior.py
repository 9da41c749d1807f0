"""Probabilities of a ranking, and effects that records cannot tell apart."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import norm

from sledge import SLEDGE, pushed
from vpm.model import Model
from vpm.ranking.fit import Fitted, Fitter, View
from vpm.ranking.model_structure import Structure
from vpm.ranking.noise_model import fitted_noise
from vpm.ranking.posterior import apart, log_volume, probabilities
from vpm.ranking.settings import Settings
from vpm.ranking.tracked_records import TrackedRecords, Tracker
from vpm.weighing import Prior

NATS = st.floats(-1e5, 1e5)


def test_an_effect_that_brings_its_price_is_as_probable_as_none() -> None:
    assert probabilities([0.0], 0.3) == pytest.approx([0.5, 0.5], abs=1e-15)
    odds = probabilities([22.0, 12.0], 0.2)
    assert odds[0] / odds[1] == pytest.approx(np.exp(2.0), rel=1e-12)
    assert odds[0] / odds[2] == pytest.approx(np.exp(4.4), rel=1e-12)
    assert probabilities([], 0.2) == pytest.approx([1.0])


@given(st.lists(NATS, max_size=6), st.floats(1e-3, 1.0))
def test_probabilities_are_some_of_a_whole_in_the_order_of_the_evidence(gains: list[float], tempering: float) -> None:
    shares = probabilities(gains, tempering)
    assert np.sum(shares) == pytest.approx(1.0, abs=1e-12)
    assert np.all(shares >= 0.0)
    order = np.argsort(gains)
    assert np.all(np.diff(shares[:-1][order]) >= 0.0)


@given(st.integers(0, 4), st.floats(0.0, 1e3), st.integers(0, 99))
def test_what_records_shrink_is_the_determinant_of_their_information(count: int, size: float, seed: int) -> None:
    slopes = size * np.random.default_rng(seed).standard_normal((30, count))
    exact = np.linalg.slogdet(np.eye(count) + slopes.T @ slopes)[1]
    assert log_volume(slopes) == pytest.approx(exact, rel=1e-9, abs=1e-9)


@given(st.floats(1e8, 1e90), st.floats(0.1, 10.0))
def test_derivatives_that_are_large_and_alike_never_make_records_probable(size: float, ratio: float) -> None:
    """Of two columns that are one but for their size, one direction is known, and the other one is not at all."""
    column = np.random.default_rng(3).standard_normal(50)
    volume = log_volume(size * np.stack([column, ratio * column], axis=1))
    assert volume >= 2.0 * np.log(size * np.hypot(1.0, ratio) * np.linalg.norm(column)) - 1e-9


@pytest.mark.parametrize("distance", [0.5, 3.0])
def test_nats_between_models_tell_how_often_anybody_could_choose(distance: float) -> None:
    """Of two means a distance apart, the better one is the true one in Phi(distance / 2) of all records."""
    random, count, trials = np.random.default_rng(5), 400, 2000
    means = [0.0, distance / np.sqrt(count)]
    right, nats = 0, []
    for _ in range(trials):
        data = random.standard_normal(count)
        first, second = (np.asarray(norm.logpdf(data, loc=mean)) for mean in means)
        right += int(np.sum(first) > np.sum(second))
        nats.append(apart(first, second))
    assert right / trials == pytest.approx(norm.cdf(0.5 * distance), abs=0.03)
    assert np.mean(nats) == pytest.approx(0.5 * distance**2, rel=0.01)


def test_two_names_of_one_inertia_are_alike_and_a_lag_is_not() -> None:
    """A payload on a sledge, and a rotor that turns with it, are both mass; a lag of the drive is not."""
    bare = Model.from_toml(SLEDGE)
    fitter = Fitter(TrackedRecords(bare, [pushed(seed=1, lag=0.008, duration=4.0)], Settings()), Settings())

    def fitted(effect: str, at: str, name: str, size: float, value: float) -> Fitted:
        model = bare.with_effect(effect, at, **{name: value})
        priors = {"sledge.mass": Prior(3.3, 0.33, 0.0, np.inf), "way.friction.viscous": Prior(7.0, 1.5, 0.0, np.inf)}
        priors[model.effect(effect, at).parameter_names[name]] = Prior(value, size, 1e-4, np.inf)
        structure, tracker = Structure(model, model.theta.copy(), priors), Tracker(5.0)
        return fitter.fitted(structure, tracker, View(fitter.noise_of(structure, tracker)))

    payload = fitted("payload", "sledge", "mass", 1.0, 0.01)
    rotor = fitted("rotor_inertia", "way", "inertia", 1.0, 0.01)
    lag = fitted("actuator_lag", "motor", "time_constant", 0.01, 0.004)
    of_payload, of_lag = (fitted_noise(one.residual, fitter.tracked.parts, 12) for one in (payload, lag))
    assert fitter.evidence(payload, of_payload) == pytest.approx(fitter.evidence(rotor, of_payload), abs=1e-3)
    of_rotor, from_payload = (
        apart(fitter.log_density(payload, of_payload), fitter.log_density(other, of_payload)) for other in (rotor, lag)
    )
    assert of_rotor < 1.0 < from_payload
    mine = fitter.log_density(lag, of_lag)
    assert min(apart(mine, fitter.log_density(other, of_lag)) for other in (payload, rotor)) > 1.0
