"""A series-elastic knee whose motor and link both stick: records of a machine that lacks nothing."""

from __future__ import annotations

import pytest

import vpm
from series_elastic_knee import DRY, KNEE, RUB, SPRING, swung


def test_sticking_on_either_side_of_a_spring_is_no_missing_physics() -> None:
    """Rest of the link has no residual of its own: a tracker says that nothing but its encoder's noise is left."""
    model, records = vpm.Model.from_toml(KNEE), [swung(seed) for seed in (1, 2)]
    why = vpm.diagnose(model, *records, effects=["viscous_friction", "bias_force"], check=False, workers=1)
    assert (why.verdict, why.effects) == ("parameters_only", ())
    values = {name: parameter.value for name, parameter in why.model.parameters.items()}
    assert values["knee.compliance.stiffness"] == pytest.approx(SPRING, rel=0.02)
    assert values["knee.link.friction.coulomb"] == pytest.approx(RUB, rel=0.02)


def test_friction_that_is_missing_on_both_sides_of_a_spring_is_named_on_both() -> None:
    """One law twice at one joint: each place has its own size, and no answer may take one for the other."""
    model, records = vpm.Model.from_toml(KNEE), [swung(seed) for seed in (1, 2)]
    for side in ("link", "motor"):
        model = model.without_effect("coulomb_friction", "knee", side)
    why = vpm.diagnose(model, *records, effects=["coulomb_friction"], check=False, workers=1)
    assert why.verdict == "effect_found"
    assert "coulomb_friction at knee, link side" in why.summary
    assert [(one.name, one.site) for one in why.effects] == [("coulomb_friction", "knee")] * 2
    assert {one.label for one in why.effects} == {f"coulomb_friction at knee{side}" for side in ("", ", link side")}
    values = {name: parameter.value for name, parameter in why.model.parameters.items()}
    assert values["knee.friction.coulomb"] == pytest.approx(DRY, rel=0.05)
    assert values["knee.link.friction.coulomb"] == pytest.approx(RUB, rel=0.1)
