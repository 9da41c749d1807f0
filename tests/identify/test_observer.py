"""Observers: noise found again, innovations that are white, fits of prediction errors; fed sample by sample."""

import numpy as np
import pytest

import vpm
from model_texts import effect_text, on_rail, two_links
from two_link_arm import nominal
from vpm.errors import ExperimentError, ModelError, SimulationError
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.numbers import Array
from vpm.observer import Noise, Observer, Record, likely_noise

#: Carriage with springs at both sides that a motor pushes; unknown forces move it, an encoder errs.
CARRIAGE = (
    on_rail("carriage", "{ value = 2.0, uncertainty = 0.2 }")
    + effect_text("viscous_friction", "axis", viscous="{ value = 6.0, uncertainty = 2.0 }")
    + effect_text("spring", "axis", stiffness="{ value = 50.0, uncertainty = 10.0 }", rest=0.0)
)

#: Two links in a level plane, of which one encoder sees the first alone.
TWO_LINKS = (
    two_links(
        "mass = 2.0\ncenter_of_mass = [0.25, 0, 0]\ninertia = [0.001, 0.04, 0.04, 0, 0, 0]",
        "mass = 1.0\ncenter_of_mass = [0.2, 0, 0]\ninertia = [0.001, 0.02, 0.02, 0, 0, 0]",
        "[0.5, 0, 0]",
    )
    + '[actuators.motor]\njoint = "shoulder"\ngain = 1.0\n'
    + effect_text("viscous_friction", "elbow", viscous=0.05)
    + effect_text("spring", "elbow", stiffness=3.0, rest=0.0)
)

STEP, FORCE, READING = 2e-3, 0.8, 2e-5

CHANNELS = ["shoulder.position", "elbow.position"]
CART = on_rail("cart") + effect_text("spring", "axis", stiffness=50.0, rest=0.0)
PERIOD = 0.01
CART_NOISE = Noise({"axis.position": 1e-3}, {"axis": 2.0}, {"axis.position": 1e-5, "axis.velocity": 1e-4})


def pushed(seed: int, samples: int, *, model: Model | None = None, drift: float = 0.0) -> Experiment:
    """A record of the carriage under forces that nobody knows of, held for a sample each, and an encoder that errs."""
    random = np.random.default_rng(seed)
    machine = model or Model.from_toml(CARRIAGE)
    time = STEP * np.arange(samples)
    known = 20.0 * np.sin(7.0 * time) + 8.0 * np.sin(23.0 * time + seed)
    force = known + FORCE * random.standard_normal(samples) + drift
    truth = vpm.simulate(machine, Experiment.from_arrays(time, {"drive.command": force}, model=machine))
    place = truth["axis.position"] + READING * random.standard_normal(samples)
    return Experiment.from_arrays(
        time, {"drive.command": known, "axis.position": place}, model=machine, name=f"pushed {seed}"
    )


def test_the_noise_that_moved_a_machine_is_found_again() -> None:
    model = Model.from_toml(CARRIAGE)
    noise = likely_noise(model, [Record.of(model, pushed(seed, 3000)) for seed in range(2)])
    # Second moments of 6000 samples, of which one in three or so tells of the force.
    assert noise.readings["axis.position"] == pytest.approx(READING, rel=0.1)
    assert noise.forces["axis"] == pytest.approx(FORCE, rel=0.2)


def test_what_a_model_file_states_of_its_sensors_is_believed() -> None:
    """Noise and rounding add up: a step d rounds with a variance of d^2 / 12."""
    stated = CARRIAGE + '[sensors.scale]\nmeasures = "axis.position"\nnoise = { value = 0.015, unit = "mm" }\n'
    model = Model.from_toml(stated + 'resolution = { value = 30.0, unit = "um" }\n')
    deviation = float(np.hypot(1.5e-5, 3e-5 / np.sqrt(12.0)))
    assert model.sensor_noise == {"axis.position": pytest.approx(deviation, rel=1e-12)}
    noise = likely_noise(model, [Record.of(model, pushed(0, 3000))])
    assert noise.readings["axis.position"] == pytest.approx(deviation, rel=1e-12)
    assert noise.forces["axis"] == pytest.approx(FORCE, rel=0.3)
    assert Model.from_dict(model.to_dict()).sensor_noise == model.sensor_noise


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        ('noise = { value = 1.0, unit = "s" }', r"sensors.scale.noise has a wrong unit"),
        ("noise = 0.0", r"sensors.scale.noise is 0 m, but only .* is physically possible"),
        (
            "resolution = { value = 1e-6, uncertainty = 1e-7 }",
            r"sensors.scale.resolution is no parameter: give its value",
        ),
    ],
)
def test_noise_of_a_sensor_that_cannot_be_meant_is_told(line: str, sentence: str) -> None:
    with pytest.raises(ModelError, match=sentence):
        Model.from_toml(f'{CARRIAGE}[sensors.scale]\nmeasures = "axis.position"\n{line}\n')


