"""Filters, differences, cut-off frequency and noise, against signals whose truth is known."""

import numpy as np
import pytest
import scipy.signal
from hypothesis import given, settings
from hypothesis import strategies as st

from vpm._core import zero_phase
from vpm.errors import CoreError, ExperimentError
from vpm.experiment import (
    choose_cutoff,
    decimation_for,
    differentiate,
    lowpass,
    noise_std,
    parallel_filter,
    quantisation_step,
)
from vpm.experiment.motion import Motion
from vpm.experiment.signal import anti_alias, differentiator_gain, interpolate, interpolation_gain, settling_samples
from vpm.numbers import Array

RATE = 1000.0


def clock(samples: int, rate: float = RATE) -> Array:
    return np.arange(samples) / rate


def tone_gain(before: Array, after: Array, frequency: float, rate: float, edge: int) -> complex:
    """Complex gain of a tone between two signals, by projection away from the ends."""
    inner = slice(edge, len(before) - edge)
    wave = np.exp(-2j * np.pi * frequency * clock(len(before), rate))[inner] * np.hanning(len(before) - 2 * edge)
    return complex((after[inner] @ wave) / (before[inner] @ wave))


@pytest.mark.parametrize("frequency", [2.0, 20.0, 50.0, 80.0])
def test_lowpass_has_the_gain_of_the_law_and_no_phase(frequency: float) -> None:
    time = clock(8000)
    tone = np.sin(2 * np.pi * frequency * time + 0.4)
    gain = tone_gain(tone, lowpass(tone, RATE, 50.0), frequency, RATE, 1000)
    expected = 1.0 / (1.0 + (np.tan(np.pi * frequency / RATE) / np.tan(np.pi * 50.0 / RATE)) ** 8)
    assert gain.real == pytest.approx(expected, abs=1e-6)
    assert abs(gain.imag) < 1e-6


def test_lowpass_leaves_a_straight_line_alone() -> None:
    line = 3.0 - 2.0 * clock(2000)
    np.testing.assert_allclose(lowpass(line, RATE, 20.0), line, atol=1e-7)


def test_the_filter_has_settled_after_the_stated_samples() -> None:
    impulse = np.zeros(4001)
    impulse[2000] = 1.0
    for cutoff in (10.0, 50.0, 150.0):
        response = lowpass(impulse, RATE, cutoff)
        away = np.abs(response[2000 + settling_samples(RATE, cutoff) :]).max()
        assert away < 1e-3 * np.abs(response).max()


@given(st.integers(0, 4), st.floats(1e-3, 1.0))
def test_differences_are_exact_for_quartics(degree: int, dt: float) -> None:
    time = dt * np.arange(12)
    power = np.polynomial.Polynomial.basis(degree)
    expected = power.deriv()(time)
    scale = float(np.abs(expected).max()) + 1.0
    inner = slice(2, -2)
    np.testing.assert_allclose(differentiate(power(time), dt)[inner], expected[inner], atol=1e-9 * scale / dt)
    if degree <= 2:
        np.testing.assert_allclose(differentiate(power(time), dt), expected, atol=1e-9 * scale / dt)


def test_differences_converge_with_the_fourth_power_of_the_step() -> None:
    errors = []
    for count in (101, 201):
        time = np.linspace(0.0, 1.0, count)
        inner = slice(2, -2)
        error = differentiate(np.sin(9 * time), time[1])[inner] - 9 * np.cos(9 * time)[inner]
        errors.append(np.abs(error).max())
    assert errors[0] / errors[1] == pytest.approx(16.0, rel=0.1)


def test_differentiator_gain_is_that_of_the_differences() -> None:
    time = clock(4000)
    for frequency in (0.0, 10.0, 100.0, 200.0):
        law = float(differentiator_gain(np.array(frequency), RATE))
        if frequency == 0.0:
            assert law == 1.0
            continue
        tone = np.sin(2 * np.pi * frequency * time)
        rate = 2 * np.pi * frequency * np.cos(2 * np.pi * frequency * time)
        gain = tone_gain(rate, differentiate(tone, 1 / RATE), frequency, RATE, 200)
        assert gain.real == pytest.approx(law, abs=1e-7)


