"""Stops, landings, free motion, decrements and impulses: closed forms, and motions by SciPy's DOP853."""

from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from impedance_records import C, K, M, free_motion, noisy
from places import EXAMPLES, script
from vpm import impedance

# ---- impacts ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("quarters", "factor"), [(1, np.pi**2 / 8.0), (2, np.pi**2 / 2.0), (4, 2.0 * np.pi**2)])
def test_factors_of_stops_by_quadrature(quarters: int, factor: float) -> None:
    """D'Imperio (2016), eq 5.27, prints the last of them for a stop."""
    dl, dt = 0.02, 0.07
    w = quarters * np.pi / (2.0 * dt)
    energy = quad(lambda t: C * (dl * w * np.cos(w * t)) ** 2, 0.0, dt, epsabs=0.0, epsrel=1e-12)[0]
    assert energy * dt / (C * dl**2) == pytest.approx(factor, rel=1e-10)
    assert impedance.stop_factor(quarters) == pytest.approx(factor, rel=1e-14)


@pytest.mark.parametrize("ratio", [0.01, 0.03])
def test_stops_of_a_lightly_damped_mass_give_its_damping(ratio: float) -> None:
    c = 2.0 * ratio * np.sqrt(K * M)
    motion = free_motion(K, c, 0.06, rate=1e5, gravity=0.0)
    t, x, v = (np.asarray(motion[name]) for name in ("time", "x", "v"))
    still, back = int(np.argmax(v < 0.0)), int(np.argmax(x < 0.0))
    rebound = impedance.stop_damping(M, 1.0, x[still], t[back], rebound_speed=-v[back])
    # The sine's stroke is that without damping: first order in the ratio.
    assert rebound.damping == pytest.approx(c, rel=4.0 * ratio)
    stop = impedance.stop_damping(M, 1.0, x[still], t[still], stiffness=K)
    assert stop.damping == pytest.approx(c, rel=4.0 * ratio)
    assert abs(stop.roundness - 1.0) < 4.0 * ratio
    assert stop.notes == ()
    # Without the spring all of the energy counts as loss.
    assert impedance.stop_damping(M, 1.0, x[still], t[still]).damping > 10.0 * c


def test_a_stop_that_is_no_sine_says_so() -> None:
    (note,) = impedance.stop_damping(M, 1.0, 0.005, 0.05).notes
    assert "6.37 times that of the assumed sine" in note


@settings(max_examples=40, deadline=None)
@given(k=st.floats(1e3, 3e5), ratio=st.floats(0.01, 3.0))
def test_free_motion_gives_stiffness_and_damping_back(k: float, ratio: float) -> None:
    natural = np.sqrt(k / M)
    c = 2.0 * ratio * natural * M
    record = free_motion(k, c, 10.0 * max(ratio, 1.0) / natural, rate=60.0 * natural * max(ratio, 1.0))
    found = impedance.identify_decay(record, "x", M)
    assert (found.stiffness, found.damping) == pytest.approx((k, c), rel=1e-5)
    assert found.rest == pytest.approx(M * 9.81 / k, rel=1e-4)
    assert (found.natural_frequency, found.damping_ratio) == pytest.approx((natural, ratio), rel=1e-5)


def test_standard_deviations_of_a_decay_are_right() -> None:
    clean = free_motion(K, 300.0, 0.4)
    found = []
    for seed in range(100):
        x = clean["x"] + 5e-5 * np.random.default_rng(seed).standard_normal(400)
        found.append(impedance.identify_decay({"time": clean["time"], "x": x}, "x", M))
    for name, value in (("stiffness", K), ("damping", 300.0)):
        off = np.array([(getattr(one, name) - value) / getattr(one, f"{name}_std") for one in found])
        assert off.std() == pytest.approx(1.0, abs=0.3)
        assert abs(off.mean()) < 0.4


@pytest.mark.parametrize("ratio", [0.01, 0.1, 0.4])
def test_logarithmic_decrement(ratio: float) -> None:
    natural = np.sqrt(K / M)
    record = free_motion(K, 2.0 * ratio * natural * M, 0.6, rate=5e3)
    found = impedance.logarithmic_decrement(record, "x")
    assert found.decrement == pytest.approx(2.0 * np.pi * ratio / np.sqrt(1.0 - ratio**2), rel=2e-4)
    assert found.damping_ratio == pytest.approx(ratio, rel=2e-4)
    assert found.stiffness(M) == pytest.approx(K, rel=5e-4)
    assert found.damping(M) == pytest.approx(2.0 * ratio * natural * M, rel=5e-4)