def test_innovations_are_white_where_the_model_is_right_and_not_where_friction_is_missing() -> None:
    model, record = Model.from_toml(CARRIAGE), pushed(3, 4000)
    right = vpm.observe(model, record)
    assert right.whiteness["axis.position"] > 0.001
    assert np.mean(right.whitened**2) == pytest.approx(1.0, abs=0.1)
    lacking = model.without_effect("viscous_friction", "axis")
    wrong = vpm.observe(lacking, record, noise=right.noise)
    assert wrong.whiteness["axis.position"] < 1e-6
    assert wrong.log_likelihood < right.log_likelihood - 20.0


def test_states_that_nobody_measures_are_followed_within_their_deviations() -> None:
    model = Model.from_toml(TWO_LINKS)
    random = np.random.default_rng(5)
    time = STEP * np.arange(2500)
    command = 2.0 * np.sin(5.0 * time) + np.sin(17.0 * time)
    held = Experiment.from_arrays(time, {"motor.command": command}, model=model)
    start = model.state({"elbow.position": 0.02, "elbow.velocity": -0.3})
    truth = vpm.simulate(model, held, initial_state=start)
    place = truth["shoulder.position"] + 1e-5 * random.standard_normal(len(time))
    log = Experiment.from_arrays(time, {"motor.command": command, "shoulder.position": place}, model=model)
    noise = Noise({"shoulder.position": 1e-5}, {"shoulder": 1e-3, "elbow": 1e-3})
    seen = vpm.observe(model, log, noise=noise)
    assert seen.channels == ("shoulder.position",)
    column = seen.state_names.index("elbow.position")
    error = np.abs(seen.state("elbow.position") - truth["elbow.position"])
    late = slice(1000, None)
    assert np.mean(error[late] <= 2.0 * seen.deviations[late, column]) > 0.9
    assert np.max(error[late]) < 0.02 * np.ptp(truth["elbow.position"])


def test_parameters_come_back_with_intervals_that_hold_them() -> None:
    """Of 12 records 95 % intervals hold the truth in 11.4 on average; fewer than 10 come once in 50 times."""
    model, names = Model.from_toml(CARRIAGE), ["carriage.mass", "axis.friction.viscous", "axis.spring.stiffness"]
    start = model.with_parameters({"carriage.mass": 1.7, "axis.friction.viscous": 9.0, "axis.spring.stiffness": 60.0})
    truth = model.theta[[model.index(name) for name in names]]
    held = np.zeros(len(names))
    for seed in range(12):
        fit = vpm.identify(start, pushed(100 + seed, 1500), names, mode="prediction_error")
        low, high = fit.intervals.T
        held += (low <= truth) & (truth <= high)
        assert np.all(np.abs(fit.values - truth) < 5.0 * fit.std)
    assert np.all(held >= 10), held


def test_a_record_that_drifts_away_leaves_no_bias() -> None:
    """A free run is carried away by forces that nobody knows of; an observer takes them for what they are."""
    model = Model.from_toml(CARRIAGE).without_effect("spring", "axis")
    record = pushed(11, 4000, model=model)
    names = ["carriage.mass", "axis.friction.viscous"]
    truth = model.theta[[model.index(name) for name in names]]
    start = model.with_parameters({"carriage.mass": 2.4})
    fit = vpm.identify(start, record, names, mode="prediction_error")
    run = vpm.identify(start, record, names, mode="free_run")
    assert np.all(np.abs(fit.values - truth) < 3.0 * fit.std)
    assert np.all(fit.std < 0.05 * truth)
    assert np.max(np.abs(fit.values - truth) / truth) < np.max(np.abs(run.values - truth) / truth)


