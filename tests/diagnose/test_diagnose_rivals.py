"""Effects beside plainer ones that say the same."""

import pytest

import vpm
from shared_cases import shared_case


@pytest.mark.nightly
@pytest.mark.parametrize("seed", [2, 7, 106])
def test_a_spring_is_named_and_not_the_constant_force_that_is_the_plainer_name(seed: int) -> None:
    """A spring that rests elsewhere holds a constant force, and in gravity looks like a shifted centre of mass."""
    case = shared_case("axis_rotary", "spring", seed)
    why = vpm.diagnose(case.model(), case.train, case.validate, effects=["bias_force", "spring"], workers=1)
    assert [(effect.name, effect.site) for effect in why.effects] == [("spring", "axis")]


@pytest.mark.nightly
def test_a_constant_force_keeps_its_name_where_finer_laws_know_nothing_more() -> None:
    case = shared_case("axis_rotary", "bias_force", 2)
    tried = ["bias_force", "spring", "asymmetric_friction"]
    why = vpm.diagnose(case.model(), case.train, case.validate, effects=tried, workers=1)
    assert [effect.name for effect in why.effects] == ["bias_force"]
