"""What a file of a robot says, whichever format it has: links, joints, shafts and drives."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from vpm.model.joint import JointType
from vpm.model.pose import Pose
from vpm.numbers import Array

Vector = tuple[float, ...]

#: Joints with one coordinate.
SINGLE: tuple[JointType, ...] = ("revolute", "prismatic")
ORIGIN: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Inertial:
    """Mass (kg), centre of mass (m), inertia about it (kg m^2: xx yy zz xy xz yz), in the axes of its link."""

    mass: float
    center: Vector = ORIGIN
    inertia: Vector = (0.0,) * 6

    @property
    def matrix(self) -> Array:
        """Inertia of a robot's part about the centre of mass as a matrix, shape (3, 3)."""
        xx, yy, zz, xy, xz, yz = self.inertia
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])

    @property
    def spread(self) -> float:
        """Root mean square distance of a part's mass from its centre (m)."""
        return float(np.sqrt(max(sum(self.inertia[:3]), 0.0) / (2.0 * self.mass)))


@dataclass(frozen=True)
class Mimic:
    """A joint that follows another: coordinate = multiplier times that of the other + offset."""

    joint: str
    multiplier: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class Joint:
    """Joint between two links; numbers in SI units, `angles` are roll, pitch, yaw of its frame in that of its parent.

    `lower`, `upper`, `effort` and `speed` are its limits, None without; `rotor` is the inertia that a drive adds,
    `stiffness` and `rest` are those of a spring.
    """

    name: str
    kind: JointType
    parent: str
    child: str
    translation: Vector = ORIGIN
    angles: Vector = ORIGIN
    axis: Vector | None = None
    lower: float | None = None
    upper: float | None = None
    effort: float | None = None
    speed: float | None = None
    viscous: float = 0.0
    coulomb: float = 0.0
    rotor: float = 0.0
    stiffness: float = 0.0
    rest: float = 0.0
    mimic: Mimic | None = None


@dataclass(frozen=True)
class Shaft:
    """Shaft that turns with several joints, by ratios."""

    name: str
    ratios: dict[str, float]


@dataclass(frozen=True)
class Drive:
    """Drive on a joint or on a shaft: effort = gain times command, at most `limit`."""

    name: str
    joint: str | None = None
    shaft: str | None = None
    gain: float = 1.0
    unit: str | None = None
    limit: float | None = None


@dataclass(frozen=True)
class Frame:
    """Frame that is fixed to a link and has no mass."""

    name: str
    link: str
    place: Pose


@dataclass
class Robot:
    """A robot as its file says it, with `notes` of what was left out or changed.

    `drives` is None where the file does not say which joints are driven.
    """

    name: str
    path: str
    gravity: Vector = (0.0, 0.0, -9.81)
    links: dict[str, Inertial | None] = field(default_factory=dict)
    joints: dict[str, Joint] = field(default_factory=dict)
    shafts: list[Shaft] = field(default_factory=list)
    drives: list[Drive] | None = None
    frames: list[Frame] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def moved(inertial: Inertial, place: Pose) -> Inertial:
    """Mass and inertia of a robot's part in another frame."""
    if place == Pose():
        return inertial
    turn = np.reshape(place.rotation, (3, 3))
    center = np.asarray(place.translation) + turn @ np.asarray(inertial.center)
    return Inertial(inertial.mass, rounded(center), entries(turn @ inertial.matrix @ turn.T))


def together(parts: Sequence[Inertial]) -> Inertial:
    """Mass and inertia of several parts of a link in one frame, by the theorem of parallel axes.

    (J. Wittenburg, "Dynamics of Multibody Systems", 2008, section 3.1.)
    """
    if len(parts) == 1:
        return parts[0]
    mass = sum(part.mass for part in parts)
    center = sum((part.mass * np.asarray(part.center) for part in parts), np.zeros(3)) / mass
    matrix = sum((part.matrix + offset(part, center) for part in parts), np.zeros((3, 3)))
    return Inertial(mass, rounded(center), entries(matrix))


def without(whole: Inertial, parts: Sequence[Inertial]) -> Inertial:
    """Mass and inertia of a body without some of its parts; its mass has to be above theirs."""
    if not parts:
        return whole
    mass = whole.mass - sum(part.mass for part in parts)
    moment = whole.mass * np.asarray(whole.center) - sum(part.mass * np.asarray(part.center) for part in parts)
    left = Inertial(mass, rounded(moment / mass))
    matrix = whole.matrix - sum(
        (part.matrix + offset(part, np.asarray(whole.center)) for part in parts), np.zeros((3, 3))
    )
    return Inertial(mass, left.center, entries(matrix - offset(left, np.asarray(whole.center))))


def offset(part: Inertial, center: Array) -> Array:
    """Inertia of the mass of a part, in its centre, about another point."""
    arm = np.asarray(part.center) - center
    return np.asarray(part.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm)))


def entries(matrix: Array) -> Vector:
    """Entries xx yy zz xy xz yz of a part's inertia."""
    return rounded(matrix[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]])


def rounded(values: Array) -> Vector:
    """Numbers of a robot's part without rounding errors: 15 digits of the largest."""
    size = float(np.abs(values).max(initial=0.0))
    if size == 0.0 or not np.isfinite(size):
        return tuple(values.tolist())
    digits = 14 - int(np.floor(np.log10(size)))
    return tuple(round(value, digits) + 0.0 for value in values.tolist())


def angles_of(place: Pose) -> Vector:
    """Roll, pitch, yaw of a part's rotation, R = Rz(yaw) Ry(pitch) Rx(roll), right also at singular angles.

    The yaw is taken of what the roll leaves, so that an error of the one is made good by the other (G. Slabaugh,
    "Computing Euler angles from a rotation matrix", 1999, has the case of the shared axis apart).
    """
    R = np.reshape(place.rotation, (3, 3))
    roll = float(np.arctan2(R[2, 1], R[2, 2]))
    pitch = float(np.arctan2(-R[2, 0], np.hypot(R[0, 0], R[1, 0])))
    s, c = np.sin(roll), np.cos(roll)
    yaw = float(np.arctan2(s * R[0, 2] - c * R[0, 1], c * R[1, 1] - s * R[1, 2]))
    return rounded(np.array([roll, pitch, yaw]))