def test_a_result_goes_to_a_file_and_comes_back(tmp_path: object) -> None:
    model, record = Model.from_toml(CARRIAGE), pushed(3, 300)
    noise = Noise({"axis.position": READING}, {"axis": FORCE})
    seen = vpm.observe(model, record, noise=noise)
    seen.save(f"{tmp_path}/seen.npz")
    again = vpm.Observation.load(f"{tmp_path}/seen.npz")
    assert again == seen
    assert again.noise.forces == {"axis": FORCE}
    assert list(seen.to_frame().columns) == ["time_s", "axis.position", "axis.position expected"]
    assert seen.plot().axes


def test_bad_input_is_told_in_one_sentence() -> None:
    model, record = Model.from_toml(CARRIAGE), pushed(3, 300)
    with pytest.raises(SimulationError, match=r'noise of readings: "axis.position" is 0; give a positive number'):
        Noise({"axis.position": 0.0})
    with pytest.raises(SimulationError, match=r'noise of readings: "axis.position" has none'):
        vpm.observe(model, record, noise=Noise({}, {"axis": 1.0}))
    with pytest.raises(SimulationError, match=r'noise of forces: "axle" is unknown'):
        vpm.observe(model, record, noise=Noise({"axis.position": 1e-5}, {"axle": 1.0}))
    with pytest.raises(SimulationError, match=r'channels: "axis.place" is unknown'):
        vpm.observe(model, record, channels=["axis.place"])
    with pytest.raises(ExperimentError, match=r'channels: "axis.velocity" is not in pushed 3'):
        vpm.observe(model, record, channels=["axis.velocity"])
    bare = Experiment.from_arrays(record.time, {"drive.command": record["drive.command"]}, model=model, name="bare")
    with pytest.raises(SimulationError, match=r"bare: an observer compares measured outputs"):
        vpm.observe(model, bare)


def cart_record(observer: Observer, samples: int, seed: int) -> tuple[Array, Array, Array]:
    """Squared errors of estimates and of innovations in units of what they are said to be, and innovations."""
    random, model = np.random.default_rng(seed), observer.model
    linear = model.linearize()
    transition, _ = linear.sampled(PERIOD)
    push = 0.5 * PERIOD * (transition + np.eye(2)) @ np.array([0.0, 0.5])
    state = random.normal(size=2) * [1e-2, 1.0]
    observer.reset()
    errors, sizes, innovations = [], [], []
    for _ in range(samples):
        found = observer.step([state[0] + 1e-3 * random.normal()], [0.0])
        off = found - state
        errors.append(off @ np.linalg.solve(observer.covariance, off))
        innovations.append(observer.innovation[0] / np.sqrt(observer.innovation_covariance[0, 0]))
        sizes.append(innovations[-1] ** 2)
        state = transition @ state + 2.0 * random.normal() * push + random.normal(size=2) * [1e-5, 1e-4]
    return np.array(errors), np.array(sizes), np.array(innovations)


@pytest.mark.parametrize("steady", [False, True])
def test_estimates_err_as_much_as_the_observer_says(steady: bool) -> None:
    observer = Observer(Model.from_toml(CART), PERIOD, ["axis.position"], CART_NOISE, steady=steady)
    runs = [cart_record(observer, 300, seed) for seed in range(4)]
    errors, sizes, innovations = (np.concatenate([run[part][50:] for run in runs]) for part in range(3))
    # Means of chi squared over 1000 samples; errors of estimates are correlated over some five samples.
    assert np.mean(errors) == pytest.approx(2.0, abs=4.0 * np.sqrt(4.0 * 10.0 / 1000.0))
    assert np.mean(sizes) == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / 1000.0))
    ahead = [np.mean(innovations[lag:] * innovations[:-lag]) for lag in range(1, 6)]
    assert np.abs(ahead).max() < 4.0 / np.sqrt(1000.0)


