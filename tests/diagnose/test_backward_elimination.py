"""Backward elimination: what a later effect says as well, with a parameter that was held for the sake of the first."""

import pytest

import vpm
from shared_cases import shared_case


@pytest.mark.nightly
def test_a_spring_that_may_rest_elsewhere_needs_no_constant_force_beside_it() -> None:
    case = shared_case("axis_rotary", "spring", 2)
    (hidden,) = case.truth.hidden
    why = vpm.diagnose(
        case.model(), case.train, case.validate, effects=["bias_force", "spring"], names="search", workers=1
    )
    assert [step.change for step in why.steps] == ["recalibrated", "added", "added", "removed"]
    assert [(effect.name, effect.site) for effect in why.effects] == [("spring", "axis")]
    values = {parameter.name: parameter for parameter in why.effects[0].parameters}
    for name in ("stiffness", "rest"):
        assert values[name].std > 0.0
        assert values[name].value == pytest.approx(hidden.parameters[name], abs=3.0 * values[name].std)
    assert not any("rest" in other for ambiguity in why.ambiguous_with for other in ambiguity.others)


@pytest.mark.nightly
def test_a_difference_of_friction_with_a_size_of_its_own_needs_no_constant_force_beside_it() -> None:
    case = shared_case("axis_rotary", "asymmetric_friction", 2)
    (hidden,) = case.truth.hidden
    tried = ["bias_force", "asymmetric_friction"]
    why = vpm.diagnose(case.model(), case.train, case.validate, effects=tried, names="search", workers=1)
    changes = [(step.change, step.effect) for step in why.steps]
    assert ("added", "bias_force") in changes
    assert ("removed", "bias_force") in changes
    assert [(effect.name, effect.site) for effect in why.effects] == [("asymmetric_friction", "axis")]
    values = {parameter.name: parameter for parameter in why.effects[0].parameters}
    for name in ("coulomb_difference", "viscous_difference"):
        assert values[name].value == pytest.approx(hidden.parameters[name], abs=3.0 * values[name].std)
