"""Fits of a cart whose pendulum nobody measures, and which already swings where its log begins; numpy integrates it."""

import numpy as np
import pytest
from numpy.typing import NDArray

from fit_machines import sines
from runge_kutta import ahead
from vpm import Experiment, Model, identify
from vpm.identify import Fit, Fitting, judged_on, profile_intervals
from vpm.numbers import Array

DT, STEPS, NOISE, SECONDS, GRAVITY = 0.004, 4, 1e-5, 8.0, 9.81
#: Masses of cart and bob (kg), viscous friction of rail (N s/m) and pivot (N m s).
TRUTH = {
    "slide.mass": 4.3,
    "bob.mass": 0.93,
    "axis.friction.viscous": 11.0,
    "pivot.friction.viscous": 0.022,
}
FREE, EXPECTED = tuple(TRUTH), np.array(list(TRUTH.values()))
#: Lever of the bob (m), and its inertia about its own centre (kg m^2).
LEVER, OWN = 0.28, 0.008
MODEL = Model.from_toml(
    f"""
    name = "cart"
    gravity = [0.0, 0.0, {-GRAVITY}]
    bodies.slide = {{ mass = 4.0 }}
    bodies.bob = {{ mass = 1.0, center_of_mass = [0.0, 0.0, {-LEVER}], inertia = [{OWN}, {OWN}, {OWN}, 0.0, 0.0, 0.0] }}
    joints.axis = {{ type = "prismatic", parent = "world", child = "slide", axis = [1.0, 0.0, 0.0] }}
    joints.pivot = {{ type = "revolute", parent = "slide", child = "bob", axis = [0.0, 1.0, 0.0] }}
    actuators.drive = {{ joint = "axis", gain = 1.0, command_unit = "N" }}
    effects = [
        {{ type = "viscous_friction", at = "axis", viscous = 12.0 }},
        {{ type = "viscous_friction", at = "pivot", viscous = 0.02 }},
    ]
    """
)


def logs(machines: int, seed: int, swing: float, angle: float = 0.0, spring: float = 0.0) -> list[Experiment]:
    """Logs that begin at angles of the deviation ``swing`` (rad) about ``angle``, and at speeds that go with them.

    Lagrange's equations of x and q: ``(M + m) a - m l cos q e + m l sin q w^2 = F - c v`` and ``(I + m l^2) e - m l cos
    q a + m g l sin q = -b w - k q``, by the classical method of Runge and Kutta, all machines side by side.
    """
    random, samples = np.random.default_rng(seed), round(SECONDS / DT)
    wanted = sines(random, samples, machines, 0.12, 0.25)
    cart, bob, rail, pivot = TRUTH.values()
    turning = OWN + bob * LEVER**2

    def rates(state: Array, force: Array) -> Array:
        _, q, v, w = state
        coupling = bob * LEVER * np.cos(q)
        along = force - rail * v - bob * LEVER * np.sin(q) * w**2
        about = -pivot * w - spring * q - bob * GRAVITY * LEVER * np.sin(q)
        determinant = (cart + bob) * turning - coupling**2
        a, e = (turning * along + coupling * about), (coupling * along + (cart + bob) * about)
        return np.array([v, w, a / determinant, e / determinant])

    state = np.zeros((4, machines))
    state[1] = angle + swing * random.standard_normal(machines)
    state[3] = swing * np.sqrt(bob * GRAVITY * LEVER / turning) * random.standard_normal(machines)
    seen, commands = np.empty((samples, machines)), np.empty((samples, machines))
    for k in range(samples):
        seen[k] = state[0] + NOISE * random.standard_normal(machines)
        speed = (seen[k] - seen[k - 1]) / DT if k else np.zeros(machines)
        commands[k] = command = 300.0 * (wanted[k] - seen[k]) - 12.0 * speed
        for _ in range(STEPS):
            state = ahead(rates, state, DT / STEPS, command)
    time = DT * np.arange(samples)
    return [
        Experiment.from_arrays(
            time, {"axis.position": seen[:, n], "drive.command": commands[:, n]}, {}, name=f"log {n}", model=MODEL
        )
        for n in range(machines)
    ]


def held(fit: Fit) -> NDArray[np.bool_]:
    """Which intervals hold the truth."""
    return np.asarray((fit.intervals[:, 0] <= EXPECTED) & (fit.intervals[:, 1] >= EXPECTED))


@pytest.mark.nightly
def test_a_swing_that_nobody_saw_begin_biases_no_interval() -> None:
    """Of 16 intervals at 95 %, fewer than 12 hold the truth with a chance of 1e-3."""
    fits = [identify(MODEL, log, FREE) for log in logs(16, 21, 0.4)]
    assert np.all(np.sum([held(fit) for fit in fits], axis=0) >= 12)
    assert not any(fit.warnings for fit in fits)
    assert all(fit.first_states == "unknown" and fit.expected.size for fit in fits)
    assert np.sqrt(np.mean([(fit["bob.mass"] / TRUTH["bob.mass"] - 1.0) ** 2 for fit in fits])) < 1e-3


def test_a_swing_far_from_the_tangent_at_rest_is_found() -> None:
    """A pendulum that begins nearly level: there its tangent at rest says nothing of where it goes."""
    (log,) = logs(1, 22, 0.0, angle=1.4)
    fit = identify(MODEL, log, FREE)
    assert np.all(np.abs(fit.values - EXPECTED) < 4.0 * fit.std)
    assert np.all(fit.std < 2e-3 * EXPECTED)
    position, speed = fit.departures[0, 1], fit.departures[0, 3]
    assert position == pytest.approx(1.4, abs=0.02)
    assert abs(speed) < 0.1


@pytest.mark.nightly
def test_settings_of_the_fit_and_ties_know_of_it_too() -> None:
    """Each record has first states of its own."""
    records = logs(2, 23, 0.4)
    fit = identify(MODEL, records, FREE)
    weighed = identify(MODEL, records, FREE, fitting=Fitting(noise="estimated"))
    tied = identify(MODEL, records, FREE, ties={"bob.inertia.zz": "bob.inertia.xx"})
    np.testing.assert_allclose(tied.values, fit.values, rtol=1e-8)
    for found in (fit, weighed):
        assert np.all(np.abs(found.values - EXPECTED) < 4.0 * found.std)
        assert found.departures.shape == (2, 4)


def test_a_profile_and_unseen_records_begin_in_motion_too() -> None:
    """The balance is nearly linear in what is free; from rest it leaves a tenth of the effort of other records."""
    first, second = logs(2, 24, 0.4)
    fit = identify(MODEL, first, FREE)
    profile = profile_intervals(fit, first, ["bob.mass"])[0]
    low, high = fit["bob.mass"] + 1.96 * fit.std[1] * np.array([-1.0, 1.0])
    assert np.abs([profile.low - low, profile.high - high]).max() < 0.1 * fit.std[1]
    assert judged_on(fit, MODEL, second)[1]["axis.effort"][1] < 0.01


def test_what_a_bearing_that_nobody_sees_does_is_missed() -> None:
    """A spring at the pivot, which the model lacks, shows in the cart alone."""
    sprung = MODEL.with_effect("spring", at="pivot", stiffness=0.4)
    stiff = logs(2, 25, 0.4, spring=0.4)
    assert any("an effect" in sentence and "missing" in sentence for sentence in identify(MODEL, stiff, FREE).warnings)
    assert not identify(sprung, stiff, FREE).warnings
