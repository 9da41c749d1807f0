"""The servo-cylinder on its bench, identified as a grey box: acceptance, coverage, the start of the listing."""

import runpy
from types import SimpleNamespace

import numpy as np
import pytest

from places import ROOT

bench = SimpleNamespace(**runpy.run_path(str(ROOT / "examples/servo_cylinder/greybox.py"), run_name="bench"))
TWO = bench.FREE[:2]


def test_bulk_modulus_and_flow_gain_come_back_from_the_start_of_the_listing() -> None:
    """hyd.greybox.recovery: 1e-4 without noise, from 1e8 Pa and 1e-6; half a second of chirp at 1 kHz."""
    current = bench.chirp(0.5)
    t = np.arange(current.size) * 1e-3
    np.testing.assert_allclose(current, 0.5e-3 * np.sin((2.0 * np.pi + 38.0 * np.pi * t) * t))
    fit = bench.fitted(bench.measured(current, seed=None, setup=bench.FITTED), TWO)
    assert fit.start.tolist() == [1e8, 1e-6]
    np.testing.assert_allclose(fit.values, [1.2e9, 6.68153e-6], rtol=1e-4)
    assert fit.warnings == ()


def test_finer_steps_of_the_truth_do_not_bias_what_noise_allows() -> None:
    """Without noise, data in steps a quarter as long: off by less than a tenth of what 20 kPa and 20 um do."""
    fine = bench.fitted(bench.measured(bench.chirp(0.5), seed=None), TWO)
    noisy = bench.fitted(bench.measured(bench.chirp(0.5), seed=0), TWO)
    truth = np.array([bench.rig().parameters[name].value for name in TWO])
    assert np.all(np.abs(fine.values - truth) < 0.1 * noisy.std)


def test_one_fit_of_all_six_from_the_listing_fails_and_says_so_and_many_starts_do_not() -> None:
    record = bench.measured(bench.random_gaussian(0.5), seed=1)
    alone = bench.fitted(record)
    many = bench.fitted(record, starts=bench.STARTS)
    assert many.agreeing >= 3
    truth = np.array([bench.rig().parameters[name].value for name in bench.FREE])
    assert np.all(np.abs(many.values - truth) < 4.0 * many.std)
    gap = "servo.pressure_a"
    assert many.after[gap][0] == pytest.approx(bench.NOISE[gap], rel=0.15)
    if (
        alone.after[gap][0] > 1.5 * many.after[gap][0]
    ):  # a wrong valley: a parameter runs to a bound, or starts disagree
        assert alone.warnings


def test_intervals_cover_the_truth() -> None:
    """Of 72 intervals, 68 are expected to hold the truth; fewer than 57 would be less than four in five."""
    assert np.sum(bench.coverage(12)) * 12 >= 57


def test_noise_is_estimated() -> None:
    fit = bench.fitted(bench.measured(bench.chirp(0.5), seed=3), TWO)
    for channel, std in bench.NOISE.items():
        quantised = np.hypot(std, bench.QUANTUM[channel] / np.sqrt(12.0))
        assert fit.noise[channel] == pytest.approx(quantised, rel=0.1)
