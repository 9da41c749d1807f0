"""Velocities that a controller computed from an encoder beside those of a tachometer."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.signal import butter, lfilter, savgol_filter

from vpm.experiment import Experiment, derived_channels, without_derived
from vpm.numbers import Array

STEP, COUNT, LINE = 2e-3, 3000, 2.0 * np.pi / 20000


def turned(seed: int) -> tuple[Array, Array, np.random.Generator]:
    """Angle of a shaft in lines of its encoder, its true speed, and a generator for other noise."""
    random, time = np.random.default_rng(seed), STEP * np.arange(COUNT)
    tones = [(0.7, 0.4, random.uniform(0.0, 6.0)), (0.3, 1.7, random.uniform(0.0, 6.0))]
    angle = sum(a * np.sin(2.0 * np.pi * f * time + p) for a, f, p in tones)
    speed = sum(2.0 * np.pi * f * a * np.cos(2.0 * np.pi * f * time + p) for a, f, p in tones)
    return LINE * np.round(np.asarray(angle) / LINE), np.asarray(speed), random


def log(angle: Array, speed: Array) -> Experiment:
    values = {"shaft.position": angle, "shaft.velocity": speed}
    return Experiment.from_arrays(
        STEP * np.arange(COUNT), values, units={"shaft.position": "rad", "shaft.velocity": "rad/s"}
    )


def backward(angle: Array) -> Array:
    return np.append(0.0, np.diff(angle)) / STEP


def filtered(angle: Array) -> Array:
    return np.asarray(lfilter(*butter(2, 40.0, fs=1.0 / STEP), backward(angle)))


def averaged(angle: Array) -> Array:
    return np.asarray(lfilter(np.ones(10) / 10.0, [1.0], backward(angle)))


def smoothed(angle: Array) -> Array:
    return np.asarray(savgol_filter(angle, 11, 2, deriv=1, delta=STEP))


def central(angle: Array) -> Array:
    return np.asarray(np.gradient(angle, STEP))


@pytest.mark.parametrize("computed", [backward, central, filtered, averaged, smoothed])
def test_a_speed_that_was_computed_from_an_encoder_tells_nothing_more(computed: Callable[[Array], Array]) -> None:
    angle, _, _ = turned(1)
    record = log(angle, np.round(computed(angle), 6))
    assert derived_channels([record]) == {"shaft.velocity": "shaft.position"}
    (left,) = without_derived([record], ["shaft.velocity"])
    assert left.channels == ("shaft.position",)


@pytest.mark.parametrize("noise", [1e-2, 1e-3, 1e-4])
@pytest.mark.parametrize("late", [0, 5])
def test_a_tachometer_has_noise_of_its_own(noise: float, late: int) -> None:
    angle, speed, random = turned(2)
    record = log(angle, np.roll(speed, late) + noise * random.standard_normal(COUNT))
    assert derived_channels([record]) == {}


def test_a_tachometer_behind_a_filter_has_noise_of_its_own() -> None:
    angle, speed, random = turned(3)
    own = lfilter(*butter(2, 60.0, fs=1.0 / STEP), speed + 1e-2 * random.standard_normal(COUNT))
    assert derived_channels([log(angle, np.asarray(own))]) == {}


def test_one_record_with_a_tachometer_is_enough() -> None:
    angle, speed, random = turned(4)
    mixed = [log(angle, backward(angle)), log(angle, speed + 1e-3 * random.standard_normal(COUNT))]
    assert derived_channels(mixed) == {}
    assert derived_channels(mixed[:1]) == {"shaft.velocity": "shaft.position"}


def test_too_short_a_record_says_nothing() -> None:
    angle, _, _ = turned(5)
    assert derived_channels([log(angle, backward(angle)).trim(stop=0.4)]) == {}
