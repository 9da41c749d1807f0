"""A diagnosis that takes its names from a ranking: which machines, what is refitted, what is said of the others."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import vpm
from sledge import MASS, SLEDGE, swung
from synthetic import Truth, nominal, simulate_axis
from vpm import naming
from vpm.diagnosing import diagnose
from vpm.discrepancy import ranked_effects
from vpm.discrepancy.judged_model import unmoved
from vpm.errors import DiagnosisError, VpmError
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.ranking import Judgement, Ranked, Ranking
from vpm.ranking import Settings as Asked
from vpm.ranking.result import Gap

COULOMB = {"axis.friction.coulomb": 8.8, "axis.friction.transition_velocity": 1e-3}
BIAS = {"axis.bias.force": 4.5}


def ranking(*effects: Ranked, model: Model | None = None, others: tuple[Ranked, ...] = ()) -> Ranking:
    """What a ranking says that found these, one in each round, and the ``others`` in all of them in vain."""
    whole = nominal() if model is None else model
    for one in effects if model is None else ():
        whole = whole.with_effect(one.effect, one.site).with_parameters(one.values)
    rounds = (*((one, *others) for one in effects), others)
    return Ranking(effects, rounds, whole, whole)


def tried(effect: str, values: dict[str, float], least: float, **more: Any) -> Ranked:
    """An effect that removes so much, clearly."""
    return Ranked(effect, "axis", values, Judgement(least, least, 9.0, 0.1, 1.0, 1.0), 1.0, **more)


def seen_by_tracker(recalibrated: float, after: float) -> Gap:
    """What an observer leaves of a channel without noise, the model as it was a half worse."""
    left = (after / recalibrated) ** 2 if recalibrated else float("nan")
    return Gap(1.5 * recalibrated, recalibrated, after, "m", left=left, noise=0.0, signal=10.0)


def two() -> Ranking:
    """Dry friction, which has a rival, and a constant force."""
    rival = tried("spring", {"axis.spring.stiffness": 1.0}, 0.03)
    first = tried("coulomb_friction", COULOMB, 0.9, evidence=900.0, probability=0.99, rivals=("spring at axis",))
    second = tried("bias_force", BIAS, 0.8, evidence=80.0, probability=0.95)
    return ranking(first, second, others=(rival,))


@pytest.fixture(scope="module")
def records() -> list[Experiment]:
    return list(simulate_axis(Truth(coulomb=9.0, bias=5.0), 2, 12.0, first_seed=7))


@pytest.fixture
def named(monkeypatch: pytest.MonkeyPatch, records: list[Experiment]) -> vpm.Diagnosis:
    monkeypatch.setattr(naming, "rank", lambda *_, **__: two())
    return diagnose(nominal(), records[0], records[1], workers=1)


def test_names_and_their_order_are_those_of_the_ranking(named: vpm.Diagnosis) -> None:
    assert named.verdict == "effect_found"
    assert [(e.name, e.evidence_nats, e.probability) for e in named.effects] == [
        ("coulomb_friction", 900.0, 0.99),
        ("bias_force", 80.0, 0.95),
    ]
    assert [step.effect for step in named.steps] == ["", "coulomb_friction", "bias_force"]
    assert all(e.gain > 0.1 and e.score > 2.0 for e in named.effects)
    assert any(note.startswith("names come from a ranking") for note in named.notes)


def test_values_are_those_of_the_balance(named: vpm.Diagnosis) -> None:
    assert named.model.parameters["axis.friction.coulomb"].value == pytest.approx(9.0, rel=0.02)
    assert named.model.parameters["axis.bias.force"].value == pytest.approx(5.0, rel=0.02)
    assert named.effects[0].parameters[0].std > 0.0


def test_what_was_tried_in_vain_is_refused_with_its_numbers(named: vpm.Diagnosis) -> None:
    reasons = {refused.name: refused.reason for refused in named.refused}
    assert reasons["spring"] == "it removes 3 % of the error power; 6 % have to go"
    assert "predicted less evidence" in reasons["torque_ripple"]
    assert "empirical_force" not in reasons
    assert not {"coulomb_friction", "bias_force"} & set(reasons)
    assert [(c.name, c.round, c.accepted) for c in named.candidates if c.accepted] == [
        ("coulomb_friction", 1, True),
        ("bias_force", 2, True),
    ]


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("score", 2.0, "2 standard deviations, 3 are needed"),
        ("size", 0.001, "0.1 % of what all effects of the model do"),
        ("beside", 0.04, "4 % of what the effects that were found do"),
        ("shape", 0.01, "1 % of what the same states do there"),
        ("alone", 1.02, "102 % of the error power of a mass on which nothing acts"),
        ("least", 0.5, "its shape ends where the records do"),
    ],
)
def test_each_reason_is_one_sentence(name: str, value: float, said: str) -> None:
    one = tried("spring", {}, 0.5)
    object.__setattr__(one.judgement, name, value)
    assert said in ranked_effects._reason(ranked_effects._Last(one, None, came_in=False), Asked())


def test_what_is_not_told_apart_is_one_class(named: vpm.Diagnosis, tmp_path: Path) -> None:
    assert named.classes == (("coulomb_friction at axis", "spring at axis"),)
    (told,) = [a for a in named.ambiguous_with if "spring at axis" in a.others]
    assert told.reason == "the records do not discriminate them"
    assert [e.rival for e in named.experiments] == ["spring at axis"]
    report = json.loads(named.save_json(tmp_path / "report.json").read_text(encoding="utf-8"))
    assert report["classes"] == [["coulomb_friction at axis", "spring at axis"]]
    assert [e["evidence_nats"] for e in report["effects"]] == [900.0, 80.0]
    assert [e["probability"] for e in report["effects"]] == [0.99, 0.95]


def test_a_ranking_learns_from_the_training_records_alone(
    monkeypatch: pytest.MonkeyPatch, records: list[Experiment]
) -> None:
    seen: list[list[str]] = []

    def asked(
        _: Model, given: list[Experiment], validation: list[Experiment], *, settings: Asked, **__: object
    ) -> Ranking:
        assert settings.effects == 3
        seen.append([record.name for record in (*given, *validation)])
        return ranking()

    monkeypatch.setattr(naming, "rank", asked)
    diagnose(nominal(), records[0], records[1], limit=3, workers=1)
    assert seen == [[records[0].name, records[1].name]]


@pytest.mark.parametrize(("after", "word"), [(0.2, "effect_found"), (1.1, "unexplained")])
def test_names_that_leave_more_of_validation_records_are_no_explanation(
    after: float, word: str, monkeypatch: pytest.MonkeyPatch, records: list[Experiment]
) -> None:
    told = {"axis.position": seen_by_tracker(1.0, after), "tip.position": seen_by_tracker(0.0, 0.0)}
    seen = replace(two(), gaps=told)
    assert seen.left == {"axis": after**2}
    monkeypatch.setattr(naming, "rank", lambda *_, **__: seen)
    assert diagnose(nominal(), records[0], records[1], workers=1).verdict == word


def test_names_that_explain_validation_records_stand_whatever_the_balance_leaves(
    monkeypatch: pytest.MonkeyPatch, records: list[Experiment]
) -> None:
    """A play is hardly seen in a balance. Here only a trifle is named, and half of the gap is left there."""
    small = ranking(tried("bias_force", BIAS, 0.9, evidence=900.0, probability=0.99))
    words = []
    for left in (float("nan"), 0.1):
        seen = replace(small, gaps={"axis.position": seen_by_tracker(1.0, left**0.5)})
        monkeypatch.setattr(naming, "rank", lambda *_, seen=seen, **__: seen)
        words.append(diagnose(nominal(), records[0], records[1], workers=1).verdict)
    assert words == ["unexplained", "effect_found"]


def test_names_that_leave_more_of_an_effort_than_it_is_explain_nothing(
    monkeypatch: pytest.MonkeyPatch, records: list[Experiment]
) -> None:
    """An observer draws too heavy a machine along; its efforts tell."""
    words = []
    for mass in (1.0, 1e4):
        heavy = ranking(tried("rotor_inertia", {"axis.rotor.inertia": mass}, 0.9, evidence=900.0, probability=0.99))
        seen = replace(heavy, gaps={"axis.position": seen_by_tracker(1.0, 0.1)})
        monkeypatch.setattr(naming, "rank", lambda *_, seen=seen, **__: seen)
        monkeypatch.setattr(ranked_effects, "judged_anyhow", lambda *asked: (unmoved(*asked), ""))
        words.append(diagnose(nominal(), records[0], records[1], workers=1).verdict)
    assert words == ["effect_found", "unexplained"]


def test_ctrl_c_in_the_ranking_gives_what_is_known(monkeypatch: pytest.MonkeyPatch, records: list[Experiment]) -> None:
    def stopped(*_: object, **__: object) -> Ranking:
        raise KeyboardInterrupt

    monkeypatch.setattr(naming, "rank", stopped)
    stated = vpm.Setup(hold="first_order")
    why = diagnose(nominal(), records[0], records[1], setup=stated, workers=1)
    assert why.interrupted
    assert why.effects == ()
    assert any(note.startswith("stopped by Ctrl-C") for note in why.notes)
    assert not any("simulate with hold" in note for note in why.notes)  # nothing was found out: what was stated stands


def test_where_a_ranking_fails_nothing_is_named(monkeypatch: pytest.MonkeyPatch, records: list[Experiment]) -> None:
    def failed(*_: object, **__: object) -> Ranking:
        raise VpmError("the axis runs away from the records")

    monkeypatch.setattr(naming, "rank", failed)
    why = diagnose(nominal(), records[0], records[1], limit=2, workers=1)
    assert (why.verdict, why.effects) == ("unexplained", ())
    (note,) = [note for note in why.notes if note.startswith("nothing could be named")]
    assert "runs away" in note


def test_a_name_without_inverse_dynamics_is_measured_by_its_tracker(
    monkeypatch: pytest.MonkeyPatch, records: list[Experiment]
) -> None:
    """What a ranking found is not lost where no residual can be computed with it."""

    def lost(*_: object) -> None:
        raise VpmError("the efforts run away")

    monkeypatch.setattr(ranked_effects, "_beside", lost)
    why = diagnose(nominal(), records[0], records[1], workers=1)
    assert why.verdict == "effect_found"
    assert {effect.name for effect in why.effects} == {"coulomb_friction", "bias_force"}
    assert all("(observed)" in channel for channel in why.gap)
    assert any("the efforts run away: all is measured by what an observer" in note for note in why.notes)


def test_a_refit_that_simulates_worse_is_not_kept(monkeypatch: pytest.MonkeyPatch, records: list[Experiment]) -> None:
    monkeypatch.setattr(naming, "rank", lambda *_, **__: two())
    for limit in ("LEAST_GAIN", "NORMAL_95_ONE_SIDED"):
        monkeypatch.setattr(ranked_effects, limit, -np.inf)
    why = diagnose(nominal(), records[0], records[1], workers=1)
    step = why.steps[1]
    assert step.values["axis.friction.coulomb"] == pytest.approx(8.8)
    assert step.std["axis.friction.coulomb"] > 0.0


def test_a_ranking_is_asked_for_the_effects_that_are_asked_for(
    monkeypatch: pytest.MonkeyPatch, records: list[Experiment]
) -> None:
    asked: list[object] = []

    def rank(*_: object, effects: object, **__: object) -> Ranking:
        asked.append(effects)
        return ranking()

    monkeypatch.setattr(naming, "rank", rank)
    diagnose(nominal(), records[0], records[1], effects=["quadratic_drag"], workers=1)
    assert asked == [["quadratic_drag"]]


def test_what_is_no_law_or_no_effect_is_not_tried(records: list[Experiment]) -> None:
    for call in (diagnose, vpm.rank):
        with pytest.raises(DiagnosisError, match='"empirical_force" is not among the effects that are tried'):
            call(nominal(), records[0], effects=["empirical_force"])
        with pytest.raises(DiagnosisError, match='no effect "coulomb_frction"; did you mean'):
            call(nominal(), records[0], effects=["coulomb_frction"])


def test_a_parameter_without_a_derivative_along_the_motion_is_not_told_by_a_balance() -> None:
    """Behind a play two motions part ever faster, and squares of derivatives overflow."""
    columns = np.array([[1.0, 1e200, np.inf], [0.0, 1e200, 0.0]])
    assert ranked_effects._has_derivatives(columns).tolist() == [True, False, False]


def test_what_commands_do_between_samples_is_found_and_holds_for_balances_and_runs() -> None:
    """Held for a sample, efforts that were read back come half a sample late: a spring would take that back."""
    model, effects = Model.from_toml(SLEDGE), ["joint_compliance", "actuator_lag"]
    why = diagnose(model, swung(1), swung(2), effects=effects, setup=vpm.Setup(horizon=0.1), workers=1)
    assert why.verdict == "parameters_only"
    assert why.model.parameters["sledge.mass"].value == pytest.approx(MASS, rel=0.01)
    assert any("simulate with hold cubic" in note for note in why.notes)
    held = vpm.Setup(horizon=0.1, hold="zero_order")
    other = diagnose(model, swung(1), swung(2), effects=effects, setup=held, workers=1)
    assert not any("simulate with hold" in note for note in other.notes)
    for channel in why.gap:
        assert why.gap[channel].recalibrated < 0.2 * other.gap[channel].recalibrated
