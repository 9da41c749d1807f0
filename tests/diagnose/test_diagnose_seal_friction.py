"""Friction of seals that grows with the pressures: it passes for a constant force, and is told from it."""

import pytest

from shared_cases import shared_case
from vpm.ranking import rank

#: What looks like friction that changes with the pressures, and so with the direction.
ALIKE = ["coulomb_friction", "asymmetric_friction", "bias_force", "seal_friction"]


@pytest.mark.parametrize("case", [("servo_cylinder", "seal_friction", 43), ("servo_cylinder", "bias_force", 43)])
def test_seals_that_pressures_press_on_and_a_constant_force_are_told_apart(case: tuple[str, str, int]) -> None:
    shared = shared_case(*case)
    (hidden,) = shared.truth.hidden
    found, *_ = rank(shared.model(), shared.train[:1], shared.validate, effects=ALIKE, workers=1).effects
    assert (found.effect, found.site) == (hidden.name, hidden.site)
    size = next(iter(hidden.parameters))
    (value,) = (value for name, value in found.values.items() if name.endswith(f".{size}"))
    assert value == pytest.approx(hidden.parameters[size], rel=0.05)


@pytest.mark.nightly
def test_it_is_told_at_the_right_cylinder_of_a_leg() -> None:
    shared = shared_case("hydraulic_leg", "seal_friction@knee_drive", 21)
    found, *_ = rank(shared.model(), shared.train, shared.validate, workers=1).effects
    assert (found.effect, found.site) == ("seal_friction", "knee_drive")
    share = shared.truth.hidden[0].parameters["share"]
    assert found.values["knee_drive.seal_friction.share"] == pytest.approx(share, rel=0.05)