def test_parallel_filter_keeps_the_band_and_the_times() -> None:
    time = clock(10_000)
    kept = np.sin(2 * np.pi * 30.0 * time)
    folded = np.sin(2 * np.pi * 90.0 * time)
    inner = slice(200, -200)
    np.testing.assert_allclose(parallel_filter(kept, 10)[inner], kept[::10][inner], atol=0.012)  # twice 0.05 dB
    assert np.abs(parallel_filter(folded, 10)[inner]).max() < 1e-6


@settings(max_examples=25)
@given(st.integers(1, 30), st.integers(80, 400), st.floats(-5, 5), st.floats(-5, 5), st.integers(0, 2**32 - 1))
def test_parallel_filter_is_one_linear_map(decimation: int, count: int, a: float, b: float, seed: int) -> None:
    x, y = np.random.default_rng(seed).standard_normal((2, count, 3))
    together = parallel_filter(a * x + b * y, decimation)
    apart = a * parallel_filter(x, decimation) + b * parallel_filter(y, decimation)
    np.testing.assert_allclose(together, apart, atol=1e-9)
    assert together.shape == (-(-count // decimation), 3)
    np.testing.assert_allclose(parallel_filter(x[:, 1], decimation), parallel_filter(x, decimation)[:, 1], atol=1e-12)


@pytest.mark.parametrize("shape", [(700,), (700, 3), (5, 2), (701, 8), (300, 21), (1, 4), (400, 0), (200, 5, 2)])
def test_forward_and_backward_is_what_scipy_makes_of_it(shape: tuple[int, ...]) -> None:
    values = np.cumsum(np.random.default_rng(1).standard_normal(shape), axis=0)
    if values.ndim > 1:
        values[:, ::4] = 0.0  # some columns are zero all the time
    sections = scipy.signal.cheby1(8, 0.05, 0.8 / 6.0, output="sos")
    expected = scipy.signal.sosfiltfilt(sections, values, axis=0, padlen=min(len(values) - 1, 240))
    constant = abs(scipy.signal.sosfreqz(sections, [0.0])[1][0]) ** 2
    np.testing.assert_allclose(anti_alias(values, 6.0), expected / constant, rtol=1e-11, atol=1e-12)
    if len(values) >= 12:
        np.testing.assert_allclose(parallel_filter(values, 6), expected[::6], rtol=1e-11, atol=1e-12)


def test_a_filter_that_never_comes_to_rest_is_refused() -> None:
    record, double = np.ones((9, 1)), np.array([[1.0, 0.0, 0.0, 2.0, 0.0, 0.0]])
    with pytest.raises(CoreError, match=r"sections\[0\].* must begin its denominator with one .* got 2"):
        zero_phase(double, record, 3, 1)
    with pytest.raises(CoreError, match=r"sections\[0\].* come to rest, got inf"):
        zero_phase([[1.0, 0.0, 0.0, 1.0, -1.0, 0.0]], record, 3, 1)
    with pytest.raises(CoreError, match="`every` must be at least 1"):
        zero_phase([[1.0, 0.0, 0.0, 1.0, 0.0, 0.0]], record, 3, 0)


def test_decimation_follows_the_cutoff() -> None:
    assert decimation_for(1000.0, 100.0) == 10
    assert decimation_for(1000.0, 200.0) == 5
    assert decimation_for(100.0, 1000.0) == 1
    for cutoff in (20.0, 75.0, 130.0):  # the filter takes less than 0.1 % within the band that is kept
        edge = 0.8 * 0.5 * RATE / decimation_for(RATE, cutoff)
        loss = 1.0 - 1.0 / (1.0 + (np.tan(np.pi * edge / RATE) / np.tan(np.pi * cutoff / RATE)) ** 8)
        assert loss < 2e-3


def test_anti_alias_takes_a_factor_that_is_no_integer() -> None:
    time = clock(5000)
    inner = slice(500, -500)
    low, high = np.sin(2 * np.pi * 50 * time), np.sin(2 * np.pi * 300 * time)
    np.testing.assert_allclose(anti_alias(low, 2.5)[inner], low[inner], atol=0.012)
    assert np.abs(anti_alias(high, 2.5)[inner]).max() < 1e-6


def test_interpolation_is_smooth_for_motion_and_straight_for_commands() -> None:
    time = np.array([0.0, 1.0, 2.0, 3.0, 4.0])
    cubic = time**3
    assert interpolate(time, cubic, np.array([2.5]), smooth=True) == pytest.approx(2.5**3)
    assert interpolate(time, cubic, np.array([2.5]), smooth=False) == pytest.approx(0.5 * (8 + 27))


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: lowpass(np.zeros(50), 100.0, 50.0), "between 0 and 50 Hz"),
        (lambda: lowpass(np.zeros(50), 100.0, 0.0), "between 0 and 50 Hz"),
        (lambda: lowpass(np.zeros(50), 100.0, 5.0, order=0), "order from 1 to 20"),
        (lambda: lowpass(np.zeros(3), 100.0, 5.0), "needs at least 4 samples"),
        (lambda: differentiate(np.zeros(2), 0.1), "needs at least 3 samples"),
        (lambda: differentiate(np.zeros(9), 0.0), "positive time between samples"),
        (lambda: parallel_filter(np.zeros(9), 0), "at least 1"),
        (lambda: parallel_filter(np.zeros(9), 5), "needs at least 10 samples"),
        (lambda: choose_cutoff(np.zeros((59, 1)), 100.0), "needs at least 60 samples"),
        (lambda: noise_std(np.zeros(19)), "needs at least 20 samples"),
    ],
)
def test_what_is_refused(call: object, words: str) -> None:
    assert callable(call)
    with pytest.raises(ExperimentError, match=words):
        call()


