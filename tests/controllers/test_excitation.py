"""Excitations: spectra where they are asked for, known crest factors, limits at all times, better than random."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import vpm
from command_line import ran
from command_line import vpm as typed
from places import EXAMPLES
from two_link_arm import MODEL
from vpm.demo import MODEL as DEMO
from vpm.errors import ExcitationError, SimulationError
from vpm.excitation import (
    FourierTrajectory,
    JointLimits,
    base_parameters,
    chirp,
    fourier_trajectory,
    multisine,
    noise,
    trapezoid,
)
from vpm.excitation.base_parameters import regressor
from vpm.excitation.multisine import schroeder_phases
from vpm.experiment import Experiment
from vpm.numbers import Array
from vpm.scenario.schema import Points


@pytest.fixture(scope="module")
def arm() -> vpm.Model:
    return vpm.Model.from_toml(MODEL)


LIMITS = {
    "shoulder": JointLimits((-2.0, 0.5), 4.0, 20.0, 45.0),
    "elbow": JointLimits((-1.0, 1.5), 5.0, 30.0, 15.0),
}


@pytest.fixture(scope="module")
def motion(arm: vpm.Model) -> FourierTrajectory:
    return fourier_trajectory(arm, LIMITS, period=4.0, time_step=0.01, evaluations=400, seed=3)


# ---- multisine -------------------------------------------------------------------------------------------------------


@settings(max_examples=40, deadline=None)
@given(
    first=st.integers(1, 20),
    width=st.integers(0, 40),
    period=st.sampled_from([0.5, 1.0, 2.0, 10.0]),
    peak=st.floats(1e-3, 1e3),
    phases=st.sampled_from(["schroeder", "random", "zero"]),
    odd=st.booleans(),
)
def test_a_multisine_has_its_lines_and_nothing_else(
    first: int, width: int, period: float, peak: float, phases: str, odd: bool
) -> None:
    last = first + width + 1
    signal = multisine(
        "u", "V", band=(first / period, last / period), period=period, time_step=period / 250, peak=peak,
        phases=phases, odd=odd,  # type: ignore[arg-type]  # one of the three
    )  # fmt: skip
    frequency, amplitude = signal.spectrum("u")
    lines = np.round(frequency * period)
    inside = (lines >= first) & (lines <= last) & ((lines % 2 == 1) | (not odd))
    largest = amplitude.max()
    np.testing.assert_allclose(amplitude[inside], largest, rtol=1e-9)
    assert np.all(amplitude[~inside] < 1e-12 * largest)
    # The peak holds between samples too: on a grid a hundred times as fine, from the lines alone.
    fine = np.fft.irfft(np.pad(np.fft.rfft(signal["u"]), (0, 12_500 - 125)), 25_000) * 100.0
    assert 0.99 * peak < np.abs(fine).max() <= peak * (1.0 + 1e-12)


def test_crest_factors_against_closed_forms() -> None:
    def crest(phases: str, lines: int) -> float:
        signal = multisine("u", band=(1.0, lines), period=1.0, time_step=1e-4, peak=1.0, phases=phases)  # type: ignore[arg-type]
        return signal.crest_factor("u")

    for lines in (1, 2, 7, 31):
        assert crest("zero", lines) == pytest.approx(np.sqrt(2.0 * lines), rel=1e-9)  # all peaks at time zero
    assert crest("schroeder", 1) == pytest.approx(np.sqrt(2.0), rel=1e-6)
    # M. Schroeder, 1970: about 1.7 for flat spectra; optimised phases come near to the square root of two.
    assert 1.6 < crest("schroeder", 31) < 1.85
    assert crest("optimised", 31) < 1.45 < crest("schroeder", 31) < crest("random", 31) < crest("zero", 31)


@given(count=st.integers(1, 200))
def test_schroeder_phases_in_closed_form(count: int) -> None:
    k = np.arange(count)
    np.testing.assert_allclose(schroeder_phases(np.ones(count)), -np.pi * k * (k + 1) / count, atol=1e-9)


def test_a_shaped_spectrum() -> None:
    signal = multisine(
        "u",
        band=(1.0, 40.0),
        period=1.0,
        time_step=1e-3,
        peak=1.0,
        periods=3,
        shape=lambda f: 1.0 / f,
        phases="schroeder",
    )
    frequency, amplitude = signal.spectrum("u")
    rows = np.searchsorted(frequency, np.arange(1.0, 41.0) - 1e-6)
    np.testing.assert_allclose(amplitude[rows] * np.arange(1, 41), amplitude[rows[0]], rtol=1e-9)
    assert len(signal) == 3000
    np.testing.assert_allclose(signal["u"][:1000], signal["u"][2000:], atol=1e-12)


def test_phases_by_the_gradient_of_the_norm() -> None:
    from scipy.optimize import check_grad

    from vpm.excitation.multisine import _log_norm

    lines, amplitudes = np.arange(3, 12), np.linspace(1.0, 2.0, 9)
    angles = np.random.default_rng(1).uniform(0.0, 6.0, 9)
    for power in (4, 64):

        def norm(x: Array, power: int = power) -> float:
            return _log_norm(x, lines, amplitudes, 256, power)[0]

        def slope(x: Array, power: int = power) -> Array:
            return _log_norm(x, lines, amplitudes, 256, power)[1]

        assert check_grad(norm, slope, angles) < 1e-5


def test_the_optimisation_tells_how_far_it_is_and_can_be_stopped(arm: vpm.Model) -> None:
    told: list[tuple[int, float]] = []
    multisine("u", band=(1, 9), period=1.0, time_step=1e-2, peak=1.0, progress=lambda n, c: told.append((n, c)))
    assert [n for n, _ in told] == list(range(1, len(told) + 1))
    assert told[-1][1] < told[0][1]

    def stop(count: int, value: float) -> None:
        assert value > 0.0
        if count >= 5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        multisine("u", band=(1, 9), period=1.0, time_step=1e-2, peak=1.0, progress=stop)
    with pytest.raises(KeyboardInterrupt):
        fourier_trajectory(arm, LIMITS, period=4.0, time_step=0.01, progress=stop)


# ---- chirp and noise -------------------------------------------------------------------------------------------------


@settings(max_examples=50, deadline=None)
@given(first=st.floats(0.1, 40.0), last=st.floats(0.1, 40.0), duration=st.sampled_from([1.0, 2.0, 10.0]))
def test_a_chirp_ends_at_its_last_frequency(first: float, last: float, duration: float) -> None:
    signal = chirp("u", "V", first=first, last=last, amplitude=2.0, duration=duration, time_step=1e-3, mean=1.0)
    t = signal.time
    expected = 1.0 + 2.0 * np.sin(2.0 * np.pi * (first + (last - first) * t / (2.0 * duration)) * t)
    np.testing.assert_allclose(signal["u"], expected, atol=1e-9)
    assert np.all(np.abs(signal["u"] - 1.0) <= 2.0 * (1.0 + 1e-12))
    # Half turns are the zeros: as many as the mean frequency says.
    crossings = np.count_nonzero(np.diff(np.sign(signal["u"][1:] - 1.0)))
    assert abs(crossings - (first + last) * duration) <= 1.0


@settings(max_examples=30, deadline=None)
@given(low=st.integers(0, 50), width=st.integers(1, 100), seed=st.integers(0, 2**31), rms=st.floats(0.01, 100.0))
def test_noise_lies_in_its_band(low: int, width: int, seed: int, rms: float) -> None:
    signal = noise("u", "A", band=(low, low + width), rms=rms, duration=1.0, time_step=1.0 / 400, seed=seed)
    frequency, amplitude = signal.spectrum("u")
    outside = (frequency < low - 1e-6) | (frequency > low + width + 1e-6) | (frequency == 0.0)
    assert np.all(amplitude[outside] < 1e-12 * rms)
    assert np.sqrt(np.mean(signal["u"] ** 2)) == pytest.approx(rms)
    assert signal == noise("u", "A", band=(low, low + width), rms=rms, duration=1.0, time_step=1.0 / 400, seed=seed)


def test_noise_is_gaussian_and_flat() -> None:
    signal = noise("u", band=(0.0, 400.0), rms=1.0, duration=100.0, time_step=1e-3, seed=1)
    values = signal["u"]
    # Kurtosis of N independent normal numbers scatters by sqrt(24 / N); in 80 % of the band fewer are independent.
    assert np.mean(values**4) == pytest.approx(3.0, abs=4.0 * np.sqrt(24.0 / (0.8 * values.size)))
    frequency, amplitude = signal.spectrum("u")
    lower, upper = ((frequency > a) & (frequency < b) for a, b in ((0.0, 200.0), (200.0, 400.0)))
    power = amplitude**2
    # Each sum holds n exponential numbers and scatters by 1 / sqrt(n).
    assert np.sum(power[lower]) / np.sum(power[upper]) == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / 20_000))


# ---- trapezoids ------------------------------------------------------------------------------------------------------


@settings(max_examples=50, deadline=None)
@given(
    points=st.lists(st.floats(-2.0, 2.0), min_size=2, max_size=5),
    speed=st.floats(0.1, 10.0),
    acceleration=st.floats(0.5, 50.0),
    dwell=st.floats(0.0, 1.0),
)
def test_a_trapezoid_keeps_its_limits_and_reaches_its_points(
    points: list[float], speed: float, acceleration: float, dwell: float
) -> None:
    limits = {j: JointLimits((-2.0, 2.0), speed, acceleration) for j in ("a", "b")}
    other = [0.5 * p for p in points]
    step = 0.002
    if max(points) - min(points) < 0.1:
        return
    motion = trapezoid({"a": points, "b": other}, limits, time_step=step, dwell=dwell)
    for joint, places in (("a", points), ("b", other)):
        position, velocity = motion[f"{joint}.position"], motion[f"{joint}.velocity"]
        rate = motion[f"{joint}.acceleration"]
        assert np.abs(velocity).max() <= speed * (1.0 + 1e-9)
        assert np.abs(rate).max() <= acceleration * (1.0 + 1e-9)
        assert position[0] == pytest.approx(places[0])
        assert position[-1] == pytest.approx(places[-1], abs=1e-9)
        assert min(places) - 1e-9 <= position.min()
        assert position.max() <= max(places) + 1e-9
        # Neighbouring samples differ by the integral between them, at most half a step of the steepest ramp off.
        middle = 0.5 * (velocity[1:] + velocity[:-1]) * step
        np.testing.assert_allclose(np.diff(position), middle, atol=acceleration * step**2)
        assert np.abs(np.diff(velocity)).max() <= acceleration * step * (1.0 + 1e-6)


def test_a_trapezoid_by_hand() -> None:
    motion = trapezoid({"a": [0.0, 3.0]}, {"a": JointLimits((0.0, 3.0), 1.0, 2.0)}, time_step=0.01, unit="m")
    assert motion.time[-1] == pytest.approx(3.0 / 1.0 + 1.0 / 2.0)
    assert motion["a.position"][50] == pytest.approx(0.25)  # v^2 / 2a
    assert motion["a.velocity"][100] == 1.0
    assert motion.units == ("m", "m/s", "m/s^2")
    short = trapezoid({"a": [0.0, 0.02]}, {"a": JointLimits((0.0, 3.0), 1.0, 2.0)}, time_step=0.01)
    assert short.time[-1] == pytest.approx(2.0 * np.sqrt(0.02 / 2.0), abs=0.01)


# ---- base parameters -------------------------------------------------------------------------------------------------


def test_base_parameters_of_two_links_in_a_plane(arm: vpm.Model) -> None:
    """Of each link the plane shows a first moment and a moment of inertia; the elbow's mass hangs on the upper arm."""
    free = [
        f"{b}.{p}"
        for b in ("upper", "lower")
        for p in ("mass", "center_of_mass.x", "center_of_mass.y", "inertia.yy", "inertia.xx")
    ]
    base = base_parameters(arm, free)
    assert len(base.names) == 4
    assert set(base.unseen) == {f"{b}.{p}" for b in ("upper", "lower") for p in ("center_of_mass.y", "inertia.xx")}
    # The lower arm shows m c and I + m c^2: a change of the mass by 1 is one of c by c / m = 0.18 / 2.
    words = dict(zip(base.names, base.combinations, strict=True))
    lower = next(
        text for name, text in words.items() if name in {"lower.center_of_mass.x", "lower.mass"} and "upper" not in text
    )
    assert lower in {"lower.center_of_mass.x +0.09 lower.mass", "lower.mass +11.11 lower.center_of_mass.x"}


