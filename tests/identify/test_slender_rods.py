"""Fits of slender rods: no inertia about their axis, so that the other two moments are equal whatever their size.

The pendulum's torque is that of a textbook, (J + m c^2) q'' + m g c sin q.
"""

import numpy as np
import pytest

import vpm

MASS, CENTRE, MOMENT, GRAVITY = 3.0, 0.4, 0.16, 9.81  # kg, m, kg m^2, m/s^2
FILE = """
    name = "rod"
    gravity = [0.0, 0.0, -9.81]
    [bodies.rod]
    mass = 3.0
    center_of_mass = [0.0, 0.0, -0.4]
    inertia = [{ value = 0.2, uncertainty = 0.06 }, { value = 0.2, uncertainty = 0.06 }, 0.0, 0.0, 0.0, 0.0]
    [joints.hinge]
    type = "revolute"
    parent = "world"
    child = "rod"
    axis = [0.0, 1.0, 0.0]
    [actuators.motor]
    joint = "hinge"
    gain = 1.0
    command_unit = "N m"
"""


def swing(model: vpm.Model) -> vpm.Experiment:
    """The rod swings by two sines, with the torque that this needs."""
    time = np.arange(2000) / 500.0
    angle = 0.5 * np.sin(4.0 * time) + 0.2 * np.sin(9.0 * time)
    acceleration = -8.0 * np.sin(4.0 * time) - 16.2 * np.sin(9.0 * time)
    torque = (MOMENT + MASS * CENTRE**2) * acceleration + MASS * GRAVITY * CENTRE * np.sin(angle)
    noise = np.random.default_rng(4)
    values = {"hinge.position": angle + 1e-5 * noise.standard_normal(time.size), "motor.command": torque}
    return vpm.Experiment.from_arrays(time, values, model=model)


@pytest.mark.parametrize("mode", ["inverse_dynamics", "restarts"])
def test_both_moments_of_a_slender_rod_are_fitted_together(mode: str) -> None:
    model = vpm.Model.from_toml(FILE)
    fit = vpm.identify(model, [swing(model)], mode=mode)
    assert fit["rod.inertia.yy"] == pytest.approx(MOMENT, rel=0.02)
    assert fit["rod.inertia.xx"] == pytest.approx(fit["rod.inertia.yy"], rel=1e-6)


def test_a_moment_that_a_known_one_settles_stays() -> None:
    """Of a rod with one known moment the other is known too, whatever the file takes for its uncertainty."""
    known = FILE.replace("inertia = [{ value = 0.2, uncertainty = 0.06 }", "inertia = [0.2", 1)
    model = vpm.Model.from_toml(known)
    fit = vpm.identify(model, [swing(model)])
    assert fit["rod.inertia.yy"] == pytest.approx(0.2, rel=1e-6)
    assert "rod.inertia.yy" in fit.at_bounds


def test_a_moment_about_an_axis_that_no_drive_turns_has_no_effect() -> None:
    """Rounding of other forces is no sight of it: the arm's effort along any swing is free of the moment across."""
    model = vpm.Model.from_toml("""
name = "rod on an arm"
gravity = [0.0, 0.0, -9.81]
bodies.arm = { mass = 0.1, inertia = [0.01, 0.01, { value = 0.01, uncertainty = 2e-3 }, 0.0, 0.0, 0.0] }
[bodies.rod]
mass = 0.15
center_of_mass = [0.0, 0.0, -0.16]
inertia = [{ value = 1.6e-3, uncertainty = 3e-4 }, 1.6e-3, 1e-3, 0.0, 0.0, 0.0]
[joints]
turn = { type = "revolute", parent = "world", child = "arm", axis = [0.0, 0.0, 1.0] }
swing = { type = "revolute", parent = "arm", child = "rod", translation = [0.2, 0.0, 0.0], axis = [1.0, 0.0, 0.0] }
[actuators]
drive = { joint = "turn", gain = 1.0 }
""")
    time = np.arange(2000) / 500.0
    torque = 0.2 * np.sin(4.0 * time) + 0.1 * np.sin(9.0 * time)
    log = vpm.Experiment.from_arrays(time, {"drive.command": torque}, model=model)
    run = vpm.simulate(model, log)
    for channel in ("turn.position", "swing.position"):
        log = log.with_channel(channel, run[channel], "rad")
    fit = vpm.identify(model, log)
    assert [one.names for one in fit.unidentifiable] == [("rod.inertia.xx",)]
    assert not any("bound" in sentence for sentence in fit.warnings)