# ---- noise -----------------------------------------------------------------------------------------------------------


def sines(time: Array) -> tuple[Array, Array]:
    """Slow motion, and its exact acceleration."""
    parts = ((0.2, 0.3), (0.1, 0.7), (0.02, 1.9), (0.01, 3.3))
    position = np.sum([a * np.sin(2 * np.pi * f * time + f) for a, f in parts], axis=0)
    acceleration = np.sum([-a * (2 * np.pi * f) ** 2 * np.sin(2 * np.pi * f * time + f) for a, f in parts], axis=0)
    return np.asarray(position), np.asarray(acceleration)


def ramps(time: Array) -> tuple[Array, Array]:
    """Trapezoidal speed: acceleration that jumps within eight samples, there and back."""
    acceleration = np.where(time % 1 < 0.2, 1.0, np.where(time % 1 > 0.8, -1.0, 0.0)) * np.where(time % 2 < 1, 1, -1)
    for _ in range(2):
        acceleration = np.convolve(acceleration, np.ones(8) / 8, "same")
    dt = time[1] - time[0]
    velocity = np.cumsum(acceleration + np.append(0.0, acceleration[:-1])) * dt / 2
    return np.cumsum(velocity + np.append(0.0, velocity[:-1])) * dt / 2, acceleration


@pytest.mark.parametrize("sigma", [1e-6, 1e-4, 1e-2])
@pytest.mark.parametrize("samples", [300, 20_000])
@pytest.mark.parametrize("motion", [sines, ramps])
def test_noise_is_found_under_motion(sigma: float, samples: int, motion: object) -> None:
    assert callable(motion)
    time = clock(samples)
    values = motion(time)[0] + sigma * np.random.default_rng(7).standard_normal(samples)
    assert noise_std(values) == pytest.approx(sigma, rel=0.2)


def test_noise_forgives_outliers_and_jumps() -> None:
    values = sines(clock(5000))[0] + 1e-4 * np.random.default_rng(1).standard_normal(5000)
    values[1000:] += 0.3
    values[::200] += 0.05
    assert noise_std(values) == pytest.approx(1e-4, rel=0.2)


