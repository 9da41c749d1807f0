"""Machines from model files through the core: joints of every type, fixed bodies and beams, against closed forms."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from scipy.linalg import eigh
from scipy.optimize import root
from scipy.spatial.transform import Rotation

from random_trees import trees
from test_beam_files import ARM
from vpm._core import Dynamics
from vpm.model import Model
from vpm.numbers import Array

G = 9.81


def machine(bodies: dict[str, Any], joints: dict[str, Any], **more: Any) -> Model:
    return Model.from_dict({"name": "machine", "gravity": [0.0, 0.0, -G], "bodies": bodies, "joints": joints, **more})


def acceleration(model: Model, position: Array, velocity: Array) -> Array:
    """Accelerations of all coordinates without drives."""
    return Dynamics(model.core, model.theta).forward_dynamics(position, velocity, np.zeros(len(model.joints)))


def run(model: Model, state: Array, dt: float, count: int) -> Array:
    """Outputs (count, n_outputs) of a motion without drives."""
    inputs = np.zeros((count, len(model.actuators)))
    outputs, _, _ = model.core.simulate(model.theta, state, inputs, dt, 4, "rk4")
    return outputs


def watched(model: Model, position: Array, marker: str) -> Array:
    """Place and rotation vector (6,) of a marker at rest."""
    state = np.concatenate([position, np.zeros(len(model.state_names) - len(position))])
    row = run(model, state, 1e-9, 1)[0]
    return np.array([row[model.output_channels.index(f"{marker}.{c}")] for c in ("x", "y", "z", "rx", "ry", "rz")])


# ---- joints ----------------------------------------------------------------------------------------------------------

NUT = {"mass": 2.0, "inertia": [0.01, 0.01, 0.02, 0.0, 0.0, 0.0]}


def test_a_nut_falls_along_its_screw() -> None:
    pitch = 0.05
    joint = {"type": "helical", "parent": "world", "child": "nut", "axis": [0.0, 0.0, 1.0], "pitch": pitch}
    model = machine({"nut": NUT}, {"screw": joint}, markers={"eye": {"parent": "nut"}})
    # The weight works by the pitch, the travel and the turn share the energy: (I + m p^2) a = -m g p.
    expected = -2.0 * G * pitch / (0.02 + 2.0 * pitch**2)
    assert acceleration(model, np.array([0.3]), np.array([1.0])) == pytest.approx([expected], rel=1e-12)
    assert watched(model, np.array([2.0]), "eye") == pytest.approx([0.0, 0.0, 2.0 * pitch, 0.0, 0.0, 2.0], abs=1e-9)


def test_a_cylindrical_joint_turns_and_shifts_independently() -> None:
    joint = {"type": "cylindrical", "parent": "world", "child": "nut", "axis": [0.0, 0.0, 1.0]}
    model = machine({"nut": NUT}, {"shaft": joint})
    core = Dynamics(model.core, model.theta)
    assert core.mass_matrix(np.array([0.4, 0.2])) == pytest.approx(np.diag([0.02, 2.0]), abs=1e-12)
    assert acceleration(model, np.array([0.4, 0.2]), np.array([1.0, 2.0])) == pytest.approx([0.0, -G], abs=1e-12)


def test_a_planar_joint_holds_its_normal() -> None:
    joint = {"type": "planar", "parent": "world", "child": "disk", "axis": [0.0, 1.0, 0.0]}
    model = machine({"disk": NUT}, {"table": joint}, markers={"eye": {"parent": "disk"}})
    # With the normal y, the plane has the directions z and x: the weight acts along its first coordinate alone.
    assert acceleration(model, np.array([0.1, 0.2, 0.3]), np.zeros(3)) == pytest.approx([-G, 0.0, 0.0], abs=1e-12)
    expected = [0.2, 0.0, 0.1, 0.0, 0.3, 0.0]
    assert watched(model, np.array([0.1, 0.2, 0.3]), "eye") == pytest.approx(expected, abs=1e-9)


def test_a_spherical_pendulum_runs_around_its_cone() -> None:
    # Steady turning about the vertical: the weight bends the path into the circle, Omega^2 = g / (l cos(tilt)),
    # whatever the inertia about the centre of mass, if it is the same in all directions.
    length, tilt = 0.5, 0.3
    turning = math.sqrt(G / (length * math.cos(tilt)))
    bob = {"mass": 1.5, "center_of_mass": [0.0, 0.0, -length], "inertia": [0.01, 0.01, 0.01, 0.0, 0.0, 0.0]}
    eye = {"parent": "bob", "translation": [0.0, 0.0, -length]}
    joint = {"type": "spherical", "parent": "world", "child": "bob"}
    model = machine({"bob": bob}, {"ball": joint}, markers={"eye": eye})
    rates = [0.0, turning * math.sin(tilt), turning * math.cos(tilt)]
    count = 200
    outputs = run(model, np.array([tilt, 0.0, 0.0, *rates]), 2 * math.pi / turning / 4 / count, count + 1)
    place = outputs[:, [model.output_channels.index(f"eye.{axis}") for axis in "xyz"]]
    angle = np.linspace(0.0, math.pi / 2, count + 1)
    radius = length * math.sin(tilt)
    circle = np.column_stack([-radius * np.sin(angle), radius * np.cos(angle)])
    assert place[:, :2] == pytest.approx(circle, abs=1e-8)
    assert place[:, 2] == pytest.approx(-length * math.cos(tilt), abs=1e-8)


@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_denavit_hartenberg_chains_reach_where_the_product_says(convention: str) -> None:
    rng = np.random.default_rng(3)
    links = rng.uniform(-1.0, 1.0, (3, 4))
    names = ["one", "two", "three"]
    joints = {
        f"j{k}": {
            "type": "revolute",
            "parent": "world" if k == 0 else names[k - 1],
            "child": names[k],
            "dh": {**dict(zip(("a", "alpha", "d", "theta"), links[k].tolist(), strict=True)), "convention": convention},
        }
        for k in range(3)
    }
    bodies = {name: {"mass": 1.0, "inertia": [0.1, 0.1, 0.1, 0.0, 0.0, 0.0]} for name in names}
    model = machine(bodies, joints, markers={"tool": {"parent": "three"}})
    q = rng.uniform(-1.0, 1.0, 3)
    pose = np.eye(4)
    for (a, alpha, d, theta), angle in zip(links, q, strict=True):
        along_x, along_z = np.eye(4), np.eye(4)
        along_x[:3, :3], along_x[0, 3] = Rotation.from_rotvec([alpha, 0.0, 0.0]).as_matrix(), a
        along_z[:3, :3], along_z[2, 3] = Rotation.from_rotvec([0.0, 0.0, theta + angle]).as_matrix(), d
        pose = pose @ (along_z @ along_x if convention == "standard" else along_x @ along_z)
    found = watched(model, q, "tool")
    assert found[:3] == pytest.approx(pose[:3, 3], abs=1e-7)
    assert Rotation.from_rotvec(found[3:]).as_matrix() == pytest.approx(pose[:3, :3], abs=1e-7)


# ---- fixed bodies ----------------------------------------------------------------------------------------------------


def test_fixed_bodies_are_one_body() -> None:
    rng = np.random.default_rng(5)
    masses, centers = rng.uniform(0.5, 2.0, 3), rng.uniform(-0.5, 0.5, (3, 3))
    turns = rng.uniform(-1.0, 1.0, (3, 3))
    turns[0] = 0.0
    places = rng.uniform(-0.5, 0.5, (3, 3))
    places[0] = 0.0
    principal = rng.uniform(0.1, 0.15, (3, 3))
    parts, joints = {}, {}
    total, center = masses.sum(), np.zeros(3)
    points, inertias = [], []
    for k in range(3):
        parts[f"part{k}"] = {
            "mass": float(masses[k]),
            "center_of_mass": centers[k].tolist(),
            "inertia": [*principal[k].tolist(), 0.0, 0.0, 0.0],
        }
        rotation = Rotation.from_euler("xyz", turns[k]).as_matrix()
        points.append(places[k] + rotation @ centers[k])
        inertias.append(rotation @ np.diag(principal[k]) @ rotation.T)
        center += masses[k] * points[k] / total
        if k:
            place = {"translation": places[k].tolist(), "rotation": turns[k].tolist()}
            joints[f"weld{k}"] = {"type": "fixed", "parent": "part0", "child": f"part{k}", **place}
    # The parallel axes of Huygens and Steiner.
    arms = [point - center for point in points]
    inertia = sum(j + m * (r @ r * np.eye(3) - np.outer(r, r)) for j, m, r in zip(inertias, masses, arms, strict=True))
    six = [float(inertia[i]) for i in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    ball = {"type": "spherical", "parent": "world"}
    apart = machine(parts, {"ball": {**ball, "child": "part0"}, **joints})
    whole = {"mass": float(total), "center_of_mass": center.tolist(), "inertia": six}
    merged = machine({"whole": whole}, {"ball": {**ball, "child": "whole"}})
    q, v = np.array([0.3, -0.5, 0.7]), np.array([1.0, -2.0, 0.5])
    assert acceleration(apart, q, v) == pytest.approx(acceleration(merged, q, v), rel=1e-10)


def test_a_payload_on_a_fixed_body_sits_in_its_frame() -> None:
    bodies = {"arm": NUT, "hand": {"mass": 0.5}}
    joints = {
        "pin": {"type": "revolute", "parent": "world", "child": "arm", "axis": [0.0, 1.0, 0.0]},
        "grip": {
            "type": "fixed",
            "parent": "arm",
            "child": "hand",
            "translation": [0.3, 0.0, 0.0],
            "rotation": [0.0, 0.0, math.pi / 2],
        },
    }
    model = machine(bodies, joints)
    in_hand = model.with_effect("payload", at="hand", mass=0.7, x=0.1, y=0.2)
    on_arm = model.with_effect("payload", at="arm", mass=0.7, x=0.1, y=0.1)  # the same point: (0.3 - 0.2, 0.1)
    q, v = np.array([0.4]), np.array([2.0])
    assert acceleration(in_hand, q, v) == pytest.approx(acceleration(on_arm, q, v), rel=1e-12)
    assert acceleration(in_hand, q, v) != pytest.approx(acceleration(model, q, v), rel=1e-3)


# ---- beams -----------------------------------------------------------------------------------------------------------

LENGTH, WIDTH, HEIGHT, YOUNG, DENSITY, LOAD = 0.5, 0.004, 0.015, 206e9, 7850.0, 0.05
STIFFNESS = YOUNG * HEIGHT * WIDTH**3 / 12.0
LINE_DENSITY = DENSITY * WIDTH * HEIGHT
LEVELS = ("lumped(40)", "modal(4)", "bezier(5)", "deflection(5)", "hermite(2)", "strain(3)", "elements(6)")


def cantilever(level: str, *, load: float, gravity: float = G) -> Model:
    """Strip of steel along the world's x on a locked pin, with a point mass on its tip, its soft side down."""
    content: dict[str, Any] = {
        "name": "cantilever",
        "gravity": [0.0, 0.0, -gravity],
        "bodies": {"hub": NUT},
        "joints": {"pin": {"type": "revolute", "parent": "world", "child": "hub", "axis": [0.0, 1.0, 0.0]}},
        "beams": {
            "strip": {
                "parent": "hub",
                "rotation": [0.0, math.pi / 2, 0.0],
                "length": LENGTH,
                "level": level,
                "deforms": ["bending_y"],
                "material": {"young": YOUNG, "density": DENSITY},
                "section": {"shape": "rectangle", "width": WIDTH, "height": HEIGHT},
            }
        },
        "gauges": {"root": {"beam": "strip", "at": 0.0, "x": 0.5 * WIDTH}},
        "markers": {"tip": {"parent": "strip"}},
    }
    if load:
        content["bodies"]["load"] = {"mass": load}
        content["joints"]["grip"] = {"type": "fixed", "parent": "strip", "child": "load"}
    return Model.from_dict(content)


