"""Inertial measurement units: closed forms of a pendulum, a link that bends, and a log in multiples of gravity."""

import numpy as np
import pytest

import vpm
from model_texts import refused

G = 9.81
PENDULUM = """
name = "pendulum"
gravity = [0.0, 0.0, -9.81]

[bodies.bob]
mass = 2.0
center_of_mass = [0.0, 0.0, -0.7]

[joints.hinge]
type = "revolute"
parent = "world"
child = "bob"
axis = [0.0, 1.0, 0.0]

[actuators.drive]
joint = "hinge"
gain = { value = 1.0, unit = "1" }
command_unit = "N m"

[imus.unit]
parent = "bob"
translation = [0.0, 0.0, -0.7]

[sensors.chip]
measures = "unit.ax"

[load_cells.cell]
joint = "hinge"

[channels]
"unit.ax" = { column = "a", unit = "gn" }
"""
BENT = """
name = "bent"
gravity = [0.0, 0.0, -9.81]

[bodies.hub]
mass = 1.0
inertia = [0.1, 0.1, 0.1, 0.0, 0.0, 0.0]

[joints.root]
type = "revolute"
parent = "world"
child = "hub"
axis = [0.0, 1.0, 0.0]

[beams.link]
parent = "hub"
rotation = [0.0, 1.5707963267948966, 0.0]
length = 0.8
level = "bezier(4)"
deforms = ["bending_y"]
material = { young = { value = 70.0, unit = "GPa", uncertainty = 10.0 }, poisson = 0.33, density = 2700.0 }
section = { shape = "rectangle", width = 0.004, height = 0.04 }
damping = { stiffness = 5e-4 }

[markers.tip]
parent = "link"
at = 0.8

[imus.chip]
parent = "link"
at = 0.8

[actuators.motor]
joint = "root"
gain = { value = 1.0, unit = "1" }
command_unit = "N m"
"""


def test_channels_and_units() -> None:
    model = vpm.Model.from_toml(PENDULUM)
    assert model.imus == ("unit",)
    ends = model.output_channels[-6:]
    assert ends == tuple(f"unit.{key}" for key in ("ax", "ay", "az", "wx", "wy", "wz"))
    assert [model.channel_unit(name) for name in ends] == [*["m/s^2"] * 3, *["rad/s"] * 3]
    assert vpm.Model.from_toml(model.to_toml()) == model


def test_at_rest_it_reads_gravity_upwards() -> None:
    run = vpm.Simulation(vpm.Model.from_toml(PENDULUM), 1e-3).run(np.zeros((10, 1)))
    assert run["unit.az"] == pytest.approx(np.full(10, G), rel=1e-12)
    assert run["unit.ax"] == pytest.approx(np.zeros(10), abs=1e-12)


def test_a_mass_point_that_swings_feels_only_its_rod() -> None:
    """Nothing acts on it but gravity, which no unit feels, and the rod: `l w^2 + g cos(q)` along it, nothing across."""
    sim = vpm.Simulation(vpm.Model.from_toml(PENDULUM), 1e-3, state={"hinge.position": 1.1})
    run = sim.run(np.zeros((800, 1)))
    q, rate = run["hinge.position"], run["hinge.velocity"]
    assert np.ptp(q) > 2.0
    assert run["unit.az"] == pytest.approx(0.7 * rate**2 + G * np.cos(q), rel=1e-9)
    assert run["unit.ax"] == pytest.approx(np.zeros(800), abs=1e-9)
    assert run["unit.wy"] == pytest.approx(rate, rel=1e-12)
    for axis in "xz":  # mass times specific force is what the joint carries
        assert 2.0 * run[f"unit.a{axis}"] == pytest.approx(run[f"cell.f{axis}"], abs=1e-9)


def test_a_link_that_bends_shakes_its_tip() -> None:
    """The unit reads the second difference of where the tip is, less gravity; its axes do not change the size."""
    dt = 1e-4
    sim = vpm.Simulation(vpm.Model.from_toml(BENT), dt, state={"root.velocity": 2.0})
    run = sim.run(np.zeros((3000, 1)))
    place = np.column_stack([run[f"tip.{axis}"] for axis in "xyz"])
    felt = np.linalg.norm(np.diff(place, 2, axis=0) / dt**2 + [0.0, 0.0, G], axis=1)
    read = np.linalg.norm([run[f"chip.a{axis}"] for axis in "xyz"], axis=0)[1:-1]
    assert np.std(felt) > 1.0
    assert read[100:] == pytest.approx(felt[100:], abs=1e-3 * felt.max())


def test_stiffness_is_identified_from_an_accelerometer_at_the_tip() -> None:
    """A log in multiples of gravity, of a joint whose motion is known, tells how stiff the link is."""
    model, time = vpm.Model.from_toml(BENT), 0.002 * np.arange(1000)
    angle = 0.3 * np.sin(2.0 * np.pi * time) + 0.1 * np.sin(7.0 * np.pi * time)
    motion = vpm.Experiment.from_arrays(time, {"root.position": angle}, units={"root.position": "rad"})
    stiffer = model.with_parameters({"link.young": 80e9})
    run = vpm.simulate(stiffer, motion, "prescribed_motion", cutoff=25.0)
    reading = np.interp(time, run.time, run["chip.ax"]) / 9.80665
    units = {"root.position": "rad", "chip.ax": "gn"}
    log = vpm.Experiment.from_arrays(time, {"root.position": angle, "chip.ax": reading}, units=units)
    fit = vpm.identify(model, [log], free=["link.young"], mode="prescribed_motion", cutoff=25.0)
    assert fit.values[0] == pytest.approx(80e9, rel=2e-3)


def test_a_unit_on_nothing_is_refused() -> None:
    change = ('parent = "bob"\ntranslation', 'parent = "bop"\ntranslation')
    refused("imus.unit.parent", 'is "bop", which is no body', PENDULUM, change)
