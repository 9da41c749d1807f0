"""What a model file believes of its parameters, and effects that would take them far from it."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import vpm
from model_texts import changed
from shared_cases import shared_case
from sledge import OIL, SLEDGE, pushed
from vpm.discrepancy.preparation import _as_stated, _with_unit, ruled_out_together
from vpm.discrepancy.verdict import _doubt

AXIS = """
name = "axis"
gravity = [0.0, 0.0, 0.0]
bodies.load = { mass = { value = 1.0, unit = "kg", uncertainty = 0.1 } }
joints.axis = { type = "prismatic", parent = "world", child = "load", axis = [1, 0, 0] }
actuators.drive = { joint = "axis", gain = 1.0, command_unit = "N" }
"""
MASS = "load.mass"


def test_what_an_observer_finds_as_stated_is_no_doubt() -> None:
    """Noise that a controller answers to is damping to the residual alone."""
    file = vpm.Model.from_toml(AXIS)
    fit = SimpleNamespace(std=np.array([0.01]), unseen=())
    off: Any = SimpleNamespace(model=file.with_parameters({MASS: 1.9}), free=(MASS,), fit=fit)
    assert f"But {MASS} is 9.0 times its stated uncertainty away" in _doubt(file, None, off)
    assert f"But {MASS} is 9.0 times" in _doubt(file, file.with_parameters({MASS: 1.8}), off)
    assert _doubt(file, file.with_parameters({MASS: 1.1}), off) == ""
    assert _as_stated(file, file.with_parameters({MASS: 1.8}), [MASS]) == {}
    assert _as_stated(file, file.with_parameters({MASS: 1.1}), [MASS]) == {MASS: 1.1}


def test_what_only_shows_beside_a_named_effect_is_as_near_to_the_file_as_that_lets_it_be() -> None:
    """A slide moves by the sum of its mass and its rotor's: 1.6 + 2.0 kg are as well the 1.0 kg of the file and 2.6."""
    file = vpm.Model.from_toml(AXIS)
    rotor = file.with_effect("rotor_inertia", at="axis", inertia=2.0).with_parameters({MASS: 1.6})
    sum_alone = SimpleNamespace(names=(MASS, "axis.rotor.inertia"), weights=(np.sqrt(0.5), -np.sqrt(0.5)))
    named: Any = SimpleNamespace(model=rotor, free=sum_alone.names, fit=SimpleNamespace(unseen=(sum_alone,)))
    assert ruled_out_together(file, named) == {}


@pytest.mark.nightly
def test_a_spring_that_lifts_a_centre_of_mass_is_named_with_a_doubt() -> None:
    """A spring that hardens is, to fifth order, a linear one beside a centre of mass closer to the axis."""
    case = shared_case("axis_rotary", "cubic_spring", 43)
    why = vpm.diagnose(case.model(), case.train, case.validate, effects=["spring", "bias_force"], workers=1)
    assert why.verdict == "effect_found"
    assert "But body.center_of_mass.z is 7.7 times its stated uncertainty away" in why.summary


def test_a_recalibration_that_a_known_moment_of_inertia_stops_says_so() -> None:
    """The motion turns about y alone; a known moment about x that is too large for a slender body forbids its value."""
    arm = vpm.Model.from_toml("""
name = "arm"
gravity = [0.0, 0.0, 0.0]
bodies.arm = { mass = 1.0, inertia = [0.5, { value = 0.55, uncertainty = 0.3 }, 0.1, 0, 0, 0] }
joints.axis = { type = "revolute", parent = "world", child = "arm", axis = [0, 1, 0] }
actuators.drive = { joint = "axis", gain = 1.0, command_unit = "N m" }
""")
    time = np.arange(1500) / 300.0
    speeds = np.array([3.1, 5.3, 7.9])

    def record(seed: int) -> vpm.Experiment:
        random = np.random.default_rng(seed)
        phases = speeds * time[:, None] + random.uniform(0.0, 6.0, 3)
        torque = -0.2 * np.sum(np.sin(phases) * speeds**2, axis=1)  # of an inertia of 0.2 kg m^2
        angle = np.sum(np.sin(phases), axis=1) + random.normal(0.0, 1e-5, len(time))
        return vpm.Experiment.from_arrays(time, {"axis.position": angle, "drive.command": torque}, model=arm)

    why = vpm.diagnose(arm, [record(1)], [record(2)], effects=["bias_force"], check=False, workers=1)
    (note,) = [note for note in why.notes if "stopped at" in note]
    assert "arm.inertia.yy" in note
    assert "the moment xx, 0.5 kg m^2" in note