@pytest.mark.parametrize("load", [0.0, LOAD])
def test_a_payload_at_the_end_of_a_bare_beam_is_a_body_there(load: float) -> None:
    bare = cantilever("bezier(5)", load=0.0)
    there = bare.with_effect("payload", at="strip", mass=load)
    body = cantilever("bezier(5)", load=load)
    zero = np.zeros(len(bare.coordinates))
    masses = [Dynamics(model.core, model.theta).mass_matrix(zero) for model in (there, body)]
    np.testing.assert_allclose(masses[0], masses[1], rtol=1e-12, atol=1e-15)


def at_rest(model: Model) -> Array:
    """Coordinates at which the beam is in equilibrium, joints at zero."""
    core, joints = Dynamics(model.core, model.theta), len(model.joints)

    def unbalanced(elastic: Array) -> Array:
        q = np.concatenate([np.zeros(joints), elastic])
        return core.inverse_dynamics(q, np.zeros_like(q), np.zeros_like(q))[joints:]

    found = root(unbalanced, np.zeros(len(model.coordinates) - joints), tol=1e-14)
    assert np.abs(unbalanced(found.x)).max() < 1e-9
    return np.concatenate([np.zeros(joints), found.x])


def first_frequency(model: Model) -> float:
    """Slowest natural frequency (rad/s) with locked joints, from the mass matrix and small elastic displacements."""
    core, joints, n = Dynamics(model.core, model.theta), len(model.joints), len(model.coordinates)
    zero, step = np.zeros(n), 1e-6
    columns = [core.inverse_dynamics(step * np.eye(n)[k], zero, zero) / step for k in range(joints, n)]
    stiffness = np.column_stack(columns)[joints:]
    mass = core.mass_matrix(zero)[joints:, joints:]
    slowest = eigh(0.5 * (stiffness + stiffness.T), mass, eigvals_only=True)[0]
    return math.sqrt(slowest)