def test_the_regressor_is_the_derivative_of_inverse_dynamics(arm: vpm.Model) -> None:
    rng = np.random.default_rng(2)
    q, v, a = (rng.uniform(-2.0, 2.0, (20, 2)) for _ in range(3))
    names = ("upper.inertia.yy", "lower.center_of_mass.x", "elbow.friction.viscous")
    columns = regressor(arm, q, v, a, names)
    for k, name in enumerate(names):
        value, h = arm.parameters[name].value, 1e-5
        pair = [arm.with_parameters({name: value + sign * h}) for sign in (1.0, -1.0)]
        efforts = [np.array([m.inverse_dynamics(*row) for row in zip(q, v, a, strict=True)]) for m in pair]
        np.testing.assert_allclose(columns[:, :, k], (efforts[0] - efforts[1]) / (2.0 * h), atol=1e-8)


# ---- Fourier trajectories --------------------------------------------------------------------------------------------


def test_the_motion_keeps_its_limits_between_samples_too(motion: FourierTrajectory, arm: vpm.Model) -> None:
    time = np.linspace(0.0, 4.0, 100_001)
    for column, joint in enumerate(motion.joints):
        limit = LIMITS[joint]
        position, velocity, acceleration = (x[:, column] for x in motion.at(time))
        assert limit.position[0] <= position.min()
        assert position.max() <= limit.position[1]
        assert np.abs(velocity).max() <= limit.speed
        assert np.abs(acceleration).max() <= limit.acceleration
        used = max(
            np.abs(velocity).max() / limit.speed,
            np.abs(acceleration).max() / limit.acceleration,
            (position - motion.offset[column]).max() / (limit.position[1] - motion.offset[column]),
            (motion.offset[column] - position).max() / (motion.offset[column] - limit.position[0]),
        )
        assert used > 0.9  # a limit is used, unless the effort binds
    rows = motion.at(time[::50])
    efforts = np.array([arm.inverse_dynamics(*row) for row in zip(*rows, strict=True)])
    assert np.all(np.abs(efforts).max(axis=0) <= 1.005 * np.array([45.0, 15.0]))


