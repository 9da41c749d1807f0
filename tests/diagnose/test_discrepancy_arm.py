"""Effects hidden in a machine whose joints disturb each other: the right effect at the right joint."""

import pytest

from two_link_arm import Arm, nominal, record
from vpm.diagnosing import diagnose
from vpm.discrepancy import Diagnosis
from vpm.ranking import rank


def of(arm: Arm) -> Diagnosis:
    return diagnose(nominal(), record(arm, 10.0, 1), record(arm, 8.0, 2))


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


@pytest.mark.parametrize(
    "samples", [pytest.param(1, marks=pytest.mark.nightly), 3, pytest.param(6, marks=pytest.mark.nightly)]
)
def test_drives_that_are_late_alike_are_found_together(samples: int) -> None:
    """A bus that is late delays all its drives; one of them alone asks the other one for forces that nobody logged."""
    found = rank(nominal(), record(Arm(delay=samples), 10.0, 1))
    assert {one.key for one in found.effects} == {("input_delay", "first"), ("input_delay", "second")}
    for name in ("first.delay.time", "second.delay.time"):
        assert found.model.parameters[name].value == pytest.approx(0.002 * samples, rel=0.01)


@pytest.mark.nightly
def test_a_diagnosis_names_drives_that_are_late_alike() -> None:
    assert named(of(Arm(delay=3))) == {("input_delay", "first"), ("input_delay", "second")}


@pytest.mark.nightly
@pytest.mark.parametrize("late", [(0, 6), (6, 6)])
def test_drives_may_be_late_by_less_than_a_sample(late: tuple[int, int]) -> None:
    arm, effects = Arm(late=late), ["input_delay", "coulomb_friction", "sensor_offset"]
    diagnosis = diagnose(nominal(), record(arm, 10.0, 1), record(arm, 8.0, 2), effects=effects)
    drives = [drive for drive, tenths in zip(("first", "second"), late, strict=True) if tenths]
    assert named(diagnosis) == {("input_delay", drive) for drive in drives}
    for drive in drives:
        assert diagnosis.model.parameters[f"{drive}.delay.time"].value == pytest.approx(0.0012, rel=0.05)


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
