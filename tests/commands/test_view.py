"""What is drawn of a machine is where other formulas say it is, and in the colours that the legend says."""

import base64
import json
import re
from pathlib import Path

import numpy as np
import pytest

import vpm
from command_line import vpm as command
from places import ROOT
from textbook_arm import FILE, LENGTHS
from view_scenes import AHEAD, arm_scene, hits, tubes
from vpm.errors import ExperimentError, SimulationError, VpmError
from vpm.experiment import Experiment
from vpm.numbers import Array
from vpm.scenario import Scenario, ScenarioRun
from vpm.view import Arrow, Box, Course, Sphere, Tube, course_of, scene_of
from vpm.view.bodies import DENSITY, box_of, sphere_radius
from vpm.view.film import draw, film_samples, picture, write_film
from vpm.view.frames import Frames
from vpm.view.mesh import mesh_of
from vpm.view.page import page_of

#: One joint, and one link whose strain is constant along it: its axis is an arc.
ARC = """
name = "arc"
gravity = [0.0, 0.0, -9.81]
bodies.hub = { mass = 1.0, inertia = [0.002, 0.002, 0.002, 0.0, 0.0, 0.0] }
joints.turn = { type = "revolute", parent = "world", child = "hub", axis = [0.0, 1.0, 0.0] }
[beams.strip]
parent = "hub"
length = 0.5
level = "strain(1)"
deforms = ["bending_y"]
material = { young = 206e9, density = 7850.0 }
section = { shape = "circle", diameter = 0.006 }
"""


def ends(q: Array) -> tuple[Array, Array]:
    """Elbow and tip (N, 3) of the textbook arm by its formulas."""
    (l1, l2), both = LENGTHS, q[:, 0] + q[:, 1]
    elbow = np.column_stack([l1 * np.cos(q[:, 0]), l1 * np.sin(q[:, 0]), np.zeros(len(q))])
    return elbow, elbow + np.column_stack([l2 * np.cos(both), l2 * np.sin(both), np.zeros(len(q))])


@pytest.fixture(scope="session")
def landing() -> tuple[vpm.Model, ScenarioRun]:
    runs = Scenario.load(ROOT / "examples/hyl/hydraulic_drop.toml").run()
    return vpm.Model.load(ROOT / "examples/hyl/hydraulic.toml"), runs


# ---- places ----------------------------------------------------------------------------------------------------------


def test_links_and_masses_are_where_the_textbook_says() -> None:
    q, scene = arm_scene()
    elbow, tip = ends(q)
    first, second = ([tube for tube in tubes(scene, "link") if tube.name == name] for name in ("first", "second"))
    for found, expected in ((first[0], (0.0 * elbow, elbow)), (second[0], (elbow, tip))):
        np.testing.assert_allclose(found.path, np.stack(expected, axis=1), atol=1e-12)
    spheres = {shape.name: shape for shape in scene.shapes if isinstance(shape, Sphere)}
    np.testing.assert_allclose(spheres["first"].centre, elbow, atol=1e-12)
    np.testing.assert_allclose(spheres["second"].centre, tip, atol=1e-12)


def test_the_measured_machine_is_where_it_was_measured() -> None:
    q, scene = arm_scene()
    elbow, tip = ends(q + AHEAD)
    found = {tube.name: tube.path for tube in tubes(scene, "measured")}
    np.testing.assert_allclose(found["first"][:, 1], elbow, atol=1e-12)
    np.testing.assert_allclose(found["second"][:, 1], tip, atol=1e-12)


def test_frames_turn_with_their_joints() -> None:
    q, scene = arm_scene()
    (x,) = [shape for shape in scene["two"] if isinstance(shape, Arrow) and shape.role == "x"]
    way = (x.end - x.start) / np.linalg.norm(x.end - x.start, axis=1, keepdims=True)
    both = q.sum(axis=1)
    np.testing.assert_allclose(way, np.column_stack([np.cos(both), np.sin(both), 0.0 * both]), atol=1e-12)


