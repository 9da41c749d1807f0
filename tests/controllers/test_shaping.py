"""Input shapers: closed forms, sampled trains at any step, and the vibration that a shaped motion leaves."""

import numpy as np
import pytest
from numpy.typing import ArrayLike

from test_batched import BEAM
from vpm.errors import ModelError, SimulationError
from vpm.model import Model
from vpm.numbers import Array
from vpm.shaping import Shaper, shaper, vibrations

DAMPED = BEAM.replace("density = 7850.0 }", "density = 7850.0 }\ndamping = { stiffness = 1e-3 }")


def one(kind: str, frequency: float, damping: float) -> Shaper:
    return Shaper(kind, np.array([frequency]), np.array([damping]))


def left(given: ArrayLike, amplitudes: Array, frequency: float, damping: float) -> float:
    """Residual vibration as a share of that of a single impulse: Singer and Seering 1990, equation 7."""
    omega, times = 2.0 * np.pi * frequency, np.asarray(given)
    phase = (damping - 1j * np.sqrt(1.0 - damping**2)) * omega * times
    return float(abs(np.sum(amplitudes * np.exp(phase))) * np.exp(-damping * omega * times[-1]))


@pytest.mark.parametrize("damping", [0.0, 0.05, 0.3])
def test_impulses_are_the_closed_forms(damping: float) -> None:
    ratio = np.exp(-damping * np.pi / np.sqrt(1.0 - damping**2))
    half = 0.5 / (4.0 * np.sqrt(1.0 - damping**2))
    times, amplitudes = one("zv", 4.0, damping).impulses
    np.testing.assert_allclose(times, [0.0, half], rtol=1e-12)
    np.testing.assert_allclose(amplitudes, np.array([1.0, ratio]) / (1.0 + ratio), rtol=1e-12)
    times, amplitudes = one("zvd", 4.0, damping).impulses
    np.testing.assert_allclose(times, [0.0, half, 2 * half], rtol=1e-12)
    np.testing.assert_allclose(amplitudes, np.array([1.0, 2 * ratio, ratio**2]) / (1.0 + ratio) ** 2, rtol=1e-12)
    # With 5 % of error in the frequency, ZVD leaves the square of what ZV leaves, but for the damping.
    assert left(times, amplitudes, 4.2, damping) < 0.2 * left(*one("zv", 4.0, damping).impulses, 4.2, damping)


@pytest.mark.parametrize("time_step", [1e-3, 0.0137, 0.1])
@pytest.mark.parametrize("damping", [0.0, 0.07])
def test_sampled_trains_cancel_exactly_wherever_impulses_fall(time_step: float, damping: float) -> None:
    for kind in ("zv", "zvd"):
        weights = one(kind, 3.3, damping).sampled(time_step)
        times = time_step * np.arange(len(weights))
        assert weights.sum() == pytest.approx(1.0, rel=1e-12)
        assert weights.min() > -1e-12
        assert left(times, weights, 3.3, damping) < 1e-12
    slope = (left(times, weights, 3.3001, damping) - left(times, weights, 3.3, damping)) / 1e-4
    assert slope < 1e-3


def test_several_modes_and_columns_are_shaped_together() -> None:
    both = Shaper("zv", np.array([2.0, 9.0]), np.array([0.01, 0.02]))
    weights = both.sampled(0.004)
    for frequency, damping in zip(both.frequencies, both.damping_ratios, strict=True):
        assert left(0.004 * np.arange(len(weights)), weights, frequency, damping) < 1e-12
    command = np.random.default_rng(1).normal(size=(40, 2))
    shaped = both.apply(command, 0.004)
    assert shaped.shape == (40 + len(weights) - 1, 2)
    np.testing.assert_allclose(shaped[-1], command[-1], rtol=1e-12)
    np.testing.assert_allclose(shaped[0], command[0], rtol=1e-12)
    # Where the command is zero before and after it is a plain convolution.
    padded = np.concatenate([[0.0], command[:, 0], [0.0]])
    np.testing.assert_allclose(both.apply(padded, 0.004), np.convolve(padded, weights), atol=1e-12)


def test_frequencies_are_those_of_the_locked_machine() -> None:
    model = Model.from_toml(DAMPED)
    frequencies, damping = vibrations(model, [0.2, 0.4])
    np.testing.assert_allclose(frequencies, model.natural_frequencies([0.2, 0.4]), rtol=1e-6)
    # Damping in proportion to stiffness: zeta = beta omega / 2, but for the weight's small share of the stiffness.
    np.testing.assert_allclose(damping, 1e-3 * np.pi * frequencies, rtol=0.05)


@pytest.mark.parametrize("kind", ["zv", "zvd"])
def test_a_shaped_motion_leaves_the_flexible_arm_at_rest(kind: str) -> None:
    model, dt, tail = Model.from_toml(DAMPED), 1e-3, 600
    own = shaper(model, [0.6, 0.0], kind)
    time = np.arange(0.0, 0.1 + dt / 2, dt) / 0.1
    # A quintic turn by 0.6 rad of the shoulder in a tenth of a second.
    turn = 0.6 * np.stack(
        [
            10 * time**3 - 15 * time**4 + 6 * time**5,
            (30 * time**2 - 60 * time**3 + 30 * time**4) / 0.1,
            (60 * time - 180 * time**2 + 120 * time**3) / 0.01,
        ],
        axis=1,
    )
    rest = model.equilibrium([0.6, 0.0])[0][2:]

    def residual(motion: Array) -> float:
        motion = np.concatenate([motion, np.repeat(motion[-1:], tail, axis=0)])
        q, v, a = (np.column_stack([column, np.zeros(len(column))]) for column in motion.T)
        _, states, _ = model.core.simulate_prescribed(model.theta, q, v, a, dt, 1, "rosenbrock")
        return float(np.abs(states[-tail:, 2:4] - rest).max())

    plain, shaped = residual(turn), residual(own.apply(turn, dt))
    assert plain > 1e-3
    assert shaped < 0.05 * plain


def test_what_cannot_be_shaped_is_refused() -> None:
    model = Model.from_toml(DAMPED)
    with pytest.raises(SimulationError, match="zv or zvd"):
        shaper(model, kind="ei")
    with pytest.raises(SimulationError, match=r"2 vibrations.*3 cannot"):
        shaper(model, modes=3)
    with pytest.raises(ModelError, match="no joint"):
        shaper(model, held=["elbow"])
    with pytest.raises(SimulationError, match="too far apart"):
        one("zv", 4.0, 0.0).sampled(0.2)
    with pytest.raises(SimulationError, match="damping ratio 1"):
        one("zv", 4.0, 1.0)
    with pytest.raises(SimulationError, match="at least one sample"):
        one("zv", 4.0, 0.0).apply([], 1e-3)
