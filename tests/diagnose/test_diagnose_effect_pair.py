"""Two effects that are missing at once: a law that imitates both is not named for them."""

import pytest

import vpm
from shared_cases import shared_case


@pytest.mark.nightly
def test_a_late_drive_and_friction_that_is_missing_are_named_for_the_law_that_imitates_both() -> None:
    """Alone the lag takes four fifths of the training residual and predicts the validation record worse than none."""
    case = shared_case("axis_linear", ("actuator_lag", "viscous_friction"), 5004)
    tried = ["actuator_lag", "input_delay", "viscous_friction", "hysteresis"]
    why = vpm.diagnose(case.model(), case.train, case.validate, effects=tried, workers=1)
    assert {(effect.name, effect.site) for effect in why.effects} == {
        ("actuator_lag", "drive"),
        ("viscous_friction", "axis"),
    }
    assert {c.name for c in why.candidates if c.accepted} == {"actuator_lag", "viscous_friction"}
    truth = {f"{h.name}": h.parameters for h in case.truth.hidden}
    found = {effect.name: effect.parameters[0] for effect in why.effects}
    assert found["actuator_lag"].value == pytest.approx(truth["actuator_lag"]["time_constant"], rel=0.1)
    assert found["viscous_friction"].value == pytest.approx(truth["viscous_friction"]["viscous"], rel=0.05)


@pytest.mark.nightly
def test_one_effect_alone_gets_no_partner() -> None:
    case = shared_case("axis_linear", "viscous_friction", 5004)
    tried = ["actuator_lag", "input_delay", "viscous_friction", "hysteresis"]
    why = vpm.diagnose(case.model(), case.train, case.validate, effects=tried, workers=1)
    assert [(effect.name, effect.site) for effect in why.effects] == [("viscous_friction", "axis")]


@pytest.mark.nightly
def test_a_spring_beside_a_hysteresis_is_fitted_where_the_tangent_at_its_start_does_not_lead() -> None:
    case = shared_case("axis_rotary", ("hysteresis", "joint_compliance"), 5002)
    tried = ["hysteresis", "joint_compliance"]
    why = vpm.diagnose(case.model(), case.train, case.validate, effects=tried, workers=1)
    assert {(effect.name, effect.site) for effect in why.effects} == {
        ("hysteresis", "axis"),
        ("joint_compliance", "axis"),
    }
    hidden = next(h for h in case.truth.hidden if h.name == "joint_compliance")
    stiffness = why.model.parameters["axis.compliance.stiffness"].value
    assert stiffness == pytest.approx(hidden.parameters["stiffness"], rel=0.1)
