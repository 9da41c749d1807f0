"""Effects hidden in a machine whose joints disturb each other: the right effect at the right joint."""

from __future__ import annotations

import pytest

from two_link_arm import Arm, nominal, record
from vpm.diagnosing import diagnose
from vpm.discrepancy import Diagnosis
from vpm.naming import Names


def of(arm: Arm, names: Names = "ranking") -> Diagnosis:
    return diagnose(nominal(), record(arm, 10.0, 1), record(arm, 8.0, 2), names=names)


def named(diagnosis: Diagnosis) -> set[tuple[str, str]]:
    return {(e.name, e.site) for e in diagnosis.effects}


def test_friction_is_found_at_the_joint_that_has_it() -> None:
    diagnosis = of(Arm(coulomb=(0.0, 0.8)))
    assert named(diagnosis) == {("coulomb_friction", "elbow")}
    assert diagnosis.model.parameters["elbow.friction.coulomb"].value == pytest.approx(0.8, rel=0.03)


@pytest.mark.nightly
def test_a_constant_load_is_told_from_a_weight() -> None:
    diagnosis = of(Arm(bias=(1.5, 0.0)))
    assert named(diagnosis) == {("bias_force", "shoulder")}
    assert diagnosis.model.parameters["shoulder.bias.force"].value == pytest.approx(1.5, rel=0.03)


@pytest.mark.nightly
def test_two_delays_are_found_although_one_alone_makes_the_simulation_worse() -> None:
    diagnosis = of(Arm(delay=3), "search")  # a ranking takes one lag first, and beside that another one is better
    assert named(diagnosis) == {("input_delay", "first"), ("input_delay", "second")}
    for name in ("first.delay.time", "second.delay.time"):
        assert diagnosis.model.parameters[name].value == pytest.approx(0.006, rel=0.05)


@pytest.mark.nightly
@pytest.mark.parametrize("late", [(0, 6), (6, 6)])
def test_what_is_late_by_less_than_a_sample_is_one_drive_and_not_the_clock_of_all(late: tuple[int, int]) -> None:
    """All commands may hold a little later than is said; of one drive beside another on its clock it is physics."""
    arm, effects = Arm(late=late), ["input_delay", "coulomb_friction", "sensor_offset"]
    diagnosis = diagnose(nominal(), record(arm, 10.0, 1), record(arm, 8.0, 2), effects=effects)
    assert named(diagnosis) == ({("input_delay", "second")} if late[0] == 0 else set())
    if late[0] == 0:
        assert diagnosis.model.parameters["second.delay.time"].value == pytest.approx(0.0012, rel=0.05)


def test_wrong_weights_are_not_a_missing_effect() -> None:
    diagnosis = of(Arm())
    assert diagnosis.verdict == "parameters_only"
    expected = {
        "upper.center_of_mass.x": 0.215,
        "lower.center_of_mass.x": 0.17,
        "upper.inertia.yy": 0.045,
        "lower.inertia.yy": 0.028,
    }
    for name, value in expected.items():
        assert diagnosis.model.parameters[name].value == pytest.approx(value, rel=0.03), name