def test_a_link_of_constant_curvature_is_an_arc() -> None:
    model = vpm.Model.from_toml(ARC)
    curvature = np.array([-3.0, 1e-3, 2.0, 6.0])
    turn = np.array([0.3, -1.0, 0.0, 2.0])
    scene = scene_of(model, Course("", np.arange(4.0), np.column_stack([turn, curvature])))
    (strip,) = tubes(scene, "beam")
    s = np.linspace(0.0, 0.5, strip.path.shape[1])
    angle = curvature[:, None] * s
    across, along = (1.0 - np.cos(angle)) / curvature[:, None], np.sin(angle) / curvature[:, None]
    sine, cosine = np.sin(turn)[:, None], np.cos(turn)[:, None]  # about y: x to -z, z to x
    expected = np.stack([cosine * across + sine * along, 0.0 * angle, cosine * along - sine * across], axis=-1)
    np.testing.assert_allclose(strip.path, expected, atol=1e-9)
    np.testing.assert_allclose(strip.radius, 0.003)


def test_a_line_is_as_long_as_the_run_says_and_forces_have_the_scale_of_the_legend(
    landing: tuple[vpm.Model, ScenarioRun],
) -> None:
    model, runs = landing
    scene, run = scene_of(model, course_of(model, runs)), runs["low gain"]
    (barrel,), (rod,) = (
        [tube for tube in tubes(scene, role) if tube.name == "hip_cylinder"] for role in ("barrel", "rod")
    )
    length = np.linalg.norm(rod.path[:, 1] - barrel.path[:, 0], axis=1)
    np.testing.assert_allclose(length, run["hip_cylinder.length"], atol=1e-9)
    (force,) = [shape for shape in scene["foot"] if isinstance(shape, Arrow)]
    meters, newtons = map(float, re.findall(r"[\d.e+]+", scene.scales["contact force"]))
    measured = np.column_stack([run[f"foot.f{way}"] for way in "xyz"])
    np.testing.assert_allclose((force.end - force.start) * newtons / meters, measured, atol=1e-9 * np.max(measured))
    assert 0.2 < np.max(np.linalg.norm(force.end - force.start, axis=1)) / scene.bounds[1] < 1.5
    # The foot is on the ground when it pushes.
    pushes = run["foot.normal_force"] > 1.0
    assert np.any(pushes)
    np.testing.assert_allclose(force.start[pushes, 1], -run["foot.depth"][pushes], atol=1e-9)


def test_boxes_have_the_inertia_of_the_body_and_spheres_its_mass() -> None:
    size, mass = np.array([0.1, 0.3, 0.2]), 2.0
    turned = np.linalg.qr(np.random.default_rng(1).standard_normal((3, 3)))[0]
    moments = mass / 12.0 * (np.sum(size**2) - size**2)
    found = box_of(mass, turned @ np.diag(moments) @ turned.T)
    assert found is not None
    axes, sides = found
    order = np.argsort(sides)
    np.testing.assert_allclose(sides[order], np.sort(size), rtol=1e-9)
    np.testing.assert_allclose(np.abs(axes[order] @ turned[:, np.argsort(size)]), np.eye(3), atol=1e-9)
    rod = box_of(0.9, np.diag([0.0, 3e-3, 3e-3]))
    assert rod is not None
    assert np.prod(rod[1]) * DENSITY == pytest.approx(0.9)
    assert box_of(1e-6, np.eye(3) * 1e-9) is None, "lighter than any foam"
    assert 4.0 / 3.0 * np.pi * sphere_radius(2.7) ** 3 * DENSITY == pytest.approx(2.7)


def test_meshes_are_closed_and_look_outward() -> None:
    moving = np.array([[0.0, 0.0, 0.0]])
    shapes = [
        Tube("t", "link", np.array([[[0.0, 0, 0], [0, 0, 1.0], [0, 0.5, 2.0]]]), np.array([0.1, 0.1, 0.1])),
        Sphere("s", "mass", moving, 0.5),
        Box("b", "inertia", moving, np.eye(3)[None], np.array([1.0, 2.0, 3.0])),
        Arrow("a", "x", moving, moving + np.eye(3)[0], 0.02),
    ]
    volumes = []
    for shape in shapes:
        corners, faces = mesh_of([shape], 0)
        a, b, c = corners[faces].transpose(1, 0, 2)
        volumes.append(float(np.einsum("fi,fi->", a, np.cross(b, c)) / 6.0))
    assert volumes[2] == pytest.approx(6.0)
    assert 0.85 < volumes[1] / (4.0 / 3.0 * np.pi * 0.5**3) < 1.0
    assert 0.9 < volumes[0] / (np.pi * 0.1**2 * (1.0 + np.sqrt(1.25))) < 1.0
    assert volumes[3] > 0.0


