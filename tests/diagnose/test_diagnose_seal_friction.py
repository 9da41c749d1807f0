"""Friction of seals that grows with the pressures: it passes for a constant force, and is told from it."""

import numpy as np
import pytest

from inverse_dynamics import inverse_dynamics_data
from shared_cases import shared_case
from vpm.discrepancy.judged_model import Data, Judged, judged_anyhow
from vpm.discrepancy.remainder.remainder import Remainder, remainder
from vpm.discrepancy.remainder.seal_friction import seals

#: Area of the piston, m^2.
PISTON = np.pi / 4.0 * 0.016**2


def loaded(hidden: str, seed: int) -> tuple[Data, Judged, Judged, float]:
    """Records of a servo-cylinder, its model without and with a constant force beside dry friction, and the truth."""
    case = shared_case("servo_cylinder", hidden, seed)
    model, free, data = inverse_dynamics_data(case)
    without, _ = judged_anyhow(model, free, data, {})
    named, own = without.model, ["axis.bias.force"]
    if "axis.friction.coulomb" not in model.parameters:
        named, own = (
            named.with_effect("coulomb_friction", at="axis", transition_velocity=1e-3),
            [*own, "axis.friction.coulomb"],
        )
    found, _ = judged_anyhow(named.with_effect("bias_force", at="axis"), (*free, *own), data, {})
    return data, without, found, next(iter(case.truth.hidden[0].parameters.values()))


def told(data: Data, without: Judged, found: Judged) -> Remainder:
    return remainder(without, found, data)


@pytest.fixture(scope="module")
def pressed() -> tuple[Data, Judged, Judged, float]:
    return loaded("pressure_dependent_friction", 43)


@pytest.mark.nightly
def test_pressures_tell_the_friction_of_seals(pressed: tuple[Data, Judged, Judged, float]) -> None:
    data, without, found, area = pressed
    told_of = seals(without, data)
    assert told_of is not None
    assert np.isclose(told_of.share * PISTON, area, rtol=0.1)
    assert told_of.validation @ told_of.validation < 0.7 * (found.validation @ found.validation)


@pytest.mark.nightly
def test_a_constant_force_is_not_the_explanation_of_it(pressed: tuple[Data, Judged, Judged, float]) -> None:
    data, without, found, _ = pressed
    rest = told(data, without, found)
    assert rest.repeats
    assert rest.seals is not None
    assert rest.seals is not None
    assert rest.seals.sentence.startswith("Friction of the seals of servo")


@pytest.mark.nightly
def test_a_constant_force_that_is_there_stays_the_explanation() -> None:
    data, without, found, _ = loaded("bias_force", 43)
    rest = told(data, without, found)
    assert rest.seals is None
    assert rest.seals is None


@pytest.mark.nightly
def test_it_is_told_at_the_right_cylinder_of_a_leg() -> None:
    case = shared_case("hydraulic_leg", "pressure_dependent_friction@knee_drive", 21)
    model, free, data = inverse_dynamics_data(case)
    told_of = seals(judged_anyhow(model, free, data, {})[0], data)
    assert told_of is not None
    assert told_of.drive == "knee_drive"
    assert np.isclose(told_of.share * PISTON, case.truth.hidden[0].parameters["area"], rtol=0.1)