def test_the_motion_is_consistent_and_begins_at_rest(motion: FourierTrajectory) -> None:
    time = np.linspace(0.0, 4.0, 40_001)
    position, velocity, acceleration = motion.at(time)
    h = time[1]
    np.testing.assert_allclose((position[2:] - position[:-2]) / (2 * h), velocity[1:-1], atol=1e-5)
    np.testing.assert_allclose((velocity[2:] - velocity[:-2]) / (2 * h), acceleration[1:-1], atol=1e-4)
    for start, end in ((x[0], x[-1]) for x in (velocity, acceleration)):
        np.testing.assert_allclose(start, 0.0, atol=1e-12)
        np.testing.assert_allclose(end, 0.0, atol=1e-9)
    sampled = motion.at(motion.time)
    for column, joint in enumerate(motion.joints):
        for quantity, values in zip(("position", "velocity", "acceleration"), sampled, strict=True):
            np.testing.assert_allclose(motion[f"{joint}.{quantity}"], values[:, column], atol=1e-12)


def test_the_condition_number_is_better_than_that_of_random_motions(motion: FourierTrajectory, arm: vpm.Model) -> None:
    assert motion.condition < 0.8 * motion.start_conditions.min()
    assert motion.condition < 0.5 * np.median(motion.start_conditions)
    # Drawn up anew from the samples of the result: the same number up to the grid.
    states = [
        np.column_stack([motion[f"{j}.{x}"] for j in motion.joints]) for x in ("position", "velocity", "acceleration")
    ]
    spread = np.array([arm.parameters[name].uncertainty for name in motion.parameters], dtype=float)
    columns = regressor(arm, *states, motion.parameters) * spread / np.array([45.0, 15.0])[:, None]  # type: ignore[call-arg, arg-type]
    assert np.linalg.cond(columns.reshape(-1, spread.size)) == pytest.approx(motion.condition, rel=0.02)