@given(st.floats(1e-6, 1e6), st.floats(-1e3, 1e3), st.integers(0, 1000))
def test_noise_scales_with_the_signal_and_ignores_an_offset(scale: float, offset: float, seed: int) -> None:
    noise = np.random.default_rng(seed).standard_normal(500)
    assert noise_std(scale * noise) == pytest.approx(scale * noise_std(noise), rel=1e-9)
    assert noise_std(noise + offset) == pytest.approx(noise_std(noise), rel=1e-6)


@pytest.mark.parametrize("step", [5e-8, 1e-5, 2.0 * np.pi / 4096])
def test_quantisation_is_found_and_counts_as_noise(step: float) -> None:
    smooth = sines(clock(20_000))[0]
    values = step * np.round(smooth / step)
    assert quantisation_step(values) == pytest.approx(step, rel=1e-6)
    assert noise_std(values) == pytest.approx(step / np.sqrt(12), rel=0.2)
    assert quantisation_step(values + 0.123456789) == pytest.approx(step, rel=1e-3)


def test_a_grid_is_found_from_differences_that_are_all_larger() -> None:
    steps = np.random.default_rng(3).choice(np.array([0.0, 2.0, 3.0, 5.0]), 400)
    values = np.cumsum(0.01 * steps).astype(np.float64)
    assert quantisation_step(values) == pytest.approx(0.01)


def test_no_quantisation_in_smooth_or_two_valued_signals() -> None:
    assert quantisation_step(sines(clock(3000))[0]) is None
    assert quantisation_step(np.random.default_rng(0).standard_normal(1000)) is None
    assert quantisation_step(np.where(np.arange(100) % 7 > 3, 5.0, 0.0)) is None
    assert quantisation_step(np.zeros(50)) is None
    assert noise_std(np.full(50, 3.0)) == 0.0


# ---- cut-off frequency -----------------------------------------------------------------------------------------------


