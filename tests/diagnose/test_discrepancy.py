"""Effects hidden in an axis that was simulated by other code: named, or not, as they should be."""

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from nightly import at_night
from synthetic import Truth, nominal, simulate_axis
from vpm.diagnosing import diagnose
from vpm.discrepancy import Diagnosis
from vpm.errors import DiagnosisError, ExperimentError

SECONDS = 16.0

HIDDEN = {
    "coulomb_friction": Truth(coulomb=9.0),
    "bias_force": Truth(bias=5.0),
    "spring": Truth(stiffness=150.0),
    "torque_ripple": Truth(ripple=4.0),
    "input_delay": Truth(delay=0.007),
    "dead_zone": Truth(dead_zone=0.4),
    "actuator_lag": Truth(lag=0.012),
}


def found(diagnosis: Diagnosis) -> list[str]:
    return [e.name for e in diagnosis.effects]


#: What is known of the size that each is found with, and the share that it may be off.
SIZES = {
    "coulomb_friction": ("axis.friction.coulomb", 9.0, 0.05),
    "bias_force": ("axis.bias.force", 5.0, 0.05),
    "spring": ("axis.spring.stiffness", 150.0, 0.10),
    "torque_ripple": ("axis.ripple.period", 0.02, 0.01),
    "input_delay": ("drive.delay.time", 0.007, 0.10),
    "dead_zone": ("drive.dead_zone.width", 0.4, 0.15),
    "actuator_lag": ("drive.lag.time_constant", 0.012, 0.15),
}
#: A friction, a force that depends on the place, a drive: those that are looked for outside of `make test-nightly`.
EACH = at_night(HIDDEN, but=("coulomb_friction", "torque_ripple", "input_delay"))


@cache
def of(name: str) -> Diagnosis:
    """The diagnosis of a hidden effect: a record to fit and another, of another seed, to judge."""
    train, test = simulate_axis(HIDDEN[name], 2, SECONDS, first_seed=100)
    return diagnose(nominal(), train, test)


@pytest.mark.parametrize("name", EACH)
def test_names_the_hidden_effect(name: str) -> None:
    diagnosis = of(name)
    assert diagnosis.verdict == "effect_found"
    assert found(diagnosis)[0] == name
    assert diagnosis.gap["axis.effort"].after < 0.7 * diagnosis.gap["axis.effort"].recalibrated


@pytest.mark.parametrize("name", EACH)
def test_adds_nothing_else(name: str) -> None:
    assert found(of(name)) == [name]


@pytest.mark.parametrize("name", EACH)
def test_finds_the_size_of_the_effect(name: str) -> None:
    parameter, value, tolerance = SIZES[name]
    assert of(name).model.parameters[parameter].value == pytest.approx(value, rel=tolerance)


def test_two_effects_at_once() -> None:
    train, test = simulate_axis(Truth(coulomb=9.0, bias=5.0), 2, SECONDS, first_seed=7)
    assert sorted(found(diagnose(nominal(), train, test))) == ["bias_force", "coulomb_friction"]


def test_a_wrong_parameter_is_not_a_missing_effect() -> None:
    train, test = simulate_axis(Truth(mass=22.0, viscous=54.0), 2, SECONDS, first_seed=11)
    diagnosis = diagnose(nominal(), train, test)
    assert diagnosis.verdict == "parameters_only"
    assert diagnosis.model.parameters["slide.mass"].value == pytest.approx(22.0, rel=0.01)


def test_agreement_is_called_agreement() -> None:
    train, test = simulate_axis(Truth(mass=20.0, viscous=60.0), 2, SECONDS, first_seed=13)
    diagnosis = diagnose(nominal(), train, test)
    assert diagnosis.verdict == "no_disagreement"


@pytest.mark.parametrize("seeds", [3, pytest.param(50, marks=pytest.mark.nightly)])
def test_at_most_one_false_alarm_in_fifty_and_none_in_the_first(seeds: int) -> None:
    """Nothing is missing; mass, friction, noise of the encoder and of the force differ from seed to seed."""
    generator = np.random.default_rng(5)
    alarms = list[str]()
    for seed in range(seeds):
        truth = Truth(
            mass=20.0 * generator.uniform(0.9, 1.1),
            viscous=60.0 * generator.uniform(0.9, 1.1),
            noise=generator.uniform(0.5e-6, 8e-6),
            force_noise=generator.choice([0.0, 0.5]),
        )
        diagnosis = diagnose(nominal(), *simulate_axis(truth, 1, SECONDS, first_seed=1000 + seed))
        if diagnosis.verdict not in {"parameters_only", "no_disagreement"}:
            alarms.append(diagnosis.summary)
    assert len(alarms) <= seeds // 50, alarms


def test_what_no_effect_explains_is_called_unexplained() -> None:
    train, test = simulate_axis(Truth(cubic=3000.0), 2, SECONDS, first_seed=17)
    diagnosis = diagnose(nominal(), train, test, effects=["bias_force", "torque_ripple", "payload"])
    assert diagnosis.verdict == "unexplained"


def test_report_json_has_the_promised_keys(tmp_path: Path) -> None:
    report = json.loads(of("coulomb_friction").save_json(tmp_path / "report.json").read_text(encoding="utf-8"))
    promised = {"verdict", "effects", "gap", "refused", "candidates", "ambiguous_with", "where"}
    assert set(report) >= promised
    (effect,) = report["effects"]
    assert (effect["name"], effect["site"]) == ("coulomb_friction", "axis")
    assert set(effect["parameters"]["coulomb"]) >= {"value", "unit", "std"}
    assert all(set(entry) == {"name", "site", "reason"} for entry in report["refused"])


def test_saved_diagnosis_loads_as_it_was(tmp_path: Path) -> None:
    diagnosis = of("coulomb_friction")
    assert Diagnosis.load(diagnosis.save(tmp_path / "diagnosis.npz")) == diagnosis


def test_unknown_effect_is_refused_by_name() -> None:
    (record,) = simulate_axis(Truth(), 1, 4.0)
    with pytest.raises(DiagnosisError, match='no effect "coulomb_frction"; did you mean "coulomb_friction"'):
        diagnose(nominal(), record, effects=["coulomb_frction"])


def test_missing_command_is_named() -> None:
    (record,) = simulate_axis(Truth(), 1, 4.0)
    bare = type(record).from_arrays(
        record.time, {"axis.position": record["axis.position"]}, units={"axis.position": "m"}, name="bare"
    )
    with pytest.raises(ExperimentError, match=r"drive\.command"):
        diagnose(nominal(), bare)