@settings(max_examples=30, deadline=None)
@given(k=st.floats(1e4, 2e5), ratio=st.floats(0.05, 1.2))
def test_a_landing_gives_stiffness_and_damping_back(k: float, ratio: float) -> None:
    c = 2.0 * ratio * np.sqrt(k * M)
    found = impedance.identify_landing(free_motion(k, c, 0.4, rate=4e3), "x", "f")
    assert (found.stiffness, found.damping) == pytest.approx((k, c), rel=1e-4)
    assert abs(found.force_at_zero) < 1e-4 * k * 0.02
    assert found.misfit < 1e-4


def test_noise_of_the_stroke_does_not_make_a_landing_softer() -> None:
    clean = free_motion(K, 300.0, 0.4)
    corrected, claimed = [], []
    for seed in range(60):
        found = impedance.identify_landing(noisy(clean, seed, 3e-4, 10.0), "x", "f")
        corrected.append((found.stiffness, found.damping))
        claimed.append((found.stiffness_std, found.damping_std))
    values, std = np.array(corrected), np.array(corrected).std(axis=0)
    assert np.all(np.abs(values.mean(axis=0) - [K, 300.0]) < 4.0 * std / np.sqrt(60))
    np.testing.assert_allclose(std, np.sqrt(np.mean(np.square(claimed), axis=0)), rtol=0.4)


def test_the_impulse_of_a_landing_is_weight_and_momentum() -> None:
    motion = free_motion(K, 500.0, 0.3, rate=1e4)
    v = np.asarray(motion["v"])
    balance = impedance.impulse_balance(motion, "f", M, -v[0], -v[-1])
    assert abs(balance.gap) < 1e-4
    assert balance.impulse == pytest.approx(M * 9.81 * balance.duration + M * (v[0] - v[-1]), rel=1e-5)


@pytest.fixture(scope="module")
def example() -> ModuleType:
    return script(EXAMPLES / "hyl" / "impedance.py", "hyl_impedance")


def test_the_linkage_of_the_example_is_that_of_the_model(example: ModuleType) -> None:
    run = example.dropped("ideal", "low", np.random.default_rng(0))
    for joint in ("hip", "knee"):
        own = example.length(joint, run[f"{joint}_rotation.position"])
        # Bearings of 1e8 N/m yield by some um.
        np.testing.assert_allclose(own, run[f"{joint}_cylinder.length"], atol=2e-5)


@pytest.mark.parametrize("name", ["low", "high"])
def test_tests_on_the_leg_find_the_gains_of_its_controllers(
    example: ModuleType, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(example, "CYCLES", 2)
    found = example.repeated("ideal", name, 2)
    for joint in ("hip", "knee"):
        for estimates, truths, within in (
            (found.loops, found.truths, (0.03, 0.03)),
            (found.landings, found.landing_truths, (0.02, 0.03)),
        ):
            row = impedance.repeat_tests(joint, name, "test", estimates[joint])
            known = truths[joint]
            assert row.stiffness.mean == pytest.approx(known.stiffness, rel=within[0])
            assert row.damping.mean == pytest.approx(known.damping, rel=within[1])


def test_the_example_prints_its_tables(
    example: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    pytest.importorskip("matplotlib")
    for name, value in {"CYCLES": 1, "FREQUENCY": 0.5, "SWEEP": (0.4, 0.8)}.items():
        monkeypatch.setattr(example, name, value)
    example.main(2, tmp_path, ("ideal",))
    printed = capsys.readouterr().out
    assert "ideal leg, 2 tests each" in printed
    assert "force 5 ms late" in printed
    assert {path.name for path in tmp_path.iterdir()} == {"impedance_ideal.png", "loops_ideal.png"}


def test_a_late_load_cell_of_the_leg_costs_stiffness_times_delay(
    example: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(example, "CYCLES", 2)
    (_, now, _), (shift, late, told) = example.delays((0, 5))
    assert late.damping - now.damping == pytest.approx(-now.stiffness * 1e-3 * shift, rel=0.03)
    assert told.damping == pytest.approx(now.damping, rel=2e-3)


def test_damping_of_the_hydraulic_leg_is_what_the_valve_is_not_told_of_the_pistons_speed(
    example: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(example, "CYCLES", 2)
    (none, slow), (all_of_it, quick) = example.compensated((0.0, 10.67e-3))
    # The force loop of 3e-7 A/N answers a speed that nothing compensates with (k_v' - k_v) / k_f newtons.
    assert slow.damping - quick.damping == pytest.approx((all_of_it - none) / 3e-7, rel=0.25)
