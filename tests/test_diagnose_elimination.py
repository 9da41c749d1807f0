"""Backward elimination: what a later effect says as well, with a parameter that was held for the sake of the first."""

from __future__ import annotations

import pytest

import vpm
from blind import make_case


def test_a_spring_that_may_rest_elsewhere_needs_no_constant_force_beside_it() -> None:
    case = make_case("axis_rotary", "spring", 2)
    (hidden,) = case.truth.hidden
    why = vpm.diagnose(case.model(), case.train, case.validate, effects=["bias_force", "spring"], workers=1)
    assert [step.change for step in why.steps] == ["recalibrated", "added", "added", "removed"]
    assert [(effect.name, effect.site) for effect in why.effects] == [("spring", "axis")]
    values = {parameter.name: parameter for parameter in why.effects[0].parameters}
    for name in ("stiffness", "rest"):
        assert values[name].std > 0.0
        assert values[name].value == pytest.approx(hidden.parameters[name], abs=3.0 * values[name].std)
    assert not any("rest" in other for ambiguity in why.ambiguous_with for other in ambiguity.others)


def test_a_constant_force_gives_way_to_a_friction_that_differs_between_the_ways() -> None:
    # A delay hides at first that viscous friction differs too, so that a constant force says it in fewer numbers.
    hidden = ("asymmetric_friction", "input_delay")
    case = make_case("axis_rotary", hidden, 1004)
    why = vpm.diagnose(case.model(), case.train, case.validate, effects=["bias_force", *hidden], workers=1)
    assert [(step.change, step.effect) for step in why.steps][1:] == [
        ("added", "bias_force"),
        ("added", "input_delay"),
        ("added", "asymmetric_friction"),
        ("removed", "bias_force"),
    ]
    assert sorted(effect.name for effect in why.effects) == sorted(hidden)
    friction = next(effect for effect in why.effects if effect.name == "asymmetric_friction")
    difference = next(p for p in friction.parameters if p.name == "coulomb_difference")
    (true,) = (h.parameters["coulomb_difference"] for h in case.truth.hidden if h.name == "asymmetric_friction")
    assert difference.value == pytest.approx(true, rel=0.1)