def test_a_file_that_is_wrong_beside_a_missing_effect_is_told() -> None:
    """A load of twice the stated mass, ten stated uncertainties away, under a constant force."""
    model, time = vpm.Model.from_toml(AXIS), np.arange(1500) / 300.0
    speeds = np.array([3.1, 5.3, 7.9])

    def record(seed: int) -> vpm.Experiment:
        random = np.random.default_rng(seed)
        phases = speeds * time[:, None] + random.uniform(0.0, 6.0, 3)
        force = 3.0 - 2.0 * np.sum(np.sin(phases) * speeds**2, axis=1)
        place = np.sum(np.sin(phases), axis=1) + random.normal(0.0, 1e-5, len(time))
        return vpm.Experiment.from_arrays(time, {"axis.position": place, "drive.command": force}, model=model)

    why = vpm.diagnose(model, [record(1)], [record(2)], effects=["bias_force"], check=False, workers=1)
    assert [effect.name for effect in why.effects] == ["bias_force"]
    assert f"But {MASS} is 10.0 times its stated uncertainty away from the model file" in why.summary


def test_a_load_that_spreads_over_mass_and_centre_is_told_in_the_summary() -> None:
    """Torques show mass times centre and the inertia about the axis: three parameters take a load up, none for sure."""
    arm = vpm.Model.from_toml("""
name = "arm"
gravity = [0.0, 0.0, -9.81]
bodies.arm.mass = { value = 4.0, uncertainty = 0.4 }
bodies.arm.center_of_mass = [{ value = 0.2, uncertainty = 0.02 }, 0.0, 0.0]
bodies.arm.inertia = [0.05, { value = 0.05, uncertainty = 0.01 }, 0.05, 0.0, 0.0, 0.0]
joints.axis = { type = "revolute", parent = "world", child = "arm", axis = [0, -1, 0] }
actuators.drive = { joint = "axis", gain = 1.0, command_unit = "N m" }
""")
    time, load, lever = np.arange(1500) / 300.0, 2.0, 0.4
    speeds = np.array([1.1, 2.3, 4.9])

    def record(seed: int) -> vpm.Experiment:
        random = np.random.default_rng(seed)
        phases = speeds * time[:, None] + random.uniform(0.0, 6.0, 3)
        angle, acceleration = 0.5 * np.sum(np.sin(phases), axis=1), -0.5 * np.sum(np.sin(phases) * speeds**2, axis=1)
        inertia, moment = 0.05 + 4.0 * 0.2**2 + load * lever**2, 4.0 * 0.2 + load * lever
        torque = inertia * acceleration + 9.81 * moment * np.cos(angle)
        angle = angle + random.normal(0.0, 1e-5, len(time))
        return vpm.Experiment.from_arrays(time, {"axis.position": angle, "drive.command": torque}, model=arm)

    why = vpm.diagnose(arm, [record(1)], [record(2)], effects=["bias_force"], check=False, workers=1)
    assert why.verdict == "parameters_only"
    assert "at the most probable values that explain the records" in why.summary


def test_no_note_tells_where_a_parameter_went_before_the_effect_was_named() -> None:
    """Oil takes the place of dry friction until that is named, and is then what the file states."""
    model = changed(SLEDGE, ("{ value = 7.0, uncertainty = 1.5 }", "{ value = 8.2, uncertainty = 0.3 }"))
    first, second = (pushed(dry=3.0, seed=seed, duration=5.0) for seed in (1, 2))
    why = vpm.diagnose(model, first, second, workers=1)
    assert [effect.name for effect in why.effects] == ["coulomb_friction"]
    assert abs(why.model.parameters["way.friction.viscous"].value - OIL) < 0.1
    assert not any("way.friction.viscous" in note for note in why.notes)


def test_a_ratio_in_a_note_has_no_unit() -> None:
    beam: Any = SimpleNamespace(unit="1")
    mass: Any = SimpleNamespace(unit="kg")
    assert (_with_unit(0.02, beam), _with_unit(2.0, mass)) == ("0.02", "2 kg")