def test_a_machine_in_a_plane_is_seen_from_its_side() -> None:
    _, scene = arm_scene()
    centre, radius = scene.bounds
    # Gravity along -y, hinges about z: x is to the right, y is up.
    seen = scene.camera(1.5).project(centre + 0.5 * radius * np.eye(3))
    assert seen[0, 0] > abs(seen[0, 1])
    assert seen[1, 1] > abs(seen[1, 0])
    outside = scene.camera(0.5).project(np.concatenate([shape.points.reshape(-1, 3) for shape in scene["second"]]))
    assert np.max(np.abs(outside[:, :2])) < 1.0, "all of it is in the picture of a phone"


# ---- motions ---------------------------------------------------------------------------------------------------------


def test_what_cannot_be_shown_is_refused_in_a_sentence(landing: tuple[vpm.Model, ScenarioRun], tmp_path: Path) -> None:
    model, runs = landing
    arm = vpm.Model.from_toml(FILE)
    with pytest.raises(SimulationError, match="has no run of textbook arm, but of: HyL"):
        course_of(arm, runs)
    with pytest.raises(SimulationError, match="which is not textbook arm"):
        course_of(arm, runs["low gain"])
    silent = Experiment("still", np.arange(90.0), np.ones((90, 1)), ("one.effort",), ("N m",))
    with pytest.raises(ExperimentError, match=r"neither joint positions \(one.position, two.position\) nor commands"):
        course_of(arm, silent)
    model.save(tmp_path / "leg.toml")
    (tmp_path / "arm.toml").write_text(FILE)
    runs.save(tmp_path / "drop.npz")
    for words, said in (
        (["arm.toml", "drop.npz"], "has no run of textbook arm"),
        (["leg.toml", "drop.npz", "--run", "high"], 'has no run "high"'),
        (["leg.toml", "--run", "high"], "none is given"),
        (["leg.toml", "--film", "leg.mp4"], "nothing moves"),
        (["leg.toml", "drop.npz", "--film", "leg.doc"], "no name of a film"),
    ):
        done = command("view", *words, cwd=tmp_path)
        assert done.returncode == 1
        assert said in " ".join(done.stderr.split()), done.stderr


def test_a_slider_at_zero_is_as_large_as_its_mass_and_what_has_diverged_is_told() -> None:
    model = vpm.Model.load(ROOT / "examples/emps/model.toml")
    scene = scene_of(model, course_of(model, None))
    (ball,) = [shape for shape in scene.shapes if isinstance(shape, Sphere)]
    assert ball.radius == pytest.approx(0.07 * 2.0 * sphere_radius(model.parameters["carriage.mass"].value))
    assert np.all(np.isfinite(scene.front))
    with pytest.raises(SimulationError, match=r"spreads over .* m in this motion"):
        scene_of(model, Course("", np.arange(2.0), np.array([[0.0], [1e9]])))


def test_a_log_is_simulated_and_shown_beside_itself() -> None:
    model = vpm.Model.from_toml(FILE)
    t = np.arange(0.0, 1.0, 0.01)
    held = np.tile([-np.pi / 2, 0.0], (t.size, 1))
    log = Experiment(
        "hangs",
        t,
        np.column_stack([held, 0.0 * held]),
        ("one.position", "two.position", "m1.command", "m2.command"),
        ("rad", "rad", "A", "A"),
    )
    course = course_of(model, log)
    assert course.measured is not None
    np.testing.assert_allclose(course.measured, held, atol=1e-12)
    np.testing.assert_allclose(course.coordinates, held, atol=1e-9)  # it hangs at rest
    alone = Experiment("moved", t, held, ("one.position", "two.position"), ("rad", "rad"))
    moved = course_of(model, alone)
    assert moved.measured is None
    assert "as they were measured" in moved.notes[-1]
    np.testing.assert_allclose(moved.coordinates, held[: len(moved.time)], atol=1e-9)