def test_the_same_seed_gives_the_same_motion(arm: vpm.Model) -> None:
    first, second = (fourier_trajectory(arm, LIMITS, period=4.0, time_step=0.01, evaluations=30) for _ in range(2))
    assert first == second


@settings(max_examples=15, deadline=None)
@given(
    low=st.floats(-3.0, 0.0),
    width=st.floats(0.05, 6.0),
    speed=st.floats(0.1, 10.0),
    acceleration=st.floats(0.5, 100.0),
    harmonics=st.integers(3, 8),
    period=st.sampled_from([1.0, 5.0, 20.0]),
    seed=st.integers(0, 1000),
)
def test_limits_hold_for_all_settings(
    low: float, width: float, speed: float, acceleration: float, harmonics: int, period: float, seed: int
) -> None:
    arm = vpm.Model.from_toml(MODEL)
    limit = JointLimits((low, low + width), speed, acceleration)
    motion = fourier_trajectory(
        arm, {"shoulder": limit, "elbow": limit}, period=period, time_step=period / 100, harmonics=harmonics,
        starts=2, evaluations=4, seed=seed,
    )  # fmt: skip
    position, velocity, acceleration_ = motion.at(np.linspace(0.0, period, 20_001))
    tolerance = 1.0 + 1e-12
    assert np.all(position >= low - 1e-12 * width)
    assert np.all(position <= low + width * tolerance)
    assert np.abs(velocity).max() <= speed * tolerance
    assert np.abs(acceleration_).max() <= acceleration * tolerance


