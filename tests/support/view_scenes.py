"""Machines that the tests of the viewer look at, and where in a picture their parts have to be."""

import numpy as np
from numpy.typing import NDArray

import vpm
from places import ROOT
from textbook_arm import FILE
from vpm.numbers import Array
from vpm.scenario import Scenario
from vpm.view import Course, Scene, Tube, course_of, scene_of
from vpm.view.looks import LOOKS, colour

#: How far the measured arm is ahead of the simulated one (rad).
AHEAD = np.array([0.25, 0.1])


def arm_scene() -> tuple[Array, Scene]:
    """The textbook arm along some motion, measured a little ahead."""
    t = np.linspace(0.0, 2.0, 41)
    q = np.column_stack([0.4 + np.sin(t), -0.7 + 0.5 * np.cos(2.0 * t)])
    model = vpm.Model.from_toml(FILE)
    return q, scene_of(model, Course("swings", t, q, q + AHEAD))


def strip_scene() -> Scene:
    model = vpm.Model.load(ROOT / "examples/flexible_pendulum/flexible_pendulum.toml")
    return scene_of(model, course_of(model, Scenario.load(ROOT / "examples/flexible_pendulum/release.toml").run()))


def tubes(scene: Scene, role: str) -> list[Tube]:
    return [shape for shape in scene.shapes if isinstance(shape, Tube) and shape.role == role]


def hits(pixels: NDArray[np.uint8], scene: Scene, role: str, sample: int, stage: float, *, dark: bool) -> float:
    """Share of places along the tubes of a role at which its hue is, where the scene says that they are."""
    height, width = pixels.shape[:2]
    camera = scene.camera(width / height, room=stage)
    share = np.linspace(0.15, 0.85, 40)
    paths = [tube.at(sample) for tube in tubes(scene, role)]
    along = [np.column_stack([np.interp(share, np.linspace(0, 1, len(p)), p[:, i]) for i in range(3)]) for p in paths]
    seen = camera.project(np.concatenate(along))
    columns = np.rint(0.5 * (seen[:, 0] + 1.0) * width - 0.5).astype(int)
    rows = np.rint(0.5 * (1.0 - seen[:, 1]) * height - 0.5).astype(int)
    assert columns.min() >= 0
    assert columns.max() < width
    wanted = np.array(colour(LOOKS[role], dark=dark))
    found = pixels[rows, columns] / 255.0
    # Light changes how bright a part is; of its hue it leaves the direction.
    found, wanted = (np.asarray(c) - np.mean(c, axis=-1, keepdims=True) for c in (found, wanted))
    strength, full = np.linalg.norm(found, axis=-1), float(np.linalg.norm(wanted))
    alike = np.einsum("ni,i->n", found, wanted) > 0.9 * strength * full
    return float(np.mean(alike & (strength > 0.4 * full)))  # the ground has a little of a hue, too


def leg_scene() -> Scene:
    model = vpm.Model.load(ROOT / "examples/hyl/hydraulic.toml")
    return scene_of(model, course_of(model, Scenario.load(ROOT / "examples/hyl/hydraulic_drop.toml").run()))
