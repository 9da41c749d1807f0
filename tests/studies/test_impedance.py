"""Loops: closed forms, planted laws of loss, what noise and delay do, repeated tests, and bad input."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from impedance_records import Array, C, K, M, Record, ellipse, free_motion, noisy
from vpm import Experiment, impedance
from vpm.errors import ExperimentError, IdentificationError
from vpm.results import Result

# ---- loops -----------------------------------------------------------------------------------------------------------


@settings(max_examples=60, deadline=None)
@given(
    k=st.floats(1e2, 1e7),
    lag=st.floats(1e-3, 10.0),
    amplitude=st.floats(1e-5, 1.0),
    frequency=st.floats(1e-2, 50.0),
    per_cycle=st.integers(16, 400),
    cycles=st.floats(1.0, 7.9),
)
def test_the_ellipse_of_a_spring_with_a_damper_gives_both_back(
    k: float, lag: float, amplitude: float, frequency: float, per_cycle: int, cycles: float
) -> None:
    c = lag * k / (2.0 * np.pi * frequency)  # lag: tangent of the loss angle
    record = ellipse(k, c, amplitude, frequency, cycles, per_cycle)
    loop = impedance.identify_loop(record, "x", "f", frequency=frequency)
    assert loop.stiffness == pytest.approx(k, rel=1e-9 * max(1.0, lag))
    assert loop.damping == pytest.approx(c, rel=1e-9 * max(1.0, 1.0 / lag))
    assert loop.energy == pytest.approx(
        np.pi * c * 2.0 * np.pi * frequency * amplitude**2, rel=1e-8 * max(1.0, 1.0 / lag)
    )
    assert loop.amplitude == pytest.approx(amplitude, rel=1e-4)
    assert loop.loss_factor == pytest.approx(lag, rel=1e-7 * max(1.0, 1.0 / lag))
    assert loop.cycle_energy.size == int(round(cycles * per_cycle) / per_cycle + 0.01)


@settings(max_examples=30, deadline=None)
@given(
    frequency=st.floats(0.1, 20.0), cycles=st.floats(2.2, 9.0), phase=st.floats(0.0, 6.0), slope=st.floats(-1.0, 1.0)
)
def test_the_frequency_is_found(frequency: float, cycles: float, phase: float, slope: float) -> None:
    t = np.arange(0.0, cycles / frequency, 1.0 / (150.0 * frequency))
    w = 2.0 * np.pi * frequency
    x = np.sin(w * t + phase) + slope * t / t[-1]
    f = 5.0 * np.sin(w * t + phase) + 2.0 * w * np.cos(w * t + phase)
    loop = impedance.identify_loop({"time": t, "x": x, "f": f}, "x", "f")
    assert loop.frequency == pytest.approx(frequency, rel=1e-5)
    assert loop.stiffness == pytest.approx(5.0, abs=1e-3 * w)
    assert loop.damping == pytest.approx(2.0, rel=1e-3)


def test_energy_of_a_motion_with_harmonics_weighs_them_with_the_square_of_their_order() -> None:
    """``E = pi c omega sum n^2 X_n^2``, against quadrature of the power; n to the first power is structural damping."""
    w, parts = 2.0 * np.pi * 0.5, ((1, 5e-3, 0.0), (2, 2e-3, 0.7), (5, 0.5e-3, 2.0))

    def speed(t: Array) -> Array:
        return np.asarray(np.sum([n * w * a * np.cos(n * w * t + p) for n, a, p in parts], axis=0))

    t = np.arange(4000) / 500.0
    x = np.sum([a * np.sin(n * w * t + p) for n, a, p in parts], axis=0)
    loop = impedance.identify_loop({"time": t, "x": x, "f": K * x + C * speed(t)}, "x", "f")
    energy = quad(lambda s: C * float(speed(np.array(s))) ** 2, 0.0, 2.0, epsabs=0.0, epsrel=1e-11, limit=200)[0]
    travelled = quad(lambda s: abs(float(speed(np.array(s)))), 0.0, 2.0, limit=500)[0]
    assert loop.energy == pytest.approx(energy, rel=1e-7)
    assert loop.energy == pytest.approx(np.pi * C * w * sum(n**2 * a**2 for n, a, _ in parts), rel=1e-7)
    assert loop.structural_measure == pytest.approx(np.pi * sum(n * a**2 for n, a, _ in parts), rel=1e-7)
    assert loop.path == pytest.approx(travelled, rel=1e-4)
    assert (loop.stiffness, loop.damping) == pytest.approx((K, C), rel=1e-7)


def test_the_energy_is_the_area_of_the_polygon_of_any_loop() -> None:
    """A hardening spring with dry friction: force harmonics that the motion lacks do no work."""
    t = np.arange(20000) / 5000.0
    x, v = np.sin(2.0 * np.pi * t), np.cos(2.0 * np.pi * t)
    f = 2.0 * x + x**3 + 0.3 * np.sign(v)
    loop = impedance.identify_loop({"time": t, "x": x, "f": f}, "x", "f")
    one = slice(0, 5000)
    area = abs(0.5 * np.sum(f[one] * (np.roll(x[one], -1) - np.roll(x[one], 1))))
    assert loop.energy == pytest.approx(area, rel=1e-3)
    assert loop.energy == pytest.approx(4.0 * 0.3, rel=1e-3)
    assert loop.coulomb_force == pytest.approx(0.3, rel=1e-3)
    assert loop.stiffness == pytest.approx(2.0 + 0.75, rel=1e-3)
    assert any("harmonics that no linear spring" in note for note in loop.notes)


@pytest.mark.parametrize("drift", [0, 1])
def test_drift_is_taken_out(drift: int) -> None:
    record = ellipse(cycles=3.3)
    t = np.asarray(record["time"])
    record |= {"x": record["x"] + 0.3 + 1e-3 * t, "f": 400.0 + 50.0 * t + record["f"]}
    loop = impedance.identify_loop(record, "x", "f", frequency=0.5, drift=drift)
    if drift:
        assert (loop.stiffness, loop.damping) == pytest.approx((K, C), rel=1e-6)
    else:
        assert abs(loop.stiffness / K - 1.0) > 1e-3


def test_steps_need_not_be_even() -> None:
    t = np.sort(np.random.default_rng(3).uniform(0.0, 8.0, 1500))
    x, v = 5e-3 * np.sin(np.pi * t), 5e-3 * np.pi * np.cos(np.pi * t)
    loop = impedance.identify_loop({"time": t, "x": x, "f": K * x + C * v}, "x", "f", frequency=0.5)
    assert (loop.stiffness, loop.damping) == pytest.approx((K, C), rel=1e-6)


def test_a_force_that_answers_is_the_same_loop() -> None:
    record = ellipse()
    turned = {**record, "f": 700.0 - np.asarray(record["f"])}
    loop = impedance.identify_loop(turned, "x", "f", sense="reaction")
    assert (loop.stiffness, loop.damping, loop.mean_force) == pytest.approx((K, C, 700.0), rel=1e-6)
    assert 'sense="reaction"' in impedance.identify_loop(turned, "x", "f").notes[0]


def test_experiments_are_records() -> None:
    record = ellipse()
    log = Experiment.from_arrays(
        record["time"], {"rod.length": record["x"], "rod.force": record["f"]}, {"rod.length": "m", "rod.force": "N"}
    )
    loop = impedance.identify_loop(log, "rod.length", "rod.force")
    assert (loop.stiffness, loop.damping) == pytest.approx((K, C), rel=1e-6)


def test_noise_makes_no_bias_and_its_standard_deviations_are_right() -> None:
    """Noise of 10 % of the motion in 40 samples a cycle: squares of raw amplitudes would be wrong by 1 % and more."""
    clean = ellipse(cycles=3.0, per_cycle=40)
    found = [
        impedance.identify_loop(noisy(clean, seed, 5e-4, 20.0), "x", "f", frequency=0.5, drift=0) for seed in range(600)
    ]
    for name, value in (("stiffness", K), ("damping", C)):
        values = np.array([getattr(loop, name) for loop in found])
        claimed = np.sqrt(np.mean([getattr(loop, f"{name}_std") ** 2 for loop in found]))
        assert values.std() == pytest.approx(claimed, rel=0.12)  # four standard deviations of a spread of 600
        # 600 tests know the mean to std / 24.5; four of that is still well below what the correction takes away.
        assert abs(values.mean() - value) < 4.0 * values.std() / np.sqrt(values.size), name


@pytest.mark.parametrize("delay", [-3e-3, 2e-3, 5e-3])
def test_a_late_force_takes_stiffness_times_delay_off_the_damping_until_it_is_told(delay: float) -> None:
    record = ellipse(cycles=4.0, per_cycle=2000)
    w = np.pi
    t = np.asarray(record["time"]) - delay
    record["f"] = 5e-3 * (K * np.sin(w * t) + C * w * np.cos(w * t))
    blind = impedance.identify_loop(record, "x", "f", frequency=0.5)
    assert blind.damping - C == pytest.approx(blind.skew_bias * delay, rel=0.02)
    assert w * blind.damping == pytest.approx(w * C * np.cos(w * delay) - K * np.sin(w * delay), rel=1e-9)
    told = impedance.identify_loop(record, "x", "f", frequency=0.5, delay=delay, delay_std=1e-3)
    assert (told.stiffness, told.damping) == pytest.approx((K, C), rel=1e-9)
    assert told.damping_std == pytest.approx(K * 1e-3, rel=1e-6)


def test_what_may_be_wrong_is_said() -> None:
    thin = ellipse(c=100.0)
    (late,) = impedance.identify_loop(thin, "x", "f").notes
    assert "one sample (4 ms) of unknown delay of the force would change the damping by 320 N s/m" in late
    coarse = ellipse()
    coarse["x"] = 2e-3 * np.round(np.asarray(coarse["x"]) / 2e-3)
    assert any("steps of the encoder (0.002 m)" in note for note in impedance.identify_loop(coarse, "x", "f").notes)
    fading = ellipse(cycles=6.0)
    fading["f"] = np.asarray(fading["f"]) + C * np.pi * 5e-3 * np.cos(np.pi * np.asarray(fading["time"])) * np.linspace(
        0.0, 1.0, 3000
    )
    assert any("differs from cycle to cycle" in note for note in impedance.identify_loop(fading, "x", "f").notes)
    assert any(
        "single cycle" in note for note in impedance.identify_loop(ellipse(cycles=1.0), "x", "f", frequency=0.5).notes
    )
    gaining = impedance.identify_loop(ellipse(c=-C), "x", "f")
    assert "gains" in gaining.notes[0]


# ---- the law of the loss ---------------------------------------------------------------------------------------------

GRID = [(frequency, amplitude) for frequency in (0.2, 0.5, 1.0) for amplitude in (2e-3, 5e-3)]


def planted(law: str, frequency: float, amplitude: float, seed: int) -> impedance.Loop:
    record = ellipse(c=0.0, amplitude=amplitude, frequency=frequency)
    angle = 2.0 * np.pi * frequency * np.asarray(record["time"])
    lost: dict[str, Array] = {
        "viscous": C * amplitude * 2.0 * np.pi * frequency * np.cos(angle),
        "structural": 0.12 * K * amplitude * np.cos(angle),
        "Coulomb": 15.0 * np.sign(np.cos(angle)),
    }
    lost["mixed"] = np.asarray(lost["viscous"]) + np.asarray(lost["Coulomb"])
    record["f"] = record["f"] + lost[law]
    return impedance.identify_loop(noisy(record, seed, 10e-6, 2.0), "x", "f", frequency=frequency)


@pytest.mark.parametrize(("law", "value"), [("viscous", C), ("structural", 0.12 * K), ("Coulomb", 15.0)])
@pytest.mark.parametrize("seed", range(5))
def test_the_law_of_a_planted_loss_is_named(law: str, value: float, seed: int) -> None:
    found = impedance.identify_loss_law([planted(law, *place, seed + 10 * at) for at, place in enumerate(GRID)])
    assert found.law == law
    assert str(found).startswith(f"the loss is {law}")
    assert found.coefficients[law] == pytest.approx(value, rel=0.02)
    assert found.shares[law] > 0.9
    wanted = {"viscous": (2.0, 1.0), "structural": (2.0, 0.0), "Coulomb": (1.0, 0.0)}[law]
    assert (found.amplitude_exponent, found.frequency_exponent) == pytest.approx(wanted, abs=0.06)


def test_a_loss_of_two_kinds_is_called_mixed_with_its_shares() -> None:
    loops = [planted("mixed", *place, at) for at, place in enumerate(GRID)]
    found = impedance.identify_loss_law(loops)
    assert found.law == "mixed"
    exact = np.mean([loop.viscous_measure * C / (loop.viscous_measure * C + loop.path * 15.0) for loop in loops])
    assert found.shares["viscous"] == pytest.approx(exact, abs=0.03)
    assert "side by side" in found.sentence


def test_tests_that_cannot_tell_say_which_ones_are_missing() -> None:
    same_frequency = impedance.identify_loss_law([planted("viscous", 0.5, a, 1) for a in (2e-3, 3e-3, 5e-3)])
    assert same_frequency.law == "undecided"
    assert set(same_frequency.possible) == {"viscous", "structural"}
    assert "add frequencies that differ" in str(same_frequency)
    along = impedance.identify_loss_law([planted("viscous", f, 2e-3 * f, 1) for f in (0.5, 1.0, 2.0)])
    assert np.isnan([along.amplitude_exponent, along.frequency_exponent]).all()
    assert "nan" not in str(along)
    same = impedance.identify_loss_law([planted("viscous", 0.5, 5e-3, seed) for seed in range(3)])
    assert "add amplitudes and frequencies" in str(same)


# ---- repeated tests --------------------------------------------------------------------------------------------------


def test_mean_spread_and_interval_of_a_text_book() -> None:
    """t of 4 degrees of freedom at 97.5 % is 2.776445."""
    found = impedance.repeat([1.0, 2.0, 3.0, 4.0, 5.0], "k", "N/m")
    assert (found.mean, found.std, found.n) == pytest.approx((3.0, np.sqrt(2.5), 5))
    assert found.interval == pytest.approx((3.0 - 2.776445 * np.sqrt(0.5), 3.0 + 2.776445 * np.sqrt(0.5)), rel=1e-6)
    assert found.relative_std == pytest.approx(np.sqrt(2.5) / 3.0)


@pytest.mark.parametrize("n", [2, 3, 5])
def test_intervals_cover_the_mean_in_95_of_100_campaigns(n: int) -> None:
    random = np.random.default_rng(n)
    found = [impedance.repeat(row) for row in random.normal(3.0, 0.4, (4000, n))]
    inside = np.mean([one.interval[0] <= 3.0 <= one.interval[1] for one in found])
    assert inside == pytest.approx(0.95, abs=4.0 * np.sqrt(0.95 * 0.05 / 4000))


def test_intervals_of_noisy_loops_cover_the_truth() -> None:
    clean = ellipse(cycles=2.0, per_cycle=60)
    hits = np.zeros(2)
    campaigns = 150
    for campaign in range(campaigns):
        tests = [
            impedance.identify_loop(noisy(clean, 5 * campaign + test, 5e-5, 20.0), "x", "f", frequency=0.5)
            for test in range(5)
        ]
        row = impedance.repeat_tests("hip", "low", "quasi-static", tests)
        hits += [one.interval[0] <= value <= one.interval[1] for one, value in ((row.stiffness, K), (row.damping, C))]
    # 150 campaigns know a share of 0.95 to 0.018.
    np.testing.assert_allclose(hits / campaigns, 0.95, atol=0.055)


def test_tables_are_printed_drawn_and_stored(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    loops = [impedance.identify_loop(noisy(ellipse(), seed, 1e-5, 5.0), "x", "f") for seed in range(3)]
    table = impedance.ImpedanceTable((impedance.repeat_tests("hip", "low", "quasi-static", loops),))
    head, line = str(table).splitlines()
    assert head.split() == [
        "test",
        "joint",
        "impedance",
        "n",
        "k",
        "N/m",
        "interval",
        "sigma",
        "c",
        "N",
        "s/m",
        "interval",
        "sigma",
    ]
    assert line.split()[:4] == ["quasi-static", "hip", "low", "3"]
    assert len(table.plot().axes) == 2
    measured, fitted = loops[0].plot().axes[0].lines
    assert np.size(measured.get_xdata()) == loops[0].displacement.size
    assert np.ptp(np.asarray(fitted.get_xdata())) == pytest.approx(10.0, rel=1e-2)
    assert Result.load(table.save(tmp_path / "table.npz")) == table
    assert impedance.Loop.load(loops[0].save(tmp_path / "loop.npz")) == loops[0]
    assert list(loops[0].to_frame()["cycle"]) == [0, 1, 2, 3]


# ---- bad input -------------------------------------------------------------------------------------------------------


def broken(**changes: Array) -> Record:
    return {**ellipse(), **changes}


TIME = np.asarray(ellipse()["time"])


@pytest.mark.parametrize(
    ("record", "options", "error", "words"),
    [
        (ellipse(cycles=0.8), {"frequency": 0.5}, IdentificationError, "holds 0.8 cycles of 0.5 Hz.*one whole cycle"),
        (ellipse(cycles=1.5), {}, IdentificationError, "needs two cycles to be estimated: give frequency="),
        (ellipse(per_cycle=6), {"frequency": 0.5}, IdentificationError, "has 6 samples in a cycle.*sample at 4 Hz"),
        (broken(x=np.full(TIME.size, 0.3)), {}, IdentificationError, '"x" is constant at 0.3 m'),
        (broken(f=np.where(TIME[7] == TIME, np.nan, 1.0)), {}, ExperimentError, '"f" is nan at sample 7, one of 1'),
        (broken(time=np.where(TIME[9] == TIME, 0.0, TIME)), {}, ExperimentError, "does not increase at sample 9"),
        (broken(f=np.ones(5)), {}, ExperimentError, '"f" has 5 samples and its clock 2000'),
        (broken(f=np.ones((5, 2))), {}, ExperimentError, r"shape \(5, 2\)"),
        ({"x": TIME, "f": TIME}, {}, IdentificationError, 'no channel "time"'),
        (ellipse(cycles=0.01), {}, ExperimentError, "has 5 samples, and this needs at least 8"),
        (ellipse(), {"sense": "pull"}, IdentificationError, 'sense is "pull"'),
        (ellipse(), {"drift": -1}, IdentificationError, "drift is -1; give a degree of 0 to 5"),
        (ellipse(), {"delay": np.inf}, IdentificationError, "delay is inf s"),
        (ellipse(), {"frequency": -1.0}, IdentificationError, "frequency is -1.0 Hz"),
    ],
)
def test_records_that_are_no_loops(
    record: Record, options: dict[str, object], error: type[Exception], words: str
) -> None:
    with pytest.raises(error, match=words):
        impedance.identify_loop(record, "x", "f", **options)  # type: ignore[arg-type]


def test_other_bad_input() -> None:
    with pytest.raises(IdentificationError, match="value has 1 repetition, and an interval needs at least two"):
        impedance.repeat([3.0])
    with pytest.raises(IdentificationError, match="k is nan in test 1"):
        impedance.repeat([3.0, np.nan], "k")
    with pytest.raises(IdentificationError, match="confidence is 95"):
        impedance.repeat([3.0, 4.0], confidence=95.0)
    loop = impedance.identify_loop(ellipse(), "x", "f")
    with pytest.raises(IdentificationError, match="three loops at least, and there are 2"):
        impedance.identify_loss_law([loop, loop])
    with pytest.raises(IdentificationError, match="loses -"):
        impedance.identify_loss_law([impedance.identify_loop(ellipse(c=-C), "x", "f")] * 3)
    with pytest.raises(IdentificationError, match=r"mass is 0\.0; give a positive number"):
        impedance.stop_damping(0.0, 1.0, 0.01, 0.01)
    with pytest.raises(IdentificationError, match="leaves nothing for a damper"):
        impedance.stop_damping(1.0, 1.0, 0.01, 0.01, rebound_speed=1.2)
    with pytest.raises(IdentificationError, match="quarters is 0"):
        impedance.stop_factor(0)
    with pytest.raises(IdentificationError, match="0 strokes between extremes"):
        impedance.logarithmic_decrement(free_motion(K, 6e3, 0.3), "x")
    with pytest.raises(ExperimentError, match="has 10 samples, and this needs at least 20"):
        impedance.identify_decay({"time": np.arange(10.0), "x": np.arange(10.0)}, "x", M)
    with pytest.raises(IdentificationError, match="mass is -1"):
        impedance.identify_decay(free_motion(K, C, 0.3), "x", -1.0)
    uneven = free_motion(K, C, 0.3)
    uneven["time"] = np.asarray(uneven["time"]) ** 1.1
    with pytest.raises(ExperimentError, match="bring it to an even grid"):
        impedance.identify_landing(uneven, "x", "f")
    with pytest.raises(IdentificationError, match="terms is 2"):
        impedance.identify_landing(free_motion(K, C, 0.3), "x", "f", terms=2)
