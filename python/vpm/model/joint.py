"""Joints of a model file, as chains of joints with one coordinate each, which is all that the core knows.

| type | its joints | directions |
| --- | --- | --- |
| prismatic, revolute, helical | itself | its axis |
| cylindrical | ``_rotation``, ``_translation`` | its axis |
| planar | ``_x``, ``_y``, ``_rotation`` | two in the plane, then its axis, the normal of the plane |
| spherical | ``_x``, ``_y``, ``_z`` | x, then the y that x has turned, then the z that both have turned |
| free | ``_x``, ``_y``, ``_z``, ``_rx``, ``_ry``, ``_rz`` | ways along x, y, z, then angles as spherical |
| fixed | none | |

A coordinate grows as the child turns about its direction by the right hand, or shifts along it. An axis has the same
numbers in the frame of the joint and in that of the child.

The lower pairs: F. Reuleaux, "Theoretische Kinematik", 1875; angles of the spherical joint as Cardan angles in J.
Wittenburg, "Dynamics of Multibody Systems", 2008, section 2.1.2. These have a singularity at ``_y`` (``_ry``) = 90
degrees. Whoever steps the machine in time turns spherical and free joints by unit quaternions, if nothing needs their
angles, and shows angles; elsewhere a state near the singularity is refused (crates/vpm-core/src/description/balls.rs).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal

from vpm.catalogue import JointKind
from vpm.errors import near_match
from vpm.model.component import Component
from vpm.model.entry import ORIGIN, Entry, Number, ParameterValue, Switch, Text, Vector
from vpm.model.messages import Problem, place
from vpm.model.parameters import NOT_NEGATIVE, Rule
from vpm.model.pose import Pose, pose, rotation_matrix

if TYPE_CHECKING:
    from vpm.model.structure import Structure

Direction = tuple[float, float, float]
JointType = Literal["prismatic", "revolute", "helical", "cylindrical", "planar", "spherical", "free", "fixed"]

COORDINATE_UNIT: Mapping[JointKind, str] = {"prismatic": "m", "revolute": "rad", "helical": "rad"}
EFFORT_UNIT: Mapping[JointKind, str] = {"prismatic": "N", "revolute": "N m", "helical": "N m"}
#: Kind of joint that the shaft of a transmission is like: it turns, and its effort is a torque.
TURNING: JointKind = "revolute"

#: Coordinates of each type, from the parent on: what their names add to that of the joint, their kinds, and the numbers
#: of their directions among the axis, the two of its plane, and x, y, z of the joint frame.
COORDINATES: Mapping[JointType, tuple[tuple[str, JointKind, int], ...]] = {
    "prismatic": (("", "prismatic", 0),),
    "revolute": (("", "revolute", 0),),
    "helical": (("", "helical", 0),),
    "cylindrical": (("_rotation", "revolute", 0), ("_translation", "prismatic", 0)),
    "planar": (("_x", "prismatic", 1), ("_y", "prismatic", 2), ("_rotation", "revolute", 0)),
    "spherical": (("_x", "revolute", 3), ("_y", "revolute", 4), ("_z", "revolute", 5)),
    "free": (
        *(("_x", "prismatic", 3), ("_y", "prismatic", 4), ("_z", "prismatic", 5)),
        *(("_rx", "revolute", 3), ("_ry", "revolute", 4), ("_rz", "revolute", 5)),
    ),
    "fixed": (),
}
SUFFIXES = {kind: tuple(suffix for suffix, _, _ in parts) for kind, parts in COORDINATES.items()}

#: Joints that turn anyhow, by three angles.
ANGULAR: tuple[JointType, ...] = ("spherical", "free")
#: Their channels: unit quaternion of the child in the frame of the joint, angular velocity in axes of the child.
BALL: Mapping[str, str] = {
    **dict.fromkeys(("qw", "qx", "qy", "qz"), "1"),
    **dict.fromkeys(("wx", "wy", "wz"), "rad/s"),
}

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)

#: A joint axis may be this far from unit length; it is then normalised.
AXIS_TOLERANCE = 1e-3


@dataclass(frozen=True)
class Coordinate:
    """One coordinate of a joint."""

    name: str  #: The joint's own, or with the suffix of the coordinate.
    kind: JointKind  #: One of "prismatic", "revolute", "helical".
    direction: Direction  #: Unit vector in the joint frame.
    pitch: float = 0.0  #: Travel per angle of a helical joint (m/rad).


class DenavitHartenberg(Entry):
    """Place of a joint by four numbers (m, rad), in the standard or in the modified convention."""

    a: Number = 0.0
    alpha: Number = 0.0
    d: Number = 0.0
    theta: Number = 0.0
    convention: Literal["standard", "modified"] = "standard"

    def poses(self) -> tuple[Pose, Pose]:
        """Constant transforms before and after the joint, whose axis is z of the frame between them.

        Standard: ``Rot_z(theta + q) Trans_z(d) Rot_x(alpha) Trans_x(a)``, the joint comes first
        (J. Denavit and R. Hartenberg, *Journal of Applied Mechanics* 22, 1955; B. Siciliano et al., "Robotics", 2009,
        equation 2.52). Modified: ``Rot_x(alpha) Trans_x(a) Rot_z(theta + q) Trans_z(d)``, the joint comes last
        (J. Craig, "Introduction to Robotics", 3rd edition, equation 3.6).
        """
        along_x = Pose((self.a, 0.0, 0.0), rotation_matrix(self.alpha, 0.0, 0.0))
        along_z = Pose((0.0, 0.0, self.d), rotation_matrix(0.0, 0.0, self.theta))
        if self.convention == "standard":
            return Pose(), along_z @ along_x
        return along_x @ along_z, Pose()


class Joint(Component):
    """Joint between a body and its parent, a body or a beam; its frame is the frame of the child.

    Without `inertia_coupling` the mass matrix has no entries between what is inward of it and what is beyond.
    """

    type: JointType
    parent: Text
    child: Text
    at: Number | None = None
    axis: Vector | None = None
    pitch: Number | None = None
    rotor_inertia: Annotated[ParameterValue | None, Rule("", NOT_NEGATIVE, kind="linear")] = None
    translation: Vector = ORIGIN
    rotation: Vector = ORIGIN
    dh: DenavitHartenberg | None = None
    inertia_coupling: Switch = True

    def coordinate_names(self, name: str) -> tuple[str, ...]:
        """Names of the coordinates of a joint."""
        return tuple(f"{name}{suffix}" for suffix in SUFFIXES[self.type])

    def coordinates(self, name: str) -> tuple[Coordinate, ...]:
        """Coordinates of a checked joint, in their order from the parent on."""
        axis = unit(self.axis) if self.axis is not None else Z
        ways, pitch = (axis, *plane(axis), X, Y, Z), self.pitch or 0.0
        parts = COORDINATES[self.type]
        return tuple(Coordinate(f"{name}{suffix}", kind, ways[way], pitch) for suffix, kind, way in parts)

    def poses(self) -> tuple[Pose, Pose]:
        """Constant poses before and after a joint's motion."""
        return (pose(self.translation, self.rotation), Pose()) if self.dh is None else self.dh.poses()

    def form_problems(self, name: str) -> Iterator[Problem]:
        """Problems of a joint's form: axes and pitches missing, wrong or useless; its place said twice."""
        for key in ("axis", "translation", "rotation"):
            if self.dh is not None and key in self.model_fields_set and getattr(self, key) not in (None, (0.0,) * 3):
                rest = f"says with dh where the joint is, and with {key} as well; remove one (with dh, the axis is z)"
                yield Problem(place("joints", name), rest)
        yield from self._axis_problems(place("joints", name, "axis"))
        yield from self._pitch_problems(place("joints", name, "pitch"))
        if self.rotor_inertia is not None and self.type not in {"prismatic", "revolute", "helical"}:
            rest = f"is given, but a {self.type} joint has no single coordinate that a rotor could turn with; remove it"
            yield Problem(place("joints", name, "rotor_inertia"), rest)

    def _axis_problems(self, where: str) -> Iterator[Problem]:
        if self.type in {"fixed", "spherical", "free"}:
            if self.axis is not None:
                yield Problem(where, f"is given, but a {self.type} joint has no axis; remove it")
            return
        if self.axis is None:
            if self.dh is None:
                yield Problem(where, "is missing; add it, for example axis = [1.0, 0.0, 0.0]")
            return
        length = math.hypot(*self.axis)
        if abs(length - 1.0) > AXIS_TOLERANCE:
            shown = ", ".join(f"{component:g}" for component in self.axis)
            repair = "divide it by its length" if length > 0.0 else "give it a direction"
            yield Problem(where, f"is [{shown}] with length {length:.6g}, but has to have length 1; {repair}")

    def _pitch_problems(self, where: str) -> Iterator[Problem]:
        if self.type != "helical":
            if self.pitch is not None:
                yield Problem(where, f'is given, but a {self.type} joint has none; remove it, or take type = "helical"')
        elif self.pitch is None:
            yield Problem(
                where, "is missing; add the travel in m per rad, for example pitch = 0.0008 for 5 mm per turn"
            )
        elif self.pitch == 0.0:
            yield Problem(
                where, 'is 0, but a helical joint travels as it turns; give m per rad, or take type = "revolute"'
            )

    def units(self, name: str, structure: Structure) -> Mapping[str, str]:
        """SI unit of the inertia that a drive's rotor adds to a joint, ratio squared times its own."""
        kind = "" if self.rotor_inertia is None else structure.joint_kind(name)
        return {"rotor_inertia": "kg" if kind == "prismatic" else "kg m^2"}


