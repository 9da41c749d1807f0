"""Diagnoses of a motor with currents of its own whose load nobody sees: no efforts follow from the log."""

import pytest

import vpm
from winch import LOAD, MODEL, ROPE, record

TRIED = ["coulomb_friction", "viscous_friction", "bias_force", "spring"]


def test_a_winch_without_errors_lacks_nothing() -> None:
    """The validation record begins in mid-motion, with a load that hangs somewhere."""
    why = vpm.diagnose(MODEL, record(1), record(2, begins=300), effects=TRIED, check=False)
    assert why.verdict == "parameters_only"
    assert why.model.parameters["load.mass"].value == pytest.approx(LOAD, rel=2e-3)
    assert why.model.parameters["rope.spring.stiffness"].value == pytest.approx(ROPE, rel=2e-2)
    assert any("does not tell the place of lift" in note for note in why.notes)


def test_friction_of_the_drum_is_named() -> None:
    """9 N m of dry friction beside 82 N m of weight."""
    logs = record(3, dry=9.0), record(4, dry=9.0, begins=300)
    why = vpm.diagnose(MODEL, *logs, effects=TRIED, check=False)
    assert [(one.name, one.site) for one in why.effects] == [("coulomb_friction", "shaft")]
    assert why.model.parameters["shaft.friction.coulomb"].value == pytest.approx(9.0, rel=2e-2)
