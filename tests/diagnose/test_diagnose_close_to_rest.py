"""Friction close to rest, of which an inverse-dynamics residual shows too little: a ranking names it."""

import pytest

import vpm
from shared_cases import shared_case

CLOSE_TO_REST = "stribeck_friction"


@pytest.mark.nightly
def test_what_a_balance_hardly_sees_is_named() -> None:
    """It fades below 1.5 % of the speed: fitted to the residual, it predicts validation efforts worse than none."""
    case = shared_case("axis_linear", "stribeck_friction", 18)
    why = vpm.diagnose(case.model(), case.train, case.validate, effects=[CLOSE_TO_REST], workers=1)
    (found,) = why.effects
    (true,) = case.truth.hidden
    assert (found.name, found.site) == (true.name, true.site)
    values = {p.name: p.value for p in found.parameters}
    for name in ("stribeck", "stribeck_velocity"):
        assert values[name] == pytest.approx(true.parameters[name], rel=0.2)


@pytest.mark.nightly
def test_what_is_named_need_not_close_the_balance() -> None:
    """Nothing of the balance goes with it: a fit without physics finds more there."""
    case = shared_case("axis_rotary", "stribeck_friction", 3001)
    why = vpm.diagnose(case.model(), case.train, case.validate, effects=[CLOSE_TO_REST], workers=1)
    assert [effect.name for effect in why.effects] == [CLOSE_TO_REST]
    assert why.verdict == "effect_found"


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("machine", "hidden", "seed"),
    [("axis_linear", "none", 3), ("axis_linear", "friction_drift", 9)],
    ids=["nothing", "friction_that_wears_off"],
)
def test_nothing_is_named_that_is_not_there(machine: str, hidden: str, seed: int) -> None:
    case = shared_case(machine, hidden, seed)
    why = vpm.diagnose(case.model(), case.train, case.validate, effects=[CLOSE_TO_REST], workers=1)
    assert not why.effects