@pytest.mark.parametrize("level", LEVELS)
def test_every_level_is_a_system_with_these_coordinates(level: str) -> None:
    model = cantilever(level, load=LOAD)
    assert model.core.n_states == len(model.state_names)
    assert model.core.n_outputs == len(model.output_channels)
    assert model.coordinates[0] == "pin"


@pytest.mark.parametrize(
    ("level", "within"),
    [
        ("lumped(40)", 2e-3),
        ("modal(4)", 1e-3),
        ("bezier(5)", 2e-5),
        ("deflection(5)", 2e-5),
        ("hermite(2)", 2e-5),
        ("strain(3)", 2e-5),
        ("elements(6)", 2e-3),
    ],
)
def test_a_loaded_tip_sags_as_it_should(level: str, within: float) -> None:
    model = cantilever(level, load=LOAD)
    # F L^3 / 3 EI + w L^4 / 8 EI (S. Timoshenko, "Strength of Materials", part 1, 1930): small deflections, and this
    # one is 1 % of the length.
    sag = LOAD * G * LENGTH**3 / (3 * STIFFNESS) + LINE_DENSITY * G * LENGTH**4 / (8 * STIFFNESS)
    assert sag < 0.02 * LENGTH
    assert watched(model, at_rest(model), "tip")[2] == pytest.approx(-sag, rel=within + 2 * (sag / LENGTH) ** 2)


