"""Two effects that one record does not discriminate, and the experiment that does."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import vpm
from model_texts import DAMPED_AXIS
from vpm.discrepancy import ProposedExperiment
from vpm.discrepancy.rivals.discriminating_experiment import _imitation, experiments
from vpm.identify import InverseDynamicsProblem
from vpm.numbers import Array

STEP, NOISE = 1e-3, 0.02


def forward_only(seed: int, load: float) -> vpm.Experiment:
    """A motion that never turns round, with a constant load, by closed forms and not by the simulator."""
    generator = np.random.default_rng(seed)
    time = STEP * np.arange(8000)
    position, velocity, acceleration = 0.5 * time, np.full_like(time, 0.5), np.zeros_like(time)
    for number in range(1, 7):
        rate = 2.0 * np.pi * 0.25 * number
        size, phase = 0.3 / (6 * rate), generator.uniform(0.0, 2.0 * np.pi)
        position += size * np.sin(rate * time + phase)
        velocity += size * rate * np.cos(rate * time + phase)
        acceleration -= size * rate**2 * np.sin(rate * time + phase)
    assert velocity.min() > 0.05
    effort = 2.0 * acceleration + 3.0 * velocity + load + NOISE * generator.standard_normal(time.size)
    return vpm.Experiment.from_arrays(
        time,
        {"axis.position": position, "drive.command": effort},
        units={"axis.position": "m", "drive.command": "N"},
        name=f"forward {seed}",
    )


NAMES = ["bias_force", "coulomb_friction"]


@pytest.fixture(scope="module")
def why() -> vpm.Diagnosis:
    model, test = vpm.Model.from_toml(DAMPED_AXIS), forward_only(3, 2.0)
    return vpm.diagnose(model, [forward_only(1, 2.0), forward_only(2, 2.0)], test, effects=NAMES)


@pytest.fixture(scope="module")
def any_effect() -> vpm.Diagnosis:
    """The whole catalogue on the same records."""
    model = vpm.Model.from_toml(DAMPED_AXIS)
    test = forward_only(3, 2.0)
    return vpm.diagnose(model, [forward_only(1, 2.0), forward_only(2, 2.0)], test)


def test_a_load_and_a_friction_are_the_same_in_one_direction(why: vpm.Diagnosis) -> None:
    assert why.verdict == "effect_found"
    named = {why.effects[0].name, *(other.split(" at ")[0] for a in why.ambiguous_with for other in a.others)}
    assert named == set(NAMES)


def proposed(why: vpm.Diagnosis, first: str, second: str) -> ProposedExperiment:
    return next(e for e in why.experiments if {first, second} == pair(e))


def pair(experiment: ProposedExperiment) -> set[str]:
    return {experiment.effect.split(" at ")[0], experiment.rival.split(" at ")[0]}


def test_the_experiment_turns_round_and_shows_many_times_the_noise(why: vpm.Diagnosis) -> None:
    best = proposed(why, *NAMES)
    speed = np.gradient(best.excitation["axis.position"], best.excitation.time_step)
    assert speed.min() < -0.01
    assert speed.max() > 0.01
    assert best.ratio > 20.0
    # A force of 2 N that keeps its sign against one that turns it: 4 N half of the time, 2 N about its mean.
    assert 1.0 < best.difference < 2.9
    assert "times the noise" in best.sentence
    assert best.channel == "axis.effort"


@pytest.mark.nightly
def test_a_load_and_a_friction_of_one_direction_part_at_rest(any_effect: vpm.Diagnosis) -> None:
    """While the axis moves the two are one; only a rest shows the load, and the design finds the rests."""
    best = proposed(any_effect, "bias_force", "asymmetric_friction")
    speed = np.abs(best.excitation["axis.velocity"])
    rests = float(np.mean(speed < 1e-6))
    # 2 N at rest and nothing in motion: what a constant and a slope in speed and acceleration leave of that.
    load = np.where(speed < 1e-6, 2.0, 0.0)
    columns = np.column_stack([best.excitation["axis.velocity"], best.excitation["axis.acceleration"]])
    left = load - columns @ np.linalg.lstsq(columns, load, rcond=None)[0]
    assert 0.02 < rests < 0.9
    assert best.difference == pytest.approx(np.sqrt(np.mean(left**2)), rel=0.3)
    assert best.ratio > 20.0


def test_it_stays_within_what_was_seen(why: vpm.Diagnosis) -> None:
    position = np.concatenate([forward_only(seed, 2.0)["axis.position"] for seed in (1, 2)])
    for experiment in why.experiments:
        values = experiment.excitation["axis.position"]
        assert position.min() <= values.min()
        assert values.max() <= position.max()


@pytest.mark.nightly
def test_the_experiment_when_made_names_the_true_effect(why: vpm.Diagnosis, tmp_path: Path) -> None:
    """The proposed motion, run with the constant load that is really there, leaves one name."""
    path = proposed(why, *NAMES).excitation.to_csv(tmp_path / "motion.csv")
    motion = vpm.Experiment.load(path)
    generator = np.random.default_rng(5)
    time = motion.time
    position = motion["axis.position"]
    velocity = np.gradient(position, time)
    effort = 2.0 * np.gradient(velocity, time) + 3.0 * velocity + 2.0 + NOISE * generator.standard_normal(time.size)
    made = vpm.Experiment.from_arrays(
        time,
        {"axis.position": position, "drive.command": effort},
        units={"axis.position": "m", "drive.command": "N"},
        name="made",
    )
    model = vpm.Model.from_toml(DAMPED_AXIS)
    again = vpm.diagnose(model, [forward_only(1, 2.0), made.split(0.5)[0]], made.split(0.5)[1], effects=NAMES)
    assert [e.name for e in again.effects] == ["bias_force"]
    assert not again.ambiguous_with
    assert not again.experiments


def test_a_file_keeps_the_experiments(why: vpm.Diagnosis, tmp_path: Path) -> None:
    assert vpm.Diagnosis.load(why.save(tmp_path / "why.npz")).experiments == why.experiments
    told = why.to_dict()["experiments"]
    assert isinstance(told, list)
    assert len(told) == len(why.experiments)


def test_what_the_records_do_not_see_is_the_limit_of_what_they_see_badly() -> None:
    random = np.random.default_rng(5)
    slopes, change = random.standard_normal((60, 3)), random.standard_normal(60)

    def imitated(variance: float) -> Array:
        covariance = np.array([[0.02, 0.005, 0.0], [0.005, 0.01, 0.0], [0.0, 0.0, variance]])
        return _imitation(change, slopes, SimpleNamespace(fit=SimpleNamespace(covariance=covariance)), 0.5)  # type: ignore[arg-type]

    assert imitated(np.inf) == pytest.approx(imitated(1e10), rel=1e-6)
    assert imitated(np.inf)[2] != pytest.approx(imitated(1e-4)[2], rel=0.1)


def test_a_rival_whose_drive_has_states_is_left_out_and_does_not_end_the_judgement() -> None:
    """Friction of a drive does not follow from its command alone, so its efforts are not those of a planned motion."""
    model = vpm.Model.from_toml(DAMPED_AXIS)
    rival = model.with_effect("drive_friction", at="drive", driving=0.1)
    judged: Any = [SimpleNamespace(model=one) for one in (model, rival)]
    trial = SimpleNamespace(judged=judged[1], label="drive_friction at drive")
    rivals: Any = SimpleNamespace(site="axis", label="load_dependent_friction at axis", trials=(trial,))
    data = InverseDynamicsProblem(model, [forward_only(1, 2.0)])
    assert experiments(judged[0], [rivals], data, {}) == ()