def acceleration_error(position: Array, truth: Array, rate: float, cutoff: float) -> float:
    """Root mean square error of the derived acceleration, away from the ends."""
    derived = differentiate(differentiate(lowpass(position, rate, cutoff), 1 / rate), 1 / rate)
    inner = slice(len(truth) // 8, -(len(truth) // 8))
    return float(np.sqrt(np.mean((derived - truth)[inner] ** 2)))


@pytest.mark.parametrize(
    ("motion", "samples", "rate", "sigma"),
    [
        (sines, 20_000, 1000.0, 1e-6),
        (sines, 20_000, 1000.0, 1e-4),
        (sines, 20_000, 1000.0, 1e-2),
        (sines, 400, 200.0, 1e-4),
        (sines, 150, 200.0, 1e-4),
        (ramps, 20_000, 1000.0, 1e-7),
        (ramps, 20_000, 1000.0, 1e-5),
        (ramps, 2000, 1000.0, 1e-5),
    ],
)
def test_chosen_cutoff_is_near_the_best(motion: object, samples: int, rate: float, sigma: float) -> None:
    assert callable(motion)
    position, truth = motion(clock(samples, rate))
    position = position + sigma * np.random.default_rng(11).standard_normal(samples)
    choice = choose_cutoff(position[:, None], rate)
    offered = np.geomspace(max(rate / 200, 12 * rate / samples), 0.2 * rate, 60)
    best = min(acceleration_error(position, truth, rate, cutoff) for cutoff in offered)
    # Within 40 % of the least error, or better than 1 % of the acceleration.
    assert acceleration_error(position, truth, rate, choice.cutoff) < max(1.4 * best, 0.01 * float(truth.std()))
    assert choice.noise[0] == pytest.approx(sigma, rel=0.25)


def test_chosen_cutoff_of_a_quantised_and_of_a_noiseless_record() -> None:
    position, truth = sines(clock(20_000))
    for step in (0.0, 1e-5):
        recorded = position if step == 0.0 else step * np.round(position / step)
        cutoff = choose_cutoff(recorded[:, None], RATE).cutoff
        assert acceleration_error(recorded, truth, RATE, cutoff) < 1e-3 * float(truth.std())


def test_chosen_cutoff_keeps_a_fast_tone_behind_a_quiet_band() -> None:
    time = clock(20_000)
    position = 0.2 * np.sin(np.pi * time) + 1e-3 * np.sin(2 * np.pi * 30 * time)
    position = position + 1e-5 * np.random.default_rng(5).standard_normal(time.size)
    choice = choose_cutoff(position[:, None], RATE)
    assert 30.0 < choice.cutoff < 100.0
    assert choice.band[0] == pytest.approx(30.0, rel=0.2)


@given(st.floats(1e-4, 1e4), st.floats(-10, 10), st.floats(0.1, 10))
@settings(max_examples=20)
def test_chosen_cutoff_does_not_depend_on_units(scale: float, offset: float, faster: float) -> None:
    position = sines(clock(2000))[0] + 1e-5 * np.random.default_rng(2).standard_normal(2000)
    reference = choose_cutoff(position[:, None], RATE)
    other = choose_cutoff((scale * (position + offset))[:, None], RATE * faster)
    assert other.cutoff == pytest.approx(faster * reference.cutoff, rel=1e-9)


def test_one_cutoff_serves_several_joints() -> None:
    slow = sines(clock(20_000))[0] + 1e-4 * np.random.default_rng(1).standard_normal(20_000)
    fast = ramps(clock(20_000))[0] + 1e-7 * np.random.default_rng(2).standard_normal(20_000)
    alone = [choose_cutoff(each[:, None], RATE).cutoff for each in (slow, fast)]
    together = choose_cutoff(np.column_stack([slow, fast]), RATE)
    assert alone[0] < together.cutoff < alone[1]
    assert len(together.noise) == 2


def test_a_motionless_record_still_has_a_cutoff() -> None:
    noise = 1e-6 * np.random.default_rng(0).standard_normal((2000, 1))
    choice = choose_cutoff(noise, RATE)
    assert choice.cutoff < 1.2 * 12 * RATE / 2000  # all of it is noise: next to the lowest that is offered
    assert choice.band == (0.0,)
    assert np.isfinite(choose_cutoff(np.zeros((2000, 1)), RATE).cutoff)


@pytest.mark.parametrize(("hold", "order"), [("first_order", 1), ("cubic", 2)])
def test_inputs_that_run_on_are_their_means_until_the_next_sample(hold: str, order: int) -> None:
    """Exact of polynomials: the integral of each over an interval, by its antiderivative; the last one stands."""
    time, dt = clock(40, 10.0), 0.1
    curve = np.polynomial.Polynomial([0.3, -1.2, 2.0][: order + 1])
    rest, inputs = np.zeros((40, 1)), curve(time)[:, None]
    m = Motion(("q",), ("drive.command",), rest, rest, rest, inputs, time, dt, 2.0, 4, 1, ())
    whole = np.diff(curve.integ()(time)) / dt
    assert m.held_as(hold).inputs[:-1, 0] == pytest.approx(whole, abs=1e-12)
    assert m.held_as(hold).inputs[-1, 0] == curve(time[-1])
    assert m.held_as("zero_order") is m


@pytest.mark.parametrize("smooth", [True, False])
def test_the_gain_of_interpolation_is_the_spectrum_of_what_it_makes_of_one_reading(smooth: bool) -> None:
    readings, finer = np.zeros(401), 20
    readings[200] = 1.0
    time = np.arange(401.0)
    drawn = interpolate(time, readings, np.arange(0.0, 400.0, 1.0 / finer), smooth=smooth)
    share = np.asarray(np.fft.rfftfreq(drawn.size, 1.0 / finer), dtype=np.float64)
    inside = share < 3.0  # folding of what is drawn: sinc^2 falls to 1e-3 of itself at 17 times the rate
    seen = np.asarray(np.abs(np.fft.rfft(drawn))[inside] / finer, dtype=np.float64)
    np.testing.assert_allclose(seen, interpolation_gain(share[inside], smooth=smooth), atol=2e-3)