def test_the_determinant_makes_the_region_of_confidence_smaller(arm: vpm.Model, motion: FourierTrajectory) -> None:
    """Its volume is less than with the least condition number, with random motions, and with plain sines."""
    design = fourier_trajectory(
        arm, LIMITS, period=4.0, time_step=0.01, evaluations=400, seed=3, criterion="determinant"
    )
    names = list(design.parameters)
    spread = np.array([arm.parameters[name].uncertainty for name in names], dtype=float)

    def volume(q: Array, v: Array, a: Array) -> float:
        """Logarithm of the volume of the ellipsoid ``x' W'W x <= 1``, up to a constant, in uncertainties."""
        columns = regressor(arm, q, v, a, names) * spread / np.array([45.0, 15.0])[:, None]
        flat = columns.reshape(-1, len(names))
        return -0.5 * float(np.linalg.slogdet(flat.T @ flat)[1])

    time = np.asarray(np.arange(400) * 0.01, dtype=np.float64)
    angle = 6.0 * time[:, None]
    sine = [np.array([0.4, 0.3]) * x for x in (np.sin(angle), 6.0 * np.cos(angle), -36.0 * np.sin(angle))]
    random = fourier_trajectory(
        arm, LIMITS, period=4.0, time_step=0.01, starts=1, evaluations=1, seed=3, criterion="determinant"
    )
    mine = volume(*design.at(time))
    assert mine < volume(*sine) - 1.0
    assert mine < volume(*motion.at(time)) - 1.0
    assert mine < volume(*random.at(time)) - 1.0


# ---- on the way to the robot -----------------------------------------------------------------------------------------


def test_csv_for_the_robot_is_read_back(tmp_path: Path, motion: FourierTrajectory) -> None:
    path = motion.to_csv(tmp_path / "motion.csv")
    head = path.read_text(encoding="utf-8").splitlines()[0]
    assert head.startswith("time [s],shoulder.position [rad],shoulder.velocity [rad/s],shoulder.acceleration [rad/s^2]")
    back = Experiment.load(path)
    assert back.channels == motion.channels
    np.testing.assert_allclose(back.data, motion.data, rtol=1e-11, atol=1e-11)


def test_an_excitation_drives_a_simulation_and_a_scenario(arm: vpm.Model) -> None:
    one = multisine("first.command", "A", band=(0.5, 5.0), period=2.0, time_step=0.01, peak=1.0)
    two = noise("second.command", "A", band=(0.5, 5.0), rms=0.3, duration=2.0, time_step=0.01)
    both = one.beside(two)
    log = both.to_experiment()
    run = vpm.simulate(arm, log, "free_run")
    assert np.ptp(run["shoulder.position"]) > 0.01
    signal = both.to_points("second.command")
    assert Points.model_validate(signal).value.unit == "A"
    assert both.to_frame().shape == (200, 3)
    assert both.plot() is not None
    assert "\n" not in repr(both)
    with pytest.raises(ExcitationError, match=r'two of the excitations drive "first\.command"'):
        one.beside(one)


def test_a_controller_follows_a_designed_motion() -> None:
    model = vpm.Model.load(DEMO)
    limits = {"shoulder": JointLimits((-1.0, 1.0), 2.0, 8.0)}
    motion = fourier_trajectory(model, limits, period=5.0, time_step=0.002, starts=5, evaluations=20)
    log = motion.to_experiment({"motor.reference": "shoulder.position"})
    run = vpm.simulate(model, log, "closed_loop")
    lag = run["shoulder.position"] - motion["shoulder.position"]
    # A cascade without feed-forward lags by the speed over its position gain, 12 / s.
    assert np.abs(lag).max() < 1.5 * np.abs(motion["shoulder.velocity"]).max() / 12.0


def test_a_motion_is_saved_and_read_back(tmp_path: Path, motion: FourierTrajectory) -> None:
    assert FourierTrajectory.load(motion.save(tmp_path / "motion.npz")) == motion
    with pytest.raises(ValueError, match="read-only"):
        motion.data[0, 0] = 1.0


# ---- on the command line ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("command", ["multisine", "chirp", "noise", "fourier"])
def test_every_design_has_help_with_an_example(command: str) -> None:
    done = ran("excite", command, "--help")
    assert f"Example:  vpm excite {command}" in done.stdout