def test_a_run_keeps_how_flexible_links_were_bent(tmp_path: Path) -> None:
    runs = Scenario.load(ROOT / "examples/flexible_pendulum/release.toml").run()
    run = vpm.Run.load(runs["bezier(7)"].save(tmp_path / "run.npz"))
    model = vpm.Model.load(ROOT / "examples/flexible_pendulum/flexible_pendulum.toml")
    scene = scene_of(model, course_of(model, run))
    (strip,) = tubes(scene, "beam")
    tip = np.column_stack([run[f"tip.{way}"] for way in "xyz"])
    # The core integrates the axis from section to section, to fourth order: with more of them it is a little finer.
    np.testing.assert_allclose(strip.path[:, -1], tip, atol=1e-6)
    frames = Frames(model)
    frames.add({"section": {"beam": 0, "at": 1.0}})
    assert run.coordinates is not None
    np.testing.assert_allclose(frames.poses(run.coordinates)[0][:, 0], tip, atol=1e-12)


# ---- drawers ---------------------------------------------------------------------------------------------------------


def test_a_page_needs_nothing_else_and_holds_the_places(landing: tuple[vpm.Model, ScenarioRun]) -> None:
    model, runs = landing
    scene = scene_of(model, course_of(model, runs))
    text = page_of(scene)
    assert len(text) < 2_000_000
    assert not re.search(r"https?://|src=|@import|fetch\(|XMLHttpRequest", text)
    found = re.search(r'<script type="application/json" id="scene">(.*?)</script>', text, re.DOTALL)
    assert found
    content = json.loads(found[1])
    numbers = np.frombuffer(base64.b64decode(content["places"]), "<i2") * content["reach"] / 32767.0
    number = next(k for k, shape in enumerate(scene.shapes) if shape.role == "barrel")
    part = content["shapes"][number]
    places = numbers[part["first"] :][: 3 * part["samples"] * part["count"]].reshape(part["samples"], part["count"], 3)
    np.testing.assert_allclose(places + content["centre"], scene.shapes[number].points, atol=content["reach"] / 32767.0)
    assert content["time"] == pytest.approx(scene.time.tolist())


def test_a_page_of_a_long_record_stays_small_and_names_run_no_code() -> None:
    name = "</script><script>alert(1)</script>"
    model = vpm.Model.from_toml(FILE.replace('"textbook arm"', json.dumps(name)))
    t = np.linspace(0.0, 600.0, 60_001)
    q = np.column_stack([np.sin(t), np.cos(t)])
    text = page_of(scene_of(model, Course("ten minutes", t, q, q)))
    assert len(text) < 2_000_000
    assert "<script>alert" not in text
    assert text.count("</script>") == 2


@pytest.mark.parametrize("dark", [False, True])
def test_a_picture_of_the_film_shows_the_links_where_they_are(*, dark: bool) -> None:
    _, scene = arm_scene()
    pixels = picture(draw(scene, 7, dark=dark, size=(640, 360)))
    assert pixels.shape == (360, 640, 3)
    assert hits(pixels, scene, "link", 7, 0.80, dark=dark) > 0.7
    assert hits(pixels, scene, "link", 25, 0.80, dark=dark) < 0.5, "they are elsewhere at another time"


def test_a_film_is_written(tmp_path: Path) -> None:
    imageio = pytest.importorskip("imageio.v2", reason="imageio is not installed")
    pytest.importorskip("imageio_ffmpeg", reason="imageio-ffmpeg is not installed")
    _, scene = arm_scene()
    samples = film_samples(scene, 10.0)
    assert len(samples) == 6  # 0.2 s at 25 pictures a second, with both ends
    path = write_film(scene, tmp_path / "arm.mp4", speed=10.0)
    with imageio.get_reader(path) as film:
        assert film.count_frames() == len(samples)
        assert film.get_data(0).shape == (720, 1280, 3)
    with imageio.get_reader(write_film(scene, tmp_path / "arm.gif", speed=50.0)) as film:
        assert film.get_length() == 2
        assert film.get_meta_data()["duration"] == pytest.approx(40.0)
    with pytest.raises(VpmError, match="would take 2000 s"):
        film_samples(scene, 1e-3)
