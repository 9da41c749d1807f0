"""From a model and a motion to a scene."""

from collections.abc import Iterator, Mapping

import numpy as np

from vpm.errors import SimulationError
from vpm.model import Model
from vpm.numbers import Array
from vpm.view.course import Course
from vpm.view.scene import Arrow, Scene, Shape
from vpm.view.skeleton import Pose, Skeleton, plane, round_down

#: Length of the longest arrow of its kind, as a share of the size of the machine.
LONGEST = 0.45
#: Beyond this size (m) nothing is a machine.
LARGEST = 1e6
#: How far the eye is raised over a side view (rad), and turned about the vertical in a view from a corner.
RAISED, TURNED = 0.30, 0.75


def scene_of(model: Model, course: Course) -> Scene:
    """Build the scene of a machine in a motion, as shapes."""
    skeleton = Skeleton(model)
    pose = skeleton.pose(course.coordinates)
    if not pose.size < LARGEST:
        raise SimulationError(
            f"{model.name} spreads over {pose.size:.3g} m in this motion, more than {LARGEST:g} m; the run has diverged"
        )
    shapes = [*skeleton.shapes(pose)]
    if course.measured is not None:
        shapes += skeleton.ghost(skeleton.pose(course.measured, pose.size))
    scales: dict[str, str] = {}
    shapes += _forces(skeleton, pose, course.loads, scales)
    up = _up(model)
    if not skeleton.contacts:
        lowest = min(float(np.min(shape.points @ up)) for shape in shapes) if shapes else 0.0
        shapes += plane("floor", "floor", (lowest - 0.04 * pose.size) * up, up, pose)
    front = _front(skeleton, pose, up)
    return Scene(
        model.name,
        course.subtitle,
        course.time,
        tuple(shapes),
        up,
        front,
        scales,
        round_down(pose.size / 6.0),
        course.notes,
    )


def _up(model: Model) -> Array:
    gravity = np.array(model.gravity)
    strength = float(np.linalg.norm(gravity))
    return np.array([0.0, 0.0, 1.0]) if strength == 0.0 else -gravity / strength


def _front(skeleton: Skeleton, pose: Pose, up: Array) -> Array:
    """Front view to build: a plane machine from its side, any other one from a corner."""
    hinges = [skeleton.joints[name] for name in skeleton.joints if name in skeleton.turning]
    axes = [direction @ pose.axes[0, frame] for frame, direction in hinges]
    parallel = all(abs(axis @ axes[0]) > 1.0 - 1e-9 for axis in axes)
    points = (pose.origins - pose.origins[:1, :1]).reshape(-1, 3)
    flat = np.linalg.svd(points, full_matrices=False)[2][-1] if len(points) > 2 else np.zeros(3)
    thin = bool(flat.any()) and float(np.max(np.abs(points @ flat))) < 1e-6 * pose.size
    # The way across the plane is that of hinges, where there are any: a straight machine has no plane of its own.
    across = None
    if axes and parallel and abs(axes[0] @ up) < 0.1:
        across = axes[0]
    elif not axes and thin and abs(flat @ up) < 0.1:
        across = flat
    if across is None:
        side = np.cross(up, np.eye(3)[int(np.argmin(np.abs(up)))])
        side /= np.linalg.norm(side)
        across = np.cos(TURNED) * side + np.sin(TURNED) * np.cross(up, side)
    across = across - (across @ up) * up
    across /= np.linalg.norm(across)
    # The axis that points most to the right of the picture shall do so in the positive sense.
    right = np.cross(up, across)
    if right[int(np.argmax(np.abs(right)))] < 0.0:
        across = -across
    return np.asarray(np.cos(RAISED) * across + np.sin(RAISED) * up)


def _forces(skeleton: Skeleton, pose: Pose, loads: Mapping[str, Array], scales: dict[str, str]) -> Iterator[Shape]:
    """Build arrows of forces and torques, in one round scale for each kind."""
    found: dict[str, list[tuple[str, Array, Array]]] = {}
    for role, name, start, vector in _vectors(skeleton, pose, loads):
        if np.max(np.linalg.norm(vector, axis=1)) > 0.0:
            found.setdefault(role, []).append((name, start, vector))
    for role, arrows in found.items():
        most = max(float(np.max(np.linalg.norm(vector, axis=1))) for _, _, vector in arrows)
        length = round_down(LONGEST * pose.size / 2.0)
        # A round number that the longest arrow does not exceed.
        stands = 1.0 / round_down(LONGEST * pose.size / most / length)
        scales[role] = f"{length:g} m is {stands:g} {'N m' if role == 'torque' else 'N'}"
        for name, start, vector in arrows:
            yield Arrow(name, role, start, start + vector * (length / stands), 0.007 * pose.size)


def _vectors(skeleton: Skeleton, pose: Pose, loads: Mapping[str, Array]) -> Iterator[tuple[str, str, Array, Array]]:
    """Role, name, point and vector (N or N m) of every force, to build arrows."""
    for name, frame in skeleton.contacts.items():
        if all(f"{name}.{way}" in loads for way in ("fx", "fy", "fz")):
            force = np.column_stack([loads[f"{name}.{way}"] for way in ("fx", "fy", "fz")])
            yield "contact force", name, pose.origins[:, frame], force
    for name, (start, end) in skeleton.lines.items():
        if f"{name}.tension" in loads:
            along = pose.origins[:, end] - pose.origins[:, start]
            along = along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
            yield "drive force", name, pose.origins[:, end], loads[f"{name}.tension"][:, None] * along
    for name, (frame, direction) in skeleton.joints.items():
        if f"{name}.effort" in loads:
            axis = np.einsum("i,nij->nj", direction, pose.axes[:, frame])
            role = "torque" if name in skeleton.turning else "drive force"
            yield role, name, pose.origins[:, frame], loads[f"{name}.effort"][:, None] * axis