def test_a_motion_is_designed_on_the_command_line(tmp_path: Path) -> None:
    model, limits = tmp_path / "model.toml", tmp_path / "limits.toml"
    model.write_text(MODEL, encoding="utf-8")
    text = "[{}]\nposition = [-1.0, 1.0]\nspeed = 3.0\nacceleration = 20.0\neffort = 60.0\n"
    limits.write_text(text.format("shoulder") + text.format("elbow"), encoding="utf-8")
    words = ["excite", "fourier", str(model), str(limits), "--period", "4", "--time-step", "0.01"]
    words += ["--evaluations", "25", "--out", str(tmp_path / "m.csv"), "--plot", str(tmp_path / "m.png")]
    done = ran(*words)
    assert "Condition number" in done.stdout
    assert Experiment.load(tmp_path / "m.csv")["shoulder.position"].size == 400
    assert (tmp_path / "m.png").read_bytes().startswith(b"\x89PNG")
    limits.write_text("[shoulder]\nposition = 1.0\n", encoding="utf-8")
    wrong = typed(*words)
    assert wrong.returncode == 1
    assert "[shoulder] is no table of limits" in wrong.stderr


# ---- what cannot be --------------------------------------------------------------------------------------------------


def test_what_cannot_be_is_one_sentence(arm: vpm.Model) -> None:
    sine = {"band": (1.0, 5.0), "period": 1.0, "time_step": 0.01, "peak": 1.0}
    for changes, words in (
        ({"band": (1.0, 60.0)}, "the band from 1 Hz to 60 Hz is not within 0 and 50 Hz"),
        ({"band": (1.2, 1.8)}, "no multiple of 1 Hz lies between 1.2 and 1.8 Hz"),
        ({"peak": -1.0}, "the peak is -1, and it has to be positive"),
        ({"period": 1.003}, "which is no whole number; give a duration of 1 s"),
        ({"phases": "low"}, 'phases="low" are not known'),
        ({"shape": lambda f: -f}, "amplitudes; return one finite number"),
        ({"periods": 0}, "0 periods are none"),
    ):
        with pytest.raises(ExcitationError) as caught:
            multisine("u", "V", **{**sine, **changes})  # type: ignore[arg-type]  # wrong on purpose
        assert words in str(caught.value)
    with pytest.raises(ExcitationError, match=r"reaches .* A, and 1 A is allowed; give a root mean square of 0\.\d+ A"):
        noise("u", "A", band=(1.0, 40.0), rms=1.0, duration=10.0, time_step=0.01, peak=1.0)
    with pytest.raises(ExcitationError, match="range from 1 to 0 is empty"):
        JointLimits((1.0, 0.0), 1.0, 1.0)
    with pytest.raises(ExcitationError, match="speed is 0; give a positive number"):
        JointLimits((0.0, 1.0), 0.0, 1.0)
    with pytest.raises(ExcitationError, match='the joint "elbow" has no limits'):
        fourier_trajectory(arm, {"shoulder": LIMITS["shoulder"]}, period=4.0, time_step=0.01)
    with pytest.raises(ExcitationError, match='has no joint "elbo"; did you mean "elbow"'):
        fourier_trajectory(arm, {**LIMITS, "elbo": LIMITS["elbow"]}, period=4.0, time_step=0.01)
    with pytest.raises(ExcitationError, match="2 harmonics in 400 samples"):
        fourier_trajectory(arm, LIMITS, period=4.0, time_step=0.01, harmonics=2)
    with pytest.raises(ExcitationError, match=r'no parameter "upper\.mas"'):
        base_parameters(arm, ["upper.mas"])
    with pytest.raises(ExcitationError, match=r'the point 3 of the joint "shoulder" is outside of its range'):
        trapezoid({"shoulder": [0.0, 3.0]}, LIMITS, time_step=0.01)
    tight = {j: JointLimits((-0.1, 0.1), 1.0, 1.0, 0.1) for j in ("shoulder", "elbow")}
    with pytest.raises(ExcitationError, match=r"the effort is .* times its limit; allow more effort"):
        fourier_trajectory(arm, tight, period=4.0, time_step=0.01, evaluations=25)


def test_models_without_a_balance_of_efforts_are_refused() -> None:
    beam = vpm.Model.load(EXAMPLES / "flexible_pendulum" / "flexible_pendulum.toml")
    with pytest.raises(SimulationError):
        base_parameters(beam, [next(iter(beam.parameters))])
