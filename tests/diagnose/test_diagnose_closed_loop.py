"""Two missing effects: the inverse-dynamics residual leaves one open, closed-loop predictions do not."""

from types import SimpleNamespace
from typing import cast

import pytest

import vpm
from shared_cases import shared_case
from vpm.catalogue import EFFECTS
from vpm.discrepancy.confirmation.confirmation import Data, Trial
from vpm.discrepancy.rivals import rival_discrimination
from vpm.discrepancy.search import forward_step
from vpm.discrepancy.search.candidate_choice import Accepted
from vpm.discrepancy.search.search_round import Round


@pytest.mark.nightly
def test_a_force_and_a_tilt_that_a_balance_takes_for_each_other_are_told_apart() -> None:
    """They differ by a cosine of the angle: 4 % of what the balance leaves, eighty deviations of the noise in runs."""
    case = shared_case("axis_rotary", ("gravity_tilt", "stribeck_friction"), 102)
    tried = ["bias_force", "gravity_tilt", "stribeck_friction"]
    why = vpm.diagnose(case.model(), case.train, case.validate, effects=tried, names="search", workers=1)
    assert {effect.name for effect in why.effects} == {"gravity_tilt", "stribeck_friction"}
    assert any("closed-loop predictions support" in r.reason for r in why.refused if r.name == "bias_force")


@pytest.mark.nightly
def test_a_late_drive_is_named_for_a_force_where_one_reversal_outweighs_all_else() -> None:
    case = shared_case("axis_rotary", ("asymmetric_friction", "input_delay"), 7009)
    tried = ["asymmetric_friction", "bias_force", "input_delay"]
    why = vpm.diagnose(case.model(), case.train, case.validate, effects=tried, names="search", workers=1)
    assert {effect.name for effect in why.effects} == {"asymmetric_friction", "input_delay"}


@pytest.mark.nightly
def test_an_effect_of_a_modest_part_is_named_if_runs_ask_for_all_of_it() -> None:
    """A dead zone takes a quarter of what a ripple leaves of the balance: seven deviations of the ten it would need."""
    case = shared_case("axis_rotary", ("dead_zone", "torque_ripple"), 102)
    tried = ["dead_zone", "torque_ripple", "hysteresis"]
    why = vpm.diagnose(case.model(), case.train, case.validate, effects=tried, names="search", workers=1)
    assert {effect.name for effect in why.effects} == {"dead_zone", "torque_ripple"}
    hidden = next(h for h in case.truth.hidden if h.name == "dead_zone")
    width = next(effect for effect in why.effects if effect.name == "dead_zone").parameters[0]
    assert width.value == pytest.approx(hidden.parameters["width"], rel=0.1)


@pytest.mark.nightly
def test_runs_ask_for_nothing_where_nothing_is_missing() -> None:
    case = shared_case("axis_rotary", "parameters", 100)
    tried = ["torque_ripple", "dead_zone", "stribeck_friction"]
    why = vpm.diagnose(case.model(), case.train, case.validate, effects=tried, names="search", workers=1)
    assert not why.effects


@pytest.mark.nightly
def test_a_spring_that_swings_above_the_band_of_a_balance_is_found_in_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where a balance believes nothing; nothing was accepted before it, and it is examined as any other."""
    monkeypatch.setattr(Round, "best", lambda _: None)
    case = shared_case("axis_rotary", "joint_compliance", 101)
    why = vpm.diagnose(case.model(), case.train, case.validate, effects=["joint_compliance"], names="search", workers=1)
    assert [effect.name for effect in why.effects] == ["joint_compliance"]
    values = {p.name: p.value for p in why.effects[0].parameters}
    assert values["stiffness"] == pytest.approx(case.truth.hidden[0].parameters["stiffness"], rel=0.1)
    assert why.verdict == "effect_found"


def test_what_runs_find_late_is_chosen_among_all_that_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a delay and a lag the criterion of one run says little; their difference along the reference is asked."""

    def entry(name: str) -> Accepted:
        return cast("Accepted", SimpleNamespace(effect=EFFECTS[name], trial=name))

    chosen = entry("input_delay")
    monkeypatch.setattr(forward_step, "choose", lambda trials, _: chosen if "input_delay" in trials else None)
    lag, delay, spring = (entry(name) for name in ("actuator_lag", "input_delay", "spring"))
    data = cast("Data", None)
    assert forward_step._best([lag, spring, delay], data) is chosen
    assert forward_step._best([spring, lag, delay], data) is spring
    assert forward_step._best([lag, spring], data) is lag


def test_what_the_samples_cannot_show_takes_no_place_whatever_runs_say(monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs of a real machine prefer whatever follows it more closely, be it dry friction under another name."""
    refused = {("force",): "", ("displacement",): "no"}
    monkeypatch.setattr(rival_discrimination, "impossible_trial", lambda trial, _: refused[trial.parameters])
    fine, none = (SimpleNamespace(diverged="", parameters=(name,)) for name in ("force", "displacement"))
    assert rival_discrimination._possible(cast("Trial", fine), 1e-3)
    assert not rival_discrimination._possible(cast("Trial", none), 1e-3)