def test_samples_one_by_one_are_the_filter_of_the_record() -> None:
    arm, random = nominal(), np.random.default_rng(3)
    n, states = len(arm.actuators), len(arm.state_names)
    noise = Noise(dict.fromkeys(CHANNELS, 1e-3), {"shoulder": 0.3, "elbow": 0.1}, {"elbow.velocity": 1e-3})
    observer = Observer(arm, 2e-3, CHANNELS, noise)
    inputs, readings = random.normal(size=(60, n)), 0.01 * random.normal(size=(60, 2))
    spreads = (*noise.placed(arm, CHANNELS), np.array([1e-2, 1e-2, 1.0, 1.0, *[0.01] * (states - 4)]))
    places = [arm.output_channels.index(name) for name in CHANNELS]
    method = "rosenbrock"
    observer = Observer(arm, 2e-3, CHANNELS, noise, deviations=spreads[3], integrator=method)
    innovations, covariances, _, filtered, deviations = arm.core.filter(
        arm.theta, arm.state(), inputs, places, readings, spreads, 2e-3, 1, method
    )
    for row in range(60):
        np.testing.assert_allclose(observer.step(readings[row], inputs[row]), filtered[row], rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(observer.innovation, innovations[row], rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(observer.innovation_covariance, covariances[row], rtol=1e-9)
        np.testing.assert_allclose(np.sqrt(np.diag(observer.covariance)), deviations[row], rtol=1e-9)


def test_a_steady_gain_is_where_the_filter_settles() -> None:
    model = Model.from_toml(CART)
    settled, steady = (Observer(model, PERIOD, ["axis.position"], CART_NOISE, steady=kind) for kind in (False, True))
    for _ in range(400):
        settled.step([0.0], [0.0])
    steady.step([0.0], [0.0])
    np.testing.assert_allclose(steady.covariance, settled.covariance, rtol=1e-6)
    np.testing.assert_allclose(steady.innovation_covariance, settled.innovation_covariance, rtol=1e-6)
    for observer in (settled, steady):
        observer.step([0.01], [1.0])
    np.testing.assert_allclose(steady.predicted, settled.predicted, rtol=1e-6)


def test_a_reading_that_does_not_come_tells_nothing() -> None:
    observer = Observer(Model.from_toml(CART), PERIOD, ["axis.position"], CART_NOISE)
    observer.step([0.0], [0.0])
    expected, before = observer.predicted, observer.covariance
    np.testing.assert_array_equal(observer.step([np.nan], [0.0]), expected)
    assert np.isnan(observer.innovation[0])
    assert observer.covariance[0, 0] > before[0, 0]


def test_what_cannot_be_observed_is_refused() -> None:
    model = Model.from_toml(CART)
    with pytest.raises(SimulationError, match="unknown"):
        Observer(model, PERIOD, ["axis.positon"], CART_NOISE)
    with pytest.raises(SimulationError, match="at least one channel"):
        Observer(model, PERIOD, [], CART_NOISE)
    with pytest.raises(SimulationError, match=r'"axis.velocity" has none'):
        Observer(model, PERIOD, ["axis.velocity"], CART_NOISE)
    with pytest.raises(SimulationError, match="time_step"):
        Observer(model, 0.0, ["axis.position"], CART_NOISE)
    free = CART.replace("stiffness = 50.0", "stiffness = 0.0")
    with pytest.raises(SimulationError, match="no steady gain"):
        Observer(Model.from_toml(free), PERIOD, ["axis.velocity"], Noise({"axis.velocity": 1e-3}), steady=True)
    late = CART + '\n[[effects]]\ntype = "input_delay"\nat = "drive"\ntime = 0.02\n'
    with pytest.raises(SimulationError, match="delay"):
        Observer(Model.from_toml(late), PERIOD, ["axis.position"], CART_NOISE)
    observer = Observer(model, PERIOD, ["axis.position"], CART_NOISE)
    with pytest.raises(SimulationError, match="readings"):
        observer.step([0.0, 0.0], [0.0])
    with pytest.raises(SimulationError, match="inputs"):
        observer.step([0.0], [np.nan])
    with pytest.raises(SimulationError, match="covariance"):
        observer.reset(covariance=[[1.0]])
