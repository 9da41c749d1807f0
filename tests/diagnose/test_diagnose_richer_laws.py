"""A richer law and a constant force that says a part of it: the search names one of them, with its values."""

import pytest

import vpm
from shared_cases import shared_case


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("name", "seed", "values"),
    [("spring", 9, ("stiffness", "rest")), ("asymmetric_friction", 5, ("coulomb_difference", "viscous_difference"))],
)
def test_no_constant_force_stands_beside_a_richer_law(name: str, seed: int, values: tuple[str, str]) -> None:
    case = shared_case("axis_rotary", name, seed)
    (hidden,) = case.truth.hidden
    why = vpm.diagnose(case.model(), case.train, case.validate, effects=["bias_force", name], workers=1)
    assert [(effect.name, effect.site) for effect in why.effects] == [(name, "axis")]
    found = {parameter.name: parameter for parameter in why.effects[0].parameters}
    for one in values:
        assert found[one].std > 0.0
        assert found[one].value == pytest.approx(hidden.parameters[one], abs=3.0 * found[one].std)
    assert not any("rest" in other for ambiguity in why.ambiguous_with for other in ambiguity.others)
