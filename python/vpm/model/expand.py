"""Joints of the file as chains of joints with one coordinate each, which is all that the core knows.

| type | its joints | directions |
| --- | --- | --- |
| prismatic, revolute, helical | itself | its axis |
| cylindrical | ``_rotation``, ``_translation`` | its axis |
| planar | ``_x``, ``_y``, ``_rotation`` | two in the plane, then its axis, the normal of the plane |
| spherical | ``_x``, ``_y``, ``_z`` | x, then the y that x has turned, then the z that both have turned |
| free | ``_x``, ``_y``, ``_z``, ``_rx``, ``_ry``, ``_rz`` | ways along x, y, z, then angles as spherical |
| fixed | none | |

The lower pairs: F. Reuleaux, "Theoretische Kinematik", 1875; angles of the spherical joint as Cardan angles in J.
Wittenburg, "Dynamics of Multibody Systems", 2008, section 2.1.2. These have a singularity at ``_y`` (``_ry``) = 90
degrees. Whoever steps the machine in time turns spherical and free joints by unit quaternions, if nothing needs their
angles, and shows angles; elsewhere a state near the singularity is refused (crates/vpm-core/src/description/balls.rs).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from vpm.catalogue import JointKind
from vpm.model.schema import Joint, JointType

Direction = tuple[float, float, float]

#: What the names of its coordinates add to that of a joint.
SUFFIXES: Mapping[JointType, tuple[str, ...]] = {
    "prismatic": ("",),
    "revolute": ("",),
    "helical": ("",),
    "cylindrical": ("_rotation", "_translation"),
    "planar": ("_x", "_y", "_rotation"),
    "spherical": ("_x", "_y", "_z"),
    "free": ("_x", "_y", "_z", "_rx", "_ry", "_rz"),
    "fixed": (),
}

#: Joints that turn anyhow, by three angles.
ANGULAR: tuple[JointType, ...] = ("spherical", "free")

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Coordinate:
    """One coordinate of a joint.

    Attributes
    ----------
    name : str
        The joint's own, or with the suffix of the coordinate.
    kind : {"prismatic", "revolute", "helical"}
    direction : tuple of float
        Unit vector in the joint frame.
    pitch : float
        Travel per angle of a helical joint (m/rad).
    """

    name: str
    kind: JointKind
    direction: Direction
    pitch: float = 0.0


def coordinate_names(name: str, joint: Joint) -> tuple[str, ...]:
    """Names of the coordinates of a joint."""
    return tuple(f"{name}{suffix}" for suffix in SUFFIXES[joint.type])


def coordinates(name: str, joint: Joint) -> tuple[Coordinate, ...]:
    """Coordinates of a joint that was checked, in the order in which they follow each other from the parent on."""
    axis = unit(joint.axis) if joint.axis is not None else Z
    names = coordinate_names(name, joint)
    match joint.type:
        case "prismatic" | "revolute" | "helical":
            return (Coordinate(name, joint.type, axis, joint.pitch or 0.0),)
        case "cylindrical":
            return (Coordinate(names[0], "revolute", axis), Coordinate(names[1], "prismatic", axis))
        case "planar":
            first, second = plane(axis)
            return (
                Coordinate(names[0], "prismatic", first),
                Coordinate(names[1], "prismatic", second),
                Coordinate(names[2], "revolute", axis),
            )
        case "spherical":
            return tuple(Coordinate(n, "revolute", d) for n, d in zip(names, (X, Y, Z), strict=True))
        case "free":
            ways = tuple(Coordinate(n, "prismatic", d) for n, d in zip(names[:3], (X, Y, Z), strict=True))
            return (*ways, *(Coordinate(n, "revolute", d) for n, d in zip(names[3:], (X, Y, Z), strict=True)))
        case "fixed":
            return ()


def unit(vector: tuple[float, ...]) -> Direction:
    """Unit vector in the direction of a vector that is not zero."""
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