def unit(vector: tuple[float, ...]) -> Direction:
    """Unit vector of a joint's axis in the direction of a vector that is not zero."""
    x, y, z = (component / math.hypot(*vector) for component in vector)
    return (x, y, z)


def plane(normal: Direction) -> tuple[Direction, Direction]:
    """Directions x and y of a planar joint.

    x is the frame axis after the one that the normal is nearest to, made orthogonal to the normal; with it and y, the
    normal completes a right-handed frame. So the plane with normal z has the directions x and y, the one with normal x
    has y and z.
    """
    nearest = max(range(3), key=lambda k: abs(normal[k]))
    along = (X, Y, Z)[(nearest + 1) % 3]
    share = normal[(nearest + 1) % 3]
    x, y, z = unit(tuple(a - share * n for a, n in zip(along, normal, strict=True)))
    a, b, c = normal
    return (x, y, z), (b * z - c * y, c * x - a * z, a * y - b * x)


def coordinate_problems(where: str, joint: str, structure: Structure) -> Iterator[Problem]:
    """A joint that is not there, or has not one coordinate."""
    if joint in structure.joints:
        return
    if joint in structure.document.joints:
        parts = [axis.name for axis in structure.axes if axis.joint == joint]
        repair = f"name one of its coordinates, {', '.join(parts)}" if parts else "name a joint that moves"
        kind = structure.document.joints[joint].type
        yield Problem(where, f'is "{joint}", a {kind} joint, which has {len(parts) or "no"} coordinates; {repair}')
        return
    repair = near_match(joint, structure.joints, what="it has")
    yield Problem(where, f'is "{joint}", which is no joint of the model; {repair}')
