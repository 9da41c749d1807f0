"""A model that follows its log: noise found again, innovations that are white, fits of prediction errors."""

import numpy as np
import pytest

import vpm
from model_texts import effect_text, on_rail, two_links
from vpm.errors import ExperimentError, ModelError, SimulationError
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.observer import Noise, Record, likely_noise

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
