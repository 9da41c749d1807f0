"""A series-elastic knee whose motor and link both stick: records of a machine that lacks nothing."""

from __future__ import annotations

import pytest

import vpm
from series_elastic_knee import KNEE, RUB, SPRING, swung


def test_sticking_on_either_side_of_a_spring_is_no_missing_physics() -> None:
    """Rest of the link has no residual of its own: a tracker says that nothing but its encoder's noise is left."""
    model, records = vpm.Model.from_toml(KNEE), [swung(seed) for seed in (1, 2)]
    why = vpm.diagnose(model, *records, effects=["viscous_friction", "bias_force"], check=False, workers=1)
    assert (why.verdict, why.effects) == ("parameters_only", ())
    values = {name: parameter.value for name, parameter in why.model.parameters.items()}
    assert values["knee.compliance.stiffness"] == pytest.approx(SPRING, rel=0.02)
    assert values["knee.link.friction.coulomb"] == pytest.approx(RUB, rel=0.02)
