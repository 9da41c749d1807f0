"""Numbers that make probabilities true: found again from outcomes that were drawn with them."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from blind import reliability as proving
from blind.answer import Answer, Named, Weighed
from vpm.errors import DiagnosisError
from vpm.ranking.calibration import Calibration, Round, calibrated, calibration_error, reliability, shipped
from vpm.ranking.posterior import robust_probabilities
from vpm.ranking.settings import Settings


def drawn(generator: np.random.Generator, truth: Calibration) -> Round:
    """A round in which what is missing is drawn with the probabilities of these numbers."""
    gains = tuple(map(float, generator.uniform(-2.0, 30.0, 4) + 20.0 * generator.integers(0, 2)))
    place = int(generator.choice(6, p=robust_probabilities(gains, truth.tempering, truth.astray)))
    return Round(gains, tuple(k == place for k in range(4)), missing=place != 4)


def test_the_numbers_behind_outcomes_are_found_again() -> None:
    truth = Calibration(0.12, 0.06)
    generator = np.random.default_rng(5)
    found = calibrated([drawn(generator, truth) for _ in range(3000)], "5", 3000)
    assert found.tempering == pytest.approx(truth.tempering, rel=0.1)
    assert found.astray == pytest.approx(truth.astray, rel=0.25)
    assert (found.seeds, found.cases) == ("5", 3000)


@given(st.lists(st.floats(-50.0, 200.0), min_size=1, max_size=5), st.floats(1e-3, 1.0), st.floats(1e-3, 0.5))
def test_all_that_may_be_true_is_certain_together(gains: list[float], tempering: float, astray: float) -> None:
    count = len(gains)
    truths = [Round(tuple(gains), tuple(k == place for k in range(count)), missing=True) for place in range(count)]
    truths += [Round(tuple(gains), (False,) * count, missing=missing) for missing in (False, True)]
    assert sum(one.likelihood(tempering, astray) for one in truths) == pytest.approx(1.0, abs=1e-12)


def test_true_probabilities_have_a_small_error_and_boasts_a_large_one() -> None:
    generator = np.random.default_rng(8)
    stated = generator.uniform(0.2, 1.0, 5000)
    right = generator.uniform(size=5000) < stated
    honest, boasting = (calibration_error(reliability(list(p), list(right))) for p in (stated, np.sqrt(stated)))
    assert honest < 0.02
    assert boasting > 0.08
    assert np.isnan(calibration_error(reliability([], [])))
    bins = reliability([0.55, 0.6, 0.99], [True, False, True])
    assert [(one.right, one.count) for one in bins] == [(1, 2), (1, 1)]
    assert bins[0].stated == pytest.approx(0.575)


def test_nothing_to_calibrate_on_is_said() -> None:
    with pytest.raises(DiagnosisError, match="no answer weighed any evidence"):
        calibrated([], "", 0)


def test_the_shipped_numbers_are_those_of_the_settings_and_say_where_they_come_from() -> None:
    settings = Settings()
    assert (settings.tempering, settings.astray) == (shipped().tempering, shipped().astray)
    assert shipped().cases > 100
    assert shipped().seeds


# ---- answers of the proving ground -----------------------------------------------------------------------------------


def answer(hidden: str, *weighed: tuple[int, str, float, bool], alike: tuple[str, ...] = (), seed: int = 0) -> Answer:
    """An answer that weighed effects at the axis in rounds, of which those that came in were named."""
    told = tuple(Weighed(number, name, "axis", evidence, accepted) for number, name, evidence, accepted in weighed)
    named = tuple(Named(one.name, "axis", probability=0.5, alike=alike) for one in told if one.accepted)
    hid = tuple(Named(name, "axis") for name in hidden.split())
    return Answer("axis_linear", "single", (hidden,), seed, 1.0, True, hid, (9.0,), named=named, weighed=told)


def test_what_another_name_is_was_not_missing() -> None:
    odds = Settings().odds
    found = proving.rounds([
        answer("spring bias_force", (1, "spring", 90.0, True), (1, "payload", 50.0, False), (2, "spring", 20.0, False)),
        answer("spring", (1, "spring", 90.0, True), (2, "hysteresis", 30.0, True)),
    ])  # fmt: skip
    assert [one.right for one in found] == [(True, False), (True,), (False,)]
    assert [one.missing for one in found] == [True, True, False]
    assert found[0].gains == (90.0 - odds, 50.0 - odds)


def test_a_class_is_right_if_it_holds_what_was_hidden() -> None:
    rival = answer("spring", (1, "hysteresis", 90.0, True), alike=("spring at axis",))
    wrong = answer("spring", (1, "hysteresis", 90.0, True))
    assert [right for _, right in proving.stated([rival, wrong])] == [True, False]
    told = proving.restated([wrong], Calibration(0.1, 0.2))[0].named[0].probability
    assert told == pytest.approx(robust_probabilities([90.0 - Settings().odds], 0.1, 0.2)[0])


def test_half_of_the_seeds_tell_how_true_the_other_half_makes_probabilities(tmp_path: Path) -> None:
    found = [answer("spring", (1, "spring", 60.0, True), (1, "payload", 30.0, False), seed=seed) for seed in range(20)]
    found += [answer("payload", (1, "spring", 60.0, True), (1, "payload", 30.0, False), seed=seed) for seed in (3, 4)]
    fitted, told = proving.report(found)
    assert fitted.cases == 22
    assert "calibrated on 11 cases" in told
    assert "on 11 named classes of the other 11 cases" in told
    path = fitted.save(tmp_path / "calibration.json")
    assert Calibration.load(path) == fitted