def test_a_gauge_reads_the_strain_of_the_clamp() -> None:
    model = cantilever("strain(3)", load=LOAD)
    q = at_rest(model)
    outputs = run(model, np.concatenate([q, np.zeros(len(q))]), 1e-9, 1)[0]
    moment = LOAD * G * LENGTH + 0.5 * LINE_DENSITY * G * LENGTH**2
    strain = outputs[model.output_channels.index("root.strain")]
    # The section's x points down, and what is below the axis of a beam that sags is compressed.
    assert strain == pytest.approx(-moment / STIFFNESS * 0.5 * WIDTH, rel=5e-4)


def test_levels_agree_in_their_slowest_frequency() -> None:
    # 1.8751^2 sqrt(EI / rho A L^4), the first root of cos b cosh b = -1.
    expected = 1.8751040687**2 * math.sqrt(STIFFNESS / LINE_DENSITY / LENGTH**4)
    for level in LEVELS:
        found = first_frequency(cantilever(level, load=0.0, gravity=0.0))
        assert found == pytest.approx(expected, rel=1e-3), level


def test_a_rigid_beam_is_a_body() -> None:
    model = cantilever("rigid", load=0.0)
    assert model.coordinates == ("pin",)
    mass = LINE_DENSITY * LENGTH
    inertia = 0.01 + mass * LENGTH**2 / 3 + mass * WIDTH**2 / 12
    expected = mass * G * LENGTH / 2 / inertia
    assert acceleration(model, np.zeros(1), np.zeros(1)) == pytest.approx([expected], rel=1e-9)


def test_levels_may_be_mixed() -> None:
    model = Model.from_toml(ARM).at({"upper": "rigid"})
    core = Dynamics(model.core, model.theta)
    n = len(model.coordinates)
    assert model.coordinates[:3] == ("shoulder", "elbow", "fore.bending_x.0")
    mass = core.mass_matrix(np.zeros(n))
    effort = core.inverse_dynamics(np.zeros(n), np.zeros(n), np.ones(n)) - core.inverse_dynamics(*np.zeros((3, n)))
    assert effort == pytest.approx(mass @ np.ones(n), rel=1e-9)


def test_a_beam_alone_vibrates() -> None:
    strip = {**cantilever("strain(3)", load=0.0).to_dict()["beams"]["strip"], "parent": "world"}
    model = Model.from_dict({"name": "strip", "gravity": [0.0, 0.0, 0.0], "beams": {"strip": strip}})
    assert model.joints == ()
    expected = 1.8751040687**2 * math.sqrt(STIFFNESS / LINE_DENSITY / LENGTH**4)
    assert first_frequency(model) == pytest.approx(expected, rel=1e-3)


@settings(max_examples=40)
@given(trees())
def test_random_trees_are_systems_with_the_named_coordinates(content: dict[str, Any]) -> None:
    model = Model.from_dict(content)
    n = len(model.coordinates)
    if not n:
        return
    assert model.core.n_joints == len(model.joints)
    assert model.core.n_coordinates == n
    assert model.core.n_states == len(model.state_names)
    assert model.core.n_outputs == len(model.output_channels)
    core, rng = Dynamics(model.core, model.theta), np.random.default_rng(0)
    q, v, a = 0.01 * rng.normal(size=(3, n))
    mass = core.mass_matrix(q)
    size = float(np.abs(mass).max())
    assert mass == pytest.approx(mass.T, rel=1e-9, abs=1e-12 * size)
    effort = core.inverse_dynamics(q, v, a) - core.inverse_dynamics(q, v, np.zeros(n))
    # What is lost in the difference goes with what is subtracted.
    lost = float(np.abs(core.inverse_dynamics(q, v, np.zeros(n))).max())
    assert effort == pytest.approx(mass @ a, rel=1e-8, abs=1e-12 * (size + lost))
